"""The motion capture records of the Skybotix CoaX number 56 (ETH Zurich, 2011; mfaessle/coax-control).

A struct `Data` with `time` (n) [s], `position` (3, n) [m], `orientation` (4, n) quaternion x y z w, `lintwist` (3, n)
[m/s] and `angtwist` (3, n) [rad/s] in the world frame, `inputs` (4, n) = upper motor, lower motor, servo roll, servo
pitch. The world is z up (x north here, y west); the body's x points forward, y left, z up.

Read into NED and FRD: y -> -y, z -> -z, quaternion (w, x, -y, -z), which turns (roll, pitch, yaw) into (roll, -pitch,
-yaw). Quaternion signs, zeros and outliers stay as logged. The two servo commands stay as logged too: their sign, zero
and delay differ from flight to flight and are found from the data.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights import units
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers import checks, clocked, frames, mat
from swashplate.flights.readers.checks import Faults
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.schema import QUATERNION

NAME = "coax56"
VERSION = "1"

_ROWS = {"time": 1, "position": 3, "orientation": 4, "lintwist": 3, "angtwist": 3, "inputs": 4}
_UNITS = {"time": "s", "position": "m", "lintwist": "m/s", "angtwist": "rad/s", "inputs": "1"}
_INPUTS = ("motor_upper", "motor_lower", "servo_roll", "servo_pitch")
_ROOM = 100.0  # m: no motion capture room is larger; positions beyond it are in other units
_COMMAND = 2.0  # commands lie in -1..1; a median beyond this is a pulse width or a percentage
_NOTES = (
    "no battery channel: the supply voltage is unknown",
    "angtwist is unreliable (its frame differs between records): derive the rates p q r from the attitude",
    "logged_vx.. and logged_wx.. are the log's own twists in the world frame, with its outliers",
    "x y z is the tracked point, not the centre of gravity",
    "sign, zero and delay of servo_roll and servo_pitch are as logged: find them from the data",
    "flown by a feedback controller, without sweeps",
)


def is_record(variables: Mapping[str, Any]) -> bool:
    """Whether a MATLAB file's variables are a record of the CoaX: a struct `Data` with most of its fields."""
    data = variables.get("Data")
    return isinstance(data, dict) and 2 * len(data.keys() & _ROWS.keys()) >= len(_ROWS)


def _fields(data: Mapping[str, Any], source: Source) -> dict[str, Array]:
    """The struct's fields as arrays of shape (n, rows), checked for presence, type and shape."""
    missing = [name for name in _ROWS if name not in data]
    if missing:
        raise FlightError(
            f"the struct 'Data' lacks {', '.join(missing)}; it has {', '.join(data) or 'nothing'}.",
            where=source.name,
            channel=missing[0],
            hint="A CoaX-56 flight has them all; for your own records say which variables are which in a mapping file.",
        )
    fields: dict[str, Array] = {}
    for name, rows in _ROWS.items():
        array = mat.numbers(data[name])
        if array is None:
            raise FlightError("does not hold real numbers.", where=source.name, channel=f"Data.{name}")
        if array.size == 0:
            raise FlightError("is empty.", where=source.name, channel=f"Data.{name}", hint="Give a longer record.")
        # Loading squeezes single rows and columns; one sample of several rows comes as one row of them.
        turned = np.atleast_1d(array).T
        fields[name] = turned.reshape((1, rows) if array.size == rows else (len(turned), -1))
    samples = len(fields["time"])
    for name, rows in _ROWS.items():
        if fields[name].shape != (samples, rows):
            raise FlightError(
                f"has shape {fields[name].T.shape}, expected ({rows}, {samples}): one column for each time stamp.",
                where=source.name,
                channel=f"Data.{name}",
                hint="Check how the record was cut or saved.",
            )
    return fields


