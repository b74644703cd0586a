"""Margins of a loop from its frequency response: one input at a time, and all of them at once by disc margins.

The multi-loop margin is the diagonally scaled upper bound of the structured singular value (Doyle 1982; Safonov 1982):
it never promises more than there is. Disc margins as in Seiler, Packard and Gahinet, "An Introduction to Disk Margins",
IEEE Control Systems Magazine (2020), balanced form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.arrays import Array, Complex
from swashplate.errors import ControllerError
from swashplate.identification.frequency.handling import crossing_delays, delay_words
from swashplate.text_table import text_table

_REFINED = 8
"""Frequencies about the peak at which the scaling is optimised; Perron's scaling, near the best, does elsewhere."""


@dataclass(frozen=True)
class DiscMargin:
    """What a loop stands: every factor on it within a disc that contains one.

    Attributes:
        alpha: size of the disc, 0 (none) to 2.
        frequency: where it is smallest [rad/s].
        gain: the factor by which the gain may rise or fall, the phase unchanged.
        phase: by how much the phase may turn, the gain unchanged [rad].
    """

    alpha: float
    frequency: float

    @property
    def gain(self) -> float:
        return (2.0 + self.alpha) / (2.0 - self.alpha) if self.alpha < 2.0 else float("inf")

    @property
    def phase(self) -> float:
        return 2.0 * float(np.arctan(self.alpha / 2.0))


@dataclass(frozen=True)
class AxisMargins:
    """One loop opened, the others closed.

    Attributes:
        name: of the input.
        gain: the smallest factor that destabilises upwards (infinite where none does).
        gain_down: the largest factor below one that does (0 where none does).
        phase: the smallest lag that does [rad].
        crossover: highest frequency at which the loop's gain is one [rad/s]; NaN where it never is.
        disc: both at once.
        sensitivity: largest |1 / (1 + L)|.
        delay: the smallest further delay at this input that destabilises [s]; infinite where none does.
    """

    name: str
    gain: float
    gain_down: float
    phase: float
    crossover: float
    disc: DiscMargin
    sensitivity: float
    delay: float


@dataclass(frozen=True)
class Margins:
    """Margins at the inputs: each axis alone, and all at once.

    Attributes:
        axes: one loop opened, the others closed.
        together: disc of all loops.
        delay: the smallest further delay of all inputs together that destabilises [s]; infinite where none does.
    """

    axes: tuple[AxisMargins, ...]
    together: DiscMargin
    delay: float

    @property
    def least_delay(self) -> float:
        """The smallest of all delay margins, of single loops and of all together [s]."""
        return min(self.delay, *(axis.delay for axis in self.axes))

    def __repr__(self) -> str:
        head = ("loop", "gain [dB]", "phase [deg]", "crossover [rad/s]", "delay", "disc", "max |S|")
        rows = []
        for a in self.axes:
            with np.errstate(divide="ignore"):
                down, up = 20.0 * np.log10([a.gain_down, a.gain])
            numbers = (delay_words(a.delay), f"{a.disc.alpha:.2f}", f"{a.sensitivity:.2f}")
            rows.append(
                (a.name, f"{down:.1f} to {up:+.1f}", f"{np.degrees(a.phase):.0f}", f"{a.crossover:.2f}", *numbers)
            )
        t = self.together
        lines = [text_table(head, rows)]
        lines.append(
            f"all at once: gain +- {20.0 * np.log10(t.gain):.1f} dB, phase +- {np.degrees(t.phase):.0f} deg "
            f"(disc {t.alpha:.2f} at {t.frequency:.2f} rad/s), delay {delay_words(self.delay)}"
        )
        return "\n".join(lines)


