"""Analogue recorders: a table of volts, made into engineering units by a calibration file, then low-passed.

The calibration is a TOML file, given as the mapping:

    [recorder]
    range = [0, 5]                          # volts that the recorder can tell; a channel may have its own
    rate = 50                               # Hz, where the table has no time column
    # time = {column = "t", unit = "s"}     # where it has one
    # delimiter, header: as for any table (readers/delimited.py)

    [filter]                                # these are the defaults; cutoff = 0 switches it off
    order = 2
    cutoff = 6.0                            # Hz
    zero_phase = true

    [channels.phi]
    column = "AI3"                          # or its number, from 1
    unit = "deg"
    points = [[0.5, -60], [4.5, 60]]        # volts and value, two or more, joined by straight lines

    [channels.servo_pitch]
    column = 4
    unit = "1"
    range = [-5, 5]
    zero = 0.12                             # volts at which it is zero, and
    gain = 0.25                             # its unit per volt

Inputs and outputs go through the same second-order Butterworth low-pass at 6 Hz (Bhandari, Colgren, Lederbogen and
Kowalchuk 2005, AIAA-2005-6422), so that it cancels in their relation; here it runs forwards and backwards by default.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from swashplate import documents
from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights import units
from swashplate.flights.conditioning.filters import lowpass
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers import checks, delimited
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.schema import channel, is_known

NAME = "analogue recorder"
VERSION = "1"

_TABLES = {"recorder", "filter", "channels"}
_RECORDER = {"range", "rate", "time", "delimiter", "header"}
_FILTER = {"order": 2, "cutoff": 6.0, "zero_phase": True}
_CHANNEL = {"column", "unit", "range", "points", "zero", "gain"}
_AT_LIMIT = 0.002  # of the range: a 12-bit converter's last eight steps
_UNEVEN = 0.1  # of a step


def is_calibration(mapping: Mapping[str, Any]) -> bool:
    """Whether a mapping file is the calibration of a recorder: it has a table [recorder]."""
    return "recorder" in mapping


def _refuse(problem: str, source: Source, channel_name: str | None = None, hint: str | None = None) -> FlightError:
    return FlightError(problem, where=source.name, channel=channel_name, hint=hint or "Correct the calibration file.")


def _number(value: object, what: str, source: Source, channel_name: str | None = None) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise _refuse(f"{what} = {value!r} in the calibration is not a number.", source, channel_name)
    return float(value)


def _range(value: object, source: Source, channel_name: str | None = None) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise _refuse(f"range = {value!r} is not two voltages.", source, channel_name, "For example: range = [0, 5].")
    low, high = (_number(v, "range", source, channel_name) for v in value)
    if not low < high:
        raise _refuse(f"range = {value!r} does not rise.", source, channel_name)
    return low, high


def _points(entry: Mapping[str, Any], source: Source, name: str) -> tuple[Array, Array]:
    """Volts (rising) and values of a channel's calibration."""
    if ("points" in entry) == ("gain" in entry):
        raise _refuse("needs either points, or gain and zero.", source, name)
    if "gain" in entry:
        gain = _number(entry["gain"], "gain", source, name)
        zero = _number(entry.get("zero", 0.0), "zero", source, name)
        return np.array([zero, zero + 1.0]), np.array([0.0, gain])
    pairs = entry["points"]
    if not isinstance(pairs, list) or len(pairs) < 2 or any(not isinstance(p, list) or len(p) != 2 for p in pairs):
        raise _refuse(f"points = {pairs!r} are not two or more pairs of volts and value.", source, name)
    table = np.array([[_number(v, "points", source, name) for v in pair] for pair in pairs])
    if not np.all(np.diff(table[:, 0]) > 0.0):
        raise _refuse("the voltages of its points do not rise.", source, name)
    with np.errstate(all="ignore"):
        steep = np.diff(table[:, 1]) / np.diff(table[:, 0])
    if not np.all(np.abs(steep) < documents.LARGEST):
        raise _refuse("two voltages of its points are the same but for rounding.", source, name)
    return table[:, 0], table[:, 1]


def _calibrated(volts: Array, known: Array, values: Array) -> Array:
    """Straight lines through the points, the outer ones carried on."""
    piece = np.clip(np.searchsorted(known, volts) - 1, 0, known.size - 2)
    slope = np.diff(values) / np.diff(known)
    return np.asarray(values[piece] + slope[piece] * (volts - known[piece]))


def _checked(options: Options, source: Source) -> tuple[Mapping[str, Any], Mapping[str, Any], Mapping[str, Any]]:
    """The calibration's three tables, their keys checked."""
    mapping = options.mapping
    recorder, chosen, channels = (mapping.get(key, {}) for key in ("recorder", "filter", "channels"))
    tables: list[tuple[str, object, set[str] | None]] = [
        ("recorder", recorder, _RECORDER),
        ("filter", chosen, set(_FILTER)),
    ]
    tables += [("channels", channels, None)]
    for key, table, allowed in tables:
        if not isinstance(table, Mapping) or (allowed is not None and set(table) - allowed):
            raise _refuse(f"the table [{key}] may hold {', '.join(sorted(allowed or ()))}; found {table!r}.", source)
    if set(mapping) - _TABLES or not channels:
        raise _refuse(f"the calibration must have [channels], and beside it only {', '.join(sorted(_TABLES))}.", source)
    if ("rate" in recorder) == ("time" in recorder):
        raise _refuse("the table [recorder] needs either rate or time.", source)
    for name, entry in channels.items():
        if not isinstance(entry, Mapping) or set(entry) - _CHANNEL or not {"column", "unit"} <= set(entry):
            raise _refuse(f"needs column, unit, and points or gain and zero; found {entry!r}.", source, name)
    return recorder, chosen, channels


