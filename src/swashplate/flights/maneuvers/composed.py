"""A multisine whose lines have powers of their own, as a maneuver like any other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.maneuvers.multisine import least_peak
from swashplate.flights.maneuvers.series import Maneuver


@dataclass(frozen=True)
class ComposedMultisine(Maneuver):
    """Lines by axis: harmonic number of the record, amplitude in the command's unit, phase of the cosine [rad].

    It begins and ends at zero as every whole period does.
    """

    lines: Mapping[str, tuple[tuple[int, float, float], ...]] = field(default_factory=dict)

    def signals(self, time: Array) -> dict[str, Array]:
        """The excitation of each axis at times [s] counted from its start; zero before and after."""
        time = np.asarray(time, dtype=np.float64)
        inside = (time >= 0.0) & (time < self.duration)
        part = np.mod(time / self.duration, 1.0)
        signals = {}
        for axis in self.axes:
            total = np.zeros(time.shape)
            for number, amplitude, phase in self.lines[axis]:
                total += amplitude * np.cos(2.0 * np.pi * number * part + phase)
            signals[axis] = np.where(inside, total, 0.0)
        return signals

    def scaled(self, share: float) -> ComposedMultisine:
        """The same, smaller."""
        lines = {axis: tuple((n, share * a, p) for n, a, p in of_axis) for axis, of_axis in self.lines.items()}
        return ComposedMultisine(self.kind, self.axes, self.duration, share * self.amplitude, self.band, lines)


def composed(
    powers: Mapping[str, Mapping[int, float]], *, duration: float, peak: Mapping[str, float]
) -> ComposedMultisine:
    """The multisine of these mean squares with phases of least peak, each axis scaled to its largest deflection.

    Args:
        powers: mean square by harmonic number of the record, by axis; lines below a thousandth of the largest are left.
        duration: one period [s]. peak: largest deflection by axis.
    """
    lines, every = {}, []
    for axis, of_axis in powers.items():
        top = max(of_axis.values())
        kept = {n: float(np.sqrt(2.0 * power)) for n, power in sorted(of_axis.items()) if power > 1e-3 * top}
        phases, reached = least_peak(tuple(kept), tuple(kept.values()))
        share = peak[axis] / reached
        lines[axis] = tuple((n, a * share, p) for (n, a), p in zip(kept.items(), phases, strict=True))
        every += list(kept)
    band = (min(every) / duration, max(every) / duration)
    return ComposedMultisine("multisine", tuple(lines), duration, max(peak.values()), band, lines)