def margins(frequencies: ArrayLike, loop: ArrayLike, names: tuple[str, ...]) -> Margins:
    """Margins from the loop's frequency response, for negative feedback and a stable closed loop.

    Args:
        frequencies: [rad/s], shape (n,), rising.
        loop: L, shape (n, m, m), opened at the m inputs.
        names: of the inputs.

    Raises:
        ControllerError: where the shapes do not belong together or a number is not finite.
    """
    w, L = np.asarray(frequencies, dtype=np.float64), np.asarray(loop, dtype=np.complex128)
    m = len(names)
    if L.shape != (w.size, m, m) or not np.all(np.isfinite(L)):
        raise ControllerError(f"the loop has shape {L.shape}, expected finite numbers ({w.size}, {m}, {m}).")
    S = np.linalg.inv(np.eye(m) + L)
    half = np.asarray(S - 0.5 * np.eye(m), dtype=np.complex128)  # (S - T) / 2
    axes = tuple(_axis(name, w, 1.0 / S[:, i, i] - 1.0, half[:, i, i]) for i, name in enumerate(names))
    bounds = _scaled(half, _perron(half))
    peak = int(np.argmax(bounds))
    around = slice(max(peak - _REFINED // 2, 0), peak + _REFINED // 2 + 1)
    for i in range(*around.indices(w.size)):
        bounds[i] = _best_scaled(half[i])
    # A neighbour that was not refined may now stand above the refined peak.
    for i in np.flatnonzero(bounds > bounds[around].max()).tolist():
        bounds[i] = _best_scaled(half[i])
    worst = int(np.argmax(bounds))
    together = DiscMargin(min(1.0 / float(bounds[worst]), 2.0), float(w[worst]))
    return Margins(axes, together, float(np.min(crossing_delays(w, L), initial=np.inf)))


def promised_disc(sensitivities: NDArray[np.complex128]) -> float:
    """What all loops at once stand at least: the disc by Perron's scaling, without refining it.

    Args:
        sensitivities: 1 / (1 + L) over frequency, shape (n, m, m).
    """
    half = np.asarray(sensitivities - 0.5 * np.eye(sensitivities.shape[-1]), dtype=np.complex128)
    return min(1.0 / float(np.max(_scaled(half, _perron(half)))), 2.0)


def _axis(name: str, w: Array, loop: Any, half: Any) -> AxisMargins:
    worst = int(np.argmax(np.abs(half)))
    gains, phases, crossings = _crossings(w, loop)
    up, down = gains[gains > 1.0], gains[(gains < 1.0) & (gains > 0.0)]
    turned = np.abs((phases + 180.0) % 360.0 - 180.0)
    return AxisMargins(
        name,
        gain=float(up.min()) if up.size else float("inf"),
        gain_down=float(down.max()) if down.size else 0.0,
        phase=float(np.radians(turned.min())) if turned.size else float("inf"),
        crossover=float(crossings.max()) if crossings.size else float("nan"),
        disc=DiscMargin(min(1.0 / float(np.abs(half[worst])), 2.0), float(w[worst])),
        sensitivity=float(np.max(np.abs(1.0 / (1.0 + loop)))),
        delay=float(np.min(crossing_delays(w, loop[:, None, None]), initial=np.inf)),
    )


def _crossings(w: Array, loop: NDArray[np.complex128]) -> tuple[Array, Array, Array]:
    """Gain margins where the phase is -180 degrees; phase margins [deg] and frequencies where the gain is one.

    Read from the cubic spline through the points, as python-control's `stability_margins` reads frequency responses.
    """
    from scipy.interpolate import CubicSpline
    from scipy.optimize import brentq

    between = CubicSpline(w, loop)

    def roots(of: Callable[[Complex], Array], at: NDArray[np.int_]) -> Array:
        return np.array([brentq(lambda v: float(of(between(v))), w[i], w[i + 1]) for i in at])

    def turned(value: Complex) -> Array:
        return np.asarray(np.angle(-value))

    def grown(value: Complex) -> Array:
        return np.asarray(np.abs(value) - 1.0)

    opposed = np.flatnonzero(np.diff(np.sign(turned(loop))))
    opposed = opposed[loop[opposed].real <= 0.0]
    at_one = roots(grown, np.flatnonzero(np.diff(np.sign(grown(loop)))))
    with np.errstate(divide="ignore"):
        gains = 1.0 / np.abs(between(roots(turned, opposed)))
    return gains, np.remainder(np.degrees(np.angle(between(at_one))), 360.0) - 180.0, at_one


def _perron(M: NDArray[np.complex128]) -> Array:
    """log of the scaling that is best for |M|: the square root of its Perron vectors' ratio (Safonov 1982).

    Of one matrix (m, m), or of each of many (..., m, m).
    """
    size = np.abs(M)
    size = size + 1e-12 * size.max(axis=(-2, -1), keepdims=True)
    vectors = []
    for matrix in (size, np.swapaxes(size, -1, -2)):
        values, directions = np.linalg.eig(matrix)
        largest = np.argmax(values.real, axis=-1)[..., None, None]
        vectors.append(np.abs(np.take_along_axis(directions, largest, axis=-1)[..., 0]))
    right, left = vectors
    return np.asarray(0.5 * np.log(left / right), dtype=np.float64)


def _scaled(M: NDArray[np.complex128], logs: Array) -> Any:
    """Largest singular value of D M D^-1, of one matrix or of each of many."""
    d = np.exp(logs - logs[..., -1:])
    return np.linalg.svd(d[..., :, None] * M / d[..., None, :], compute_uv=False)[..., 0]


def _best_scaled(M: NDArray[np.complex128]) -> float:
    """The smallest over D found; a convex problem in log D."""
    from scipy.optimize import minimize  # a tenth of a second, and every report imports this module

    start = _perron(M)
    best = minimize(lambda logs: _scaled(M, logs), start, method="Nelder-Mead", options={"xatol": 1e-4})
    return min(float(_scaled(M, start)), float(best.fun))