def _volts(source: Source, options: Options, recorder: Mapping[str, Any], channels: Mapping[str, Any]) -> Flight:
    """The table as it stands, volts by channel name, over its own time or that of the recorder's rate."""
    table: dict[str, Any] = {key: recorder[key] for key in ("delimiter", "header") if key in recorder}
    # Named so that the schema has no opinion on their unit.
    named = {f"volts {name}": {"column": entry["column"], "unit": "V"} for name, entry in channels.items()}
    if "time" in recorder:
        return delimited.read(
            source, replace(options, mapping={**table, "channels": {"time": recorder["time"], **named}})
        )
    rate = _number(recorder["rate"], "rate", source)
    if not rate > 0.0:
        raise _refuse(f"rate = {rate:g} is not positive.", source)
    return delimited.read(source, replace(options, mapping={**table, "rate": rate, "channels": named}))


def read(source: Source, options: Options) -> Flight:
    """A recorder's table as a flight with one stream, "recorder", in engineering units, filtered; history says how.

    Args:
        source: the table of volts.
        options: `mapping`: the calibration; `bad_stamps`.

    Raises:
        FlightError, UnitError: naming the file, the channel, what was found and what to do.
    """
    recorder, chosen, channels = _checked(options, source)
    if options.units:
        raise _refuse("units belong into the calibration file.", source, hint="Leave --unit out.")
    raw = _volts(source, options, recorder, channels)
    if len(raw.streams) > 1:
        blank = [name.removeprefix("volts ") for name in raw.streams["log_2"].data_vars]
        raise _refuse(
            "has blank cells where other channels have volts; a recorder samples all of them at once.",
            source,
            ", ".join(blank),
            "Complete the cells, or leave these lines out.",
        )
    notes = [note for note in raw.provenance.notes if not note.startswith("volts ")]
    values: dict[str, tuple[Array, str]] = {}
    for name, entry in channels.items():
        low, high = _range(entry.get("range", recorder.get("range", [0.0, 5.0])), source, name)
        volts = raw.values(f"volts {name}")
        beyond = int(np.sum((volts < low - 1e-9) | (volts > high + 1e-9)))
        if beyond:
            raise _refuse(
                f"{beyond} of {volts.size} samples lie outside of {low:g} to {high:g} V.",
                source,
                name,
                "Correct the channel's range, or check that the table holds volts.",
            )
        margin = _AT_LIMIT * (high - low)
        limit = int(np.sum((volts <= low + margin) | (volts >= high - margin)))
        if limit:
            notes.append(f"{name}: {limit} of {volts.size} samples at the recorder's limit: what lies beyond is lost")
        unit = str(entry["unit"])
        calibrated = _calibrated(volts, *_points(entry, source, name))
        expected = channel(name).unit
        values[name] = (
            units.to_inside(calibrated, unit, expected=expected, channel=name, where=source.name),
            units.inside_unit(unit),
        )
    labels = {name: unit for name, (_, unit) in values.items() if not is_known(name)}
    time = raw.time(next(iter(raw.channels)))
    data = stream(time, {name: v for name, (v, _) in values.items()}, labels)
    notes += checks.constant_notes({name: v for name, (v, _) in values.items()})
    flight = Flight(
        {"recorder": data}, source.provenance(NAME, VERSION, notes=tuple(notes), damage=raw.provenance.damage)
    )
    flight = flight.done("calibrate", channels={name: dict(entry) for name, entry in channels.items()})
    return _filtered(flight, {**_FILTER, **chosen}, source)


def _filtered(flight: Flight, chosen: Mapping[str, Any], source: Source) -> Flight:
    cutoff, order = _number(chosen["cutoff"], "cutoff", source), chosen["order"]
    if not isinstance(chosen["zero_phase"], bool) or isinstance(order, bool) or not isinstance(order, int) or order < 1:
        raise _refuse("the table [filter] needs a whole order above zero, and zero_phase true or false.", source)
    if cutoff == 0.0:
        return flight
    steps = np.diff(flight.time(flight.channels[0]))
    if np.max(np.abs(steps - np.median(steps))) > _UNEVEN * np.median(steps):
        raise _refuse(
            "its time steps are not even, so that it cannot be filtered as it stands.",
            source,
            "time",
            "Set cutoff = 0 in [filter], and condition the flight with cutoff=6.",
        )
    return lowpass(flight, cutoff=cutoff, order=order, zero_phase=chosen["zero_phase"])
