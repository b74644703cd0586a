"""What can spoil a steady measurement, and whether it did: moving points, drift, vibration, ground, structure.

A sensor's bias and steady drift are unknowns of every fit. What they cannot take up shows in the residuals: air that
comes back bends them, a warm motor or a drifting sensor spreads repeats, vibration spreads samples. The one thing that
no residual shows is ground effect at a fixed height: it scales thrust alike at every speed. The height must be told.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy import stats

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck
from swashplate.bench.steady import SteadyLine, SteadyPoints
from swashplate.physics.ground_effect import thrust_gain

_SURE = 1e-4
"""Significance at which a check speaks up."""
_SHAKEN = 0.5
"""Scatter of samples over the span of the means beyond which vibration is as large as what is measured."""
_TURNING = 30.0
"""rad/s above which a rotor turns."""
_NOTICEABLE = 0.002
"""Share of thrust by ground effect from which a thrust factor is off by more than its usual bound."""


def check_settled(points: SteadyPoints, channel: str) -> BenchCheck:
    """Whether a channel still moved while the points were measured."""
    if channel not in points.moving:
        return BenchCheck(f"{points.where}: came averaged; whether {channel} was steady at its points cannot be told.")
    moving = int(np.sum(np.abs(points.moving[channel]) > stats.norm.isf(_SURE / 2.0 / max(len(points), 1))))
    if not moving:
        return BenchCheck(f"{points.where}: {channel} was steady at every point.")
    return BenchCheck(
        f"{points.where}: {channel} still moved during {moving} of {len(points)} points: the rotors had not settled, "
        "the supply sagged, or air came back from walls and floor. Wait longer before each point.",
        good=False,
    )


def check_structure(line: SteadyLine, level: Array, *, what: str) -> list[BenchCheck]:
    """Repeatability, and whether the residuals bend with the level: the lack-of-fit test (Draper and Smith 1998, 2.1).

    Args:
        line: the fit.
        level: what was set at each point, equal for repeats.
        what: the residuals' channel and unit.
    """
    groups = [line.residuals[np.abs(level - value) < 1e-9] for value in np.unique(np.round(level, 9))]
    repeated = [group for group in groups if group.size > 1]
    freedom = sum(group.size - 1 for group in repeated)
    if freedom < 3:
        return [BenchCheck(f"{what}: too few points were repeated to tell how well they repeat.", good=False)]
    pure = sum(float(np.sum((group - group.mean()) ** 2)) for group in repeated)
    spread = float(np.sqrt(pure / freedom))
    checks = [BenchCheck(f"{what}: repeats of a point agree to {spread:.2g} (standard deviation, {freedom} pairs).")]
    extra = line.freedom - freedom
    if extra > 0 and pure > 0.0:
        lack = max(float(line.residuals @ line.residuals) - pure, 0.0) / extra
        if stats.f.sf(lack / (pure / freedom), extra, freedom) < _SURE:
            checks.append(
                BenchCheck(
                    f"{what}: the residuals have a structure beyond the repeats ({np.sqrt(lack):.2g} against "
                    f"{spread:.2g}): ground effect, air that comes back, or an effect that the formula lacks. "
                    "The bounds allow for its size, not for its sign.",
                    good=False,
                )
            )
        else:
            checks.append(BenchCheck(f"{what}: the residuals show no structure beyond the repeats."))
    return checks


def check_drift(value: float, sigma: float, *, span: float, what: str) -> BenchCheck:
    """What the sensor drifted over a record; it is taken out of the fit.

    Args:
        value, sigma: per minute.
        span: length of the record [s].
        what: channel and unit.
    """
    sure = abs(value) > 3.0 * sigma
    drifting = f"drifted by {value:.2g} a minute" if sure else "did not drift noticeably"
    return BenchCheck(f"{what} {drifting} over {span:.0f} s" + ("; the fit takes a steady drift out." if sure else "."))


def check_line_drift(points: SteadyPoints, line: SteadyLine, place: int, *, what: str) -> BenchCheck:
    """As `check_drift`, where the drift is an unknown of a fit at `place`."""
    return check_drift(
        float(line.values[place]),
        float(np.sqrt(line.covariance[place, place])),
        span=float(np.ptp(points.time)),
        what=f"{points.where}: {what}",
    )


def check_vibration(points: SteadyPoints, channel: str) -> BenchCheck:
    """How much samples scatter within a point, and whether a rotor's vibration can look like a steady load.

    Sampled at a rate, a vibration at the rotor's frequency appears at its distance from the next multiple of the rate;
    nearer than one over the length of a point, the average no longer removes it.
    """
    if channel not in points.scatter:
        return BenchCheck(f"{points.where}: came averaged; vibration in {channel} cannot be told.")
    speeds = [name for name in points.mean if name.startswith("omega_")]
    turning = np.max([points[name] for name in speeds], axis=0) > _TURNING if speeds else np.ones(len(points), bool)
    scatter, span = points.scatter[channel], float(np.ptp(points[channel]))
    shaken = float(np.median(scatter[turning])) if turning.any() else float(np.median(scatter))
    text = f"{points.where}: {channel} scatters by {shaken:.2g} within a point"
    if turning.any() and not turning.all():
        text += f" ({np.median(scatter[~turning]):.2g} with the rotors off: the rest is vibration)"
    for name in speeds:
        per_second = points[name][turning] / (2.0 * np.pi)
        alias = np.abs(per_second - points.rate * np.round(per_second / points.rate))
        near = (alias * points.hold < 1.0) & (points[name][turning] > _TURNING)
        if near.any():
            return BenchCheck(
                f"{text}; at {points[name][turning][near][0]:.0f} rad/s {name} is so near a multiple of the sample "
                "rate that its vibration looks like a steady load. Sample at another rate.",
                good=False,
            )
    good = shaken <= _SHAKEN * span
    return BenchCheck(
        text + ("." if good else ": as much as what is measured. Balance the rotors, damp the mount."), good
    )


def check_ground(record: BenchRecord, card: Mapping[str, float]) -> BenchCheck:
    """What the ground adds to the thrust by the height in the record's header (Cheeseman and Bennett 1955)."""
    if "height" not in record.header:
        return BenchCheck(
            f"{record.name}: the header does not say how high the rotors are above the floor (# height: 1.5 m). Ground "
            "effect scales thrust alike at every speed, so no residual shows it."
        )
    height = record.number("height", np.inf)
    gain = thrust_gain(height, radius=card["rotor_radius"]) - 1.0
    good = gain < _NOTICEABLE
    return BenchCheck(
        f"{record.name}: {height:g} m above the floor, ground effect adds {100 * gain:.2g} % to the thrust"
        + ("." if good else ", which the factor then has too much. Raise the bench."),
        good,
    )