def _in_inside_units(fields: dict[str, Array], source: Source, options: Options) -> dict[str, Array]:
    """Fields in SI units, after the user's `units`; refuses magnitudes that no flight in a room can have."""
    unknown = set(options.units) - set(_UNITS)
    if unknown:
        raise UnitError(
            f"units may be given for {', '.join(_UNITS)}.", where=source.name, channel=", ".join(sorted(unknown))
        )
    converted = dict(fields)
    for name, inside in _UNITS.items():
        unit = options.units.get(name, inside)
        converted[name] = units.to_inside(fields[name], unit, expected=inside, channel=name, where=source.name)
    for name, largest, hint in (
        ("position", _ROOM, "Give --unit position=mm (in Python units={'position': 'mm'}) if it is in millimetres."),
        ("inputs", _COMMAND, "Give --unit inputs=% (in Python units={'inputs': '%'}) if it is in percent."),
    ):
        with np.errstate(over="ignore"):  # a damaged number may be the largest there is
            typical = float(np.median(np.abs(converted[name])))
        if typical > largest:
            magnitude = f"{typical:.4g} {_UNITS[name].replace('1', '')}".strip()
            problem = f"its median magnitude is {magnitude}, expected below {largest:g}: wrong units."
            raise UnitError(problem, where=source.name, channel=f"Data.{name}", hint=hint)
    return converted


def read(variables: Mapping[str, Any], source: Source, options: Options) -> Flight:
    """A CoaX-56 record as a flight with the streams "motion" and "inputs" at the same native stamps.

    Args:
        variables: of the file.
        source: the `.mat` file.
        options: `units` by field (`position`, `lintwist`, `angtwist`, `inputs`, `time`) and `bad_stamps`.

    Returns:
        "motion": x y z [m], qw qx qy qz, logged_vx logged_vy logged_vz [m/s, NED], logged_wx logged_wy logged_wz
        [rad/s, NED]; "inputs": motor_lower, motor_upper, servo_roll, servo_pitch.

    Raises:
        FlightError, UnitError: naming the file, the field, what was found and what to do.
    """
    fields = _fields(variables["Data"], source)
    faults = Faults(source.name)
    for name, values in fields.items():
        with faults.gathered():
            checks.finite(values, channel=f"Data.{name}", where=source.name)
    faults.refuse()
    fields = _in_inside_units(fields, source, options)
    remarks = clocked.Remarks()
    time, keep = clocked.usable(
        fields["time"][:, 0],
        fields.values(),
        where=source.name,
        bad_stamps=options.bad_stamps,
        remarks=remarks,
        channel="Data.time",
    )
    fields = {name: values[keep] for name, values in fields.items()}
    down = frames.axes("north-west-up")
    scalar_first = fields["orientation"][:, (3, 0, 1, 2)]
    quaternion_notes = checks.quaternion_notes(scalar_first, channel="Data.orientation", where=source.name)

    motion: dict[str, Array] = dict(zip(("x", "y", "z"), frames.to_local(fields["position"], down).T, strict=True))
    motion |= zip(QUATERNION, frames.attitude(scalar_first, world=down, body=down).T, strict=True)
    twists = {"logged_v": "lintwist", "logged_w": "angtwist"}
    logged = {
        prefix + axis: values
        for prefix, name in twists.items()
        for axis, values in zip("xyz", frames.to_local(fields[name], down).T, strict=True)
    }
    logged_units = {name: "m/s" if name.startswith("logged_v") else "rad/s" for name in logged}
    by_name = dict(zip(_INPUTS, fields["inputs"].T, strict=True))
    inputs = {name: by_name[name] for name in ("motor_lower", "motor_upper", "servo_roll", "servo_pitch")}

    notes = (*_NOTES, *quaternion_notes, *remarks.notes, *checks.constant_notes(inputs))
    return Flight(
        streams={"motion": stream(time, motion | logged, logged_units), "inputs": stream(time, inputs)},
        provenance=source.provenance(NAME, VERSION, vehicle="coax", notes=notes, damage=tuple(remarks.damage)),
    )
