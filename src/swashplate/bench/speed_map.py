"""Speed maps: rotor speed against motor command, steady, from sweeps of one motor while the other holds hover.

    Omega = k_d u + o_d + k_d,U (U - U_norm)        (Fankhauser et al., sec. IV-A1, eq. 22)

Dead zone and saturation are left out by themselves. What spoils it: a supply that sags with the load (use a stiff one;
the measured voltage corrects the rest), a motor that warms, and a tachometer that counts the other rotor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.bench.checks import check_settled, check_structure
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchResult, Curve, Procedure
from swashplate.bench.steady import fit_line, steady_points
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError

Mask = NDArray[np.bool_]

NOT_RECORDED = "not recorded"
"""What a header's line `voltage` says instead of the column `voltage`."""

LEVELS = (0.0, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85)
BEND = 0.25
"""Share by which the slope between neighbours may differ from the slope of the middle before a point is left out."""


def schedule_maps(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Sweeps of each motor up and down while the other holds hover; thrust and torque come from the same records."""
    records = []
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        held = {f"motor_{other}": hover[f"motor_{other}"]}
        sweep = [{**held, f"motor_{rotor}": u} for u in (*LEVELS[1:], *LEVELS[:0:-1])]
        about = f"{rotor} motor 0.30 to 0.85 in steps of 0.05, up and down; {other} at hover; both off first and last"
        records.append(
            points(
                f"sweep_{rotor}",
                (SPEED_MAP.name, "thrust"),
                [{f"motor_{rotor}": 0.0}, *sweep, {}],
                settle=1.5,
                about=about,
            )
        )
    return records


def linear_part(command: Array, speed: Array, *, where: str = "", rotor: str = "") -> tuple[Mask, list[str]]:
    """Which levels belong to the straight part of a speed map, and why the others do not.

    From the middle half of the levels outward, a level is kept while the slope to its neighbour differs from the
    slope of the middle by less than a quarter. Below, a motor that hardly turns climbs steeply out of its dead zone;
    above, one that saturates no longer follows.

    Args:
        command, speed: levels in rising order and the mean speed [rad/s] at each, shape (n,).

    Returns:
        kept: shape (n,), bool.
        reasons: one line for each level that is left out.

    Raises:
        BenchError: where the levels are too few or the speed does not rise with the command.
    """
    n = command.size
    if n < 5:
        raise BenchError(
            f"has {n} levels of motor_{rotor}, expected at least 5.", where=where, hint="Sweep more levels."
        )
    quarter = n // 4
    middle = slice(quarter, n - quarter)
    slope = float(np.polyfit(command[middle], speed[middle], 1)[0])
    if slope <= 0.0:
        raise BenchError(
            f"omega_{rotor} does not rise with motor_{rotor} (slope {slope:.3g} rad/s).",
            where=where,
            hint="Are motors or tachometers exchanged, or is a motor not running?",
        )
    local = np.diff(speed) / np.diff(command) / slope
    kept, reasons = np.zeros(n, dtype=bool), []
    kept[middle] = True
    low = quarter
    while low > 0 and abs(local[low - 1] - 1.0) <= BEND:
        low -= 1
    high = n - quarter - 1
    while high < n - 1 and abs(local[high] - 1.0) <= BEND:
        high += 1
    kept[low : high + 1] = True
    for i in range(low):
        reasons.append(
            f"{rotor} at {command[i]:g}: dead zone (the slope up to {command[low]:g} is {local[low - 1]:.2f} "
            "times that of the middle)"
        )
    for i in range(high + 1, n):
        reasons.append(
            f"{rotor} at {command[i]:g}: saturation (the slope from {command[high]:g} is {local[high]:.2f} "
            "times that of the middle)"
        )
    return kept, reasons


def fit_map(command: Array, speed: Array, *, where: str = "", rotor: str = "") -> tuple[Array, Array, Mask, list[str]]:
    """Slope and offset of a speed map [rad/s] from points in any order, repeats welcome.

    Returns:
        values (2,), covariance (2, 2), kept (n,), reasons for what was left out.
    """
    levels = np.unique(np.round(command, 6))
    means = np.array([speed[np.abs(command - level) < 1e-5].mean() for level in levels])
    straight, reasons = linear_part(levels, means, where=where, rotor=rotor)
    kept = np.isin(np.round(command, 6), levels[straight])
    line = fit_line([command[kept], np.ones(int(kept.sum()))], speed[kept], where=where)
    return line.values, line.covariance, kept, reasons


def estimate_maps(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`k_drive` and `o_drive` of the rotors that the records sweep.

    Args:
        records: each varies one motor.
        card: `k_drive_voltage` and `voltage_nominal` are held, for the small rest of the voltage.
    """
    names: list[str] = []
    values: list[float] = []
    leans: list[float] = []
    files: dict[str, tuple[str, ...]] = {}
    blocks, checks, curves, left_out = [], [], [], []
    for rotor in ("upper", "lower"):
        swept = [r for r in records if np.ptp(r[f"motor_{rotor}"]) > 0.1 and _is_sweep(r, rotor)]
        if not swept:
            continue
        u, speed, above, where = [], [], [], ", ".join(r.name for r in swept)
        for record in swept:
            known = record.header.get("voltage") != NOT_RECORDED
            steady = steady_points(record, (*SPEED_MAP.columns[1:], *(["voltage"] if known else [])))
            steady = steady.where_true(steady[f"motor_{rotor}"] > 0.0)
            above.append(steady["voltage"] - card["voltage_nominal"] if known else np.zeros(len(steady)))
            u.append(steady[f"motor_{rotor}"])
            speed.append(steady[f"omega_{rotor}"] - card["k_drive_voltage"] * above[-1])
            checks.append(check_settled(steady, f"omega_{rotor}"))
            checks += [
                _check_supply(record, known=known),
                _check_other(record, rotor, float(np.ptp(steady[f"omega_{_OTHER[rotor]}"]))),
            ]
        command, turned = np.concatenate(u), np.concatenate(speed)
        found_values, covariance, kept, reasons = fit_map(command, turned, where=where, rotor=rotor)
        columns = [command[kept], np.ones(int(kept.sum()))]
        line = fit_line(columns, turned[kept], where=where)
        leans += list(-fit_line(columns, np.concatenate(above)[kept], where=where).values)
        checks += check_structure(line, command[kept], what=f"{rotor} rotor speed [rad/s]")
        names += [f"k_drive_{rotor}", f"o_drive_{rotor}"]
        files |= dict.fromkeys(names[-2:], tuple(record.name for record in swept))
        values += list(found_values)
        blocks.append(covariance)
        left_out += reasons
        ends = np.array([command[kept].min(), command[kept].max()])
        fitted = found_values[0] * ends + found_values[1]
        points_in, points_out = ((command[part], turned[part]) for part in (kept, ~kept))
        axes = ("motor command", "rotor speed [rad/s]")
        curves.append(Curve(f"Speed map of the {rotor} rotor", *axes, *points_in, ends, fitted, *points_out))
    if not names:
        raise BenchError(
            "sweeps no motor.", where=", ".join(r.name for r in records), hint="Vary one motor, hold the other."
        )
    covariance = np.zeros((len(names), len(names)))
    for place, block in enumerate(blocks):
        covariance[2 * place : 2 * place + 2, 2 * place : 2 * place + 2] = block
    return BenchResult.of(
        SPEED_MAP,
        records,
        checks,
        curves,
        names=names,
        values=values,
        covariance=covariance,
        left_out=tuple(left_out),
        leans_on={"k_drive_voltage": np.array(leans)},
        records_of=files,
    )


_OTHER = {"upper": "lower", "lower": "upper"}


def _check_supply(record: BenchRecord, *, known: bool) -> BenchCheck:
    """Whether the map can be brought to the nominal voltage."""
    if known:
        return BenchCheck(f"{record.name}: the measured voltage brings its points to the nominal one.")
    return BenchCheck(
        f"{record.name}: the voltage was not recorded; the map is that of the day's supply, and its offset is off by "
        "k_drive_voltage for every volt that it was above or below the nominal one.",
        good=False,
    )


def _check_other(record: BenchRecord, rotor: str, speed_range: float) -> BenchCheck:
    """Whether the other rotor held its speed."""
    if _is_sweep(record, _OTHER[rotor]):
        return BenchCheck(f"{record.name}: both motors were swept together; a supply that sags bends the map.")
    return BenchCheck(f"{record.name}: the {_OTHER[rotor]} rotor held its speed within {speed_range:.1f} rad/s.")


def _is_sweep(record: BenchRecord, rotor: str) -> bool:
    """Whether this rotor's motor is the one that takes the more levels."""
    counts = {name: np.unique(np.round(record[f"motor_{name}"], 6)).size for name in ("lower", "upper")}
    return counts[rotor] == max(counts.values())


SPEED_MAP = Procedure(
    "speed_map",
    "Speed maps of the drive trains",
    "Fankhauser et al., sec. IV-A1 and eq. 22",
    ("point", "motor_lower", "motor_upper", "omega_lower", "omega_upper"),
    estimate_maps,
    schedule_maps,
)
