"""Drag of the fuselage in a fan's stream, rotors off.

    Fx = -a_Fx,u u |u|,  Fy = -a_Fy,v v |v|                 (Fankhauser et al., sec. IV-A6, eq. 7)

u and v are the air's speeds from the front and from the right (anemometer where the stream reaches the vehicle). What
spoils it: turbulence (use a straightener), a stream narrower than the vehicle, drag of the mount (measure it alone and
subtract), and rotors that turn: their discs lean in the wind and push several times harder than the fuselage.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.checks import check_line_drift, check_settled, check_structure, check_vibration
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchResult, Curve, Procedure
from swashplate.bench.steady import fit_line, nuisance, steady_points
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError

_AXES = (("airspeed_x", "Fx", "drag_x"), ("airspeed_y", "Fy", "drag_y"))
_STANDING = 30.0  # rad/s


def schedule_drag(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """The fan from the front and from the right at 0 to 4 m/s."""
    records = []
    for axis, side in (("airspeed_x", "front"), ("airspeed_y", "right")):
        speeds = (0.0, 1.0, 2.0, 3.0, 4.0)
        settings = [{axis: v} for v in (*speeds, *speeds[::-1]) * 2]
        text = f"rotors off; fan from the {side} at 0, 1, 2, 3, 4 m/s, up and down, twice"
        records.append(points(f"fan_{side}", (FUSELAGE_DRAG.name,), settings, settle=1.0, hold=4.0, about=text))
    return records


def _refuse_across(record: BenchRecord, speed: str, force: str, drag: float, pushed: Array) -> None:
    """Raise where the force across the stream grows with it more than the force along it does."""
    other = {"Fx": "Fy", "Fy": "Fx"}[force]
    if other not in record.channels:
        return
    points = steady_points(record, (other,))
    across = fit_line([-pushed, *nuisance(points)], points[other], where=record.name)
    if abs(across.values[0]) > max(abs(drag), 5.0 * float(np.sqrt(across.covariance[0, 0]))):
        raise BenchError(
            f"grows with {speed} less than {other} does: the stream pushes along itself.",
            where=record.name,
            channel=force,
            hint="Are Fx and Fy exchanged, or is the helicopter turned in the stream?",
        )


def estimate_drag(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`drag_x` and `drag_y` at the card's air density.

    Raises:
        BenchError: where a rotor turns, no stream is varied, or the force points against the stream.
    """
    names, values, variances, checks, curves = [], [], [], [], []
    for record in records:
        blown = [axis for axis in _AXES if axis[0] in record.channels and np.ptp(record[axis[0]]) > 0.5]
        if len(blown) != 1:
            raise BenchError(
                "varies no single stream.", where=record.name, hint="Vary airspeed_x or airspeed_y, one a record."
            )
        speed, force, name = blown[0]
        steady = steady_points(record, (*FUSELAGE_DRAG.columns[1:], speed, force))
        if max(steady["omega_lower"].max(), steady["omega_upper"].max()) > _STANDING:
            raise BenchError("a rotor turns.", where=record.name, channel="omega", hint="Take it with rotors off.")
        density = record.number("air_density", card["air_density"]) / card["air_density"]
        pushed = density * steady[speed] * np.abs(steady[speed])
        line = fit_line([-pushed, *nuisance(steady)], steady[force], where=record.name)
        if line.values[0] < -3.0 * np.sqrt(line.covariance[0, 0]):
            raise BenchError(
                f"grows with {speed}: air from the front pushes back (Fx < 0), from the right to the left (Fy < 0).",
                where=record.name,
                channel=force,
                hint="Turn the sign of the force or of the air speed.",
            )
        _refuse_across(record, speed, force, float(line.values[0]), pushed)
        names.append(name)
        values.append(float(line.values[0]))
        variances.append(float(line.covariance[0, 0]))
        level = np.round(steady[speed] * 2.0) / 2.0
        checks += [
            check_settled(steady, force),
            check_vibration(steady, force),
            check_line_drift(steady, line, 2, what=f"{force} [N]"),
            *check_structure(line, level, what=f"{record.name}: {force} [N]"),
        ]
        blowing = np.linspace(steady[speed].min(), steady[speed].max(), 60)
        fitted = line.values[0] * pushed
        curves.append(
            Curve(f"Drag against {speed}", "speed of the air [m/s]", "drag [mN]", steady[speed],
                  1e3 * (fitted - line.residuals), blowing, 1e3 * density * line.values[0] * blowing * np.abs(blowing))
        )  # fmt: skip
    checks.append(BenchCheck("The mount's own drag is in these numbers unless it was measured alone and subtracted."))
    files = {name: (record.name,) for name, record in zip(names, records, strict=True)}
    return BenchResult.of(
        FUSELAGE_DRAG, records, checks, curves, names=names, values=values, covariance=variances, records_of=files
    )


FUSELAGE_DRAG = Procedure(
    "fuselage_drag",
    "Fuselage drag in a fan's stream",
    "Fankhauser et al., sec. IV-A6 and eq. 7",
    ("point", "omega_lower", "omega_upper"),
    estimate_drag,
    schedule_drag,
)
