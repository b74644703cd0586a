"""What a set of rate-loop gains betters and worsens against the flown one, line by line."""

from __future__ import annotations

import numpy as np

from swashplate.control.analysis.rate_loop import LoopFigures

_CHANGES = (
    # what, unit, scale, better if larger, smallest change that is named (of a number, or of its flown size)
    ("phase margin", "deg", 1.0, True, 3.0, False),
    ("gain margin", "dB", 1.0, True, 0.5, False),
    ("delay margin", "ms", 1e3, True, 0.05, True),
    ("largest sensitivity", "", 1.0, False, 0.05, True),
    ("bandwidth", "rad/s", 1.0, True, 0.05, True),
    ("disturbance rejection", "rad/s", 1.0, True, 0.05, True),
    ("overshoot of a step", "%", 100.0, False, 5.0, False),
    ("largest answer to a disturbance", "deg/s", 180.0 / np.pi, False, 0.1, True),
    ("left of a disturbance after 2 s", "deg/s", 180.0 / np.pi, False, 0.2, True),
    ("noise of the gyro in the command", "s/rad", 1.0, False, 0.2, True),
    ("coupling", "", 1.0, False, 0.1, True),
)


def gain_changes(current: LoopFigures, suggested: LoopFigures) -> list[tuple[str, bool]]:
    """What differs between two sets of gains by more than it matters, line by line: in words, and whether it is better.

    Nothing where one of them was not judged.
    """
    if not (np.isfinite(current.peak) and np.isfinite(suggested.peak)):
        return []
    changes = []
    columns = [
        (*(_or_any(r.value) for r in (f.margins.phase_margin, f.margins.gain_margin, f.margins.delay_margin)), f.peak,
         f.bandwidth, f.rejection, f.overshoot, f.shaken, f.left, f.noise, f.coupling)
        for f in (current, suggested)
    ]  # fmt: skip
    for (what, unit, scale, larger, least, relative), before, after in zip(_CHANGES, *columns, strict=True):
        if unit == "ms" and max(before, after) >= 1.0:
            scale, unit = 1.0, "s"
        if before == after:
            continue  # without a crossing either
        change = scale * (after - before)
        if not abs(change) >= (least * abs(scale * before) if relative and np.isfinite(before) else least):
            continue  # NaN is no change either
        text = f"{what} {_three_digits(scale * before)} -> {_three_digits(scale * after)} {unit}".rstrip()
        changes.append((text, (change > 0.0) == larger))
    return changes


def _or_any(margin: float) -> float:
    """A margin; infinite where the loop never crosses."""
    return np.inf if np.isnan(margin) else margin


def _three_digits(value: float) -> str:
    """Three digits, without a power of ten where it is long."""
    if not np.isfinite(value):
        return "any"
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"
