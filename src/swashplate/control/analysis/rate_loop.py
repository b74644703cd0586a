"""A rate loop around an identified model: its controller and filters, and what a set of gains is worth in it.

ArduPilot's rate controller gives the mixer command u = FF target + P e + I int e + D de/dt, with the target and the
rate error e in rad/s behind first-order filters (FLTT and FLTE), and one more on the derivative (FLTD). Rotorflight's
has a filter of the gyro alone (FLTG), and its derivative is that of the gyro.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import expm

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.rate_gain_names import short
from swashplate.control.analysis.rate_loop_steps import DISTURBED, stepped
from swashplate.identification.frequency.handling import ReadNumber, ResponseMargins, margins
from swashplate.identification.frequency.handling_readings import model_margins
from swashplate.identification.frequency.reading_accuracy import Fitted
from swashplate.models.linear.answering import LinearResponse, pair_response
from swashplate.models.linear.state_space import StateSpaceModel

LOWEST = 2.0 * np.pi * 0.05
SEEN = np.geomspace(LOWEST, 2.0 * np.pi * 40.0, 1500)
"""rad/s: where loops are judged."""
_SLOWER = frozenset(("x", "y", "z", "u", "v", "w", "phi", "theta", "psi"))
"""States that a rate moves first of all: held, they leave what a rate settles at before they act."""
_SETTLING, _SETTLED = 2.0, 0.25
"""Seconds after which a rate must be within this share of its steady value to be fed forward."""
_LAST, _NOISY = 80, 2.0 * np.pi * 10.0
"""Samples at the end that say what is left of a disturbance; rad/s above which a gyro's signal is noise."""
HALF_POWER = 10.0 ** (-3.0 / 20.0)
NAN = float("nan")


@dataclass(frozen=True)
class LoopFigures:
    """What a set of gains is worth on the model, one axis at a time.

    Attributes:
        margins: of the broken loop, the least of each. peak: largest sensitivity |1 / (1 + L)|.
        bandwidth: where the rate follows its demand by -3 dB for the first time [rad/s]; 0 where it never does,
            infinite where it does to the end of what is judged.
        rejection: up to where a disturbance of the rate is halved in power: |1 / (1 + L)| = -3 dB [rad/s]; the
            disturbance rejection bandwidth of ADS-79 (definition from memory). 0 where none is.
        overshoot: of the rate beyond a demand that steps at once, 1 is all of it; NaN where the loop is unstable or the
            model cannot be stepped.
        shaken, left: rate after a step of a tenth of the command: the largest, and what the last 0.2 s of two seconds
            still hold [rad/s]; NaN where the model cannot be stepped or the loop is unstable.
        noise: largest gain from a noise of the gyro to the command above 10 Hz [command per rad/s].
        coupling: largest answer of another rate to this axis' demand, over the demand, with all axes' loops closed; NaN
            where the model has one axis.
    """

    margins: ResponseMargins
    peak: float
    bandwidth: float
    rejection: float
    overshoot: float
    shaken: float
    left: float
    noise: float
    coupling: float = NAN


NO_FIGURES = LoopFigures(ResponseMargins(*[ReadNumber(NAN)] * 5), *[NAN] * 7)


def controller_response(gains: Mapping[str, float], omega: Array, *, gyro_filter: float = 0.0) -> Complex:
    """From a rate to the command with its sign turned, shape (n,): gains and filters by their names, and the gyro's."""
    s: Complex = np.asarray(1j * omega, dtype=np.complex128)
    k = short(gains)
    pid = k.get("P", 0.0) + k.get("I", 0.0) / s + k.get("D", 0.0) * s * _first_order(s, k.get("FLTD", 0.0))
    c = 2.0 * np.pi * gyro_filter
    gyro = c**2 / (s**2 + np.sqrt(2.0) * c * s + c**2) if c > 0.0 else 1.0
    smooth = _first_order(s, k.get("FLTE", 0.0)) * _first_order(s, k.get("FLTG", 0.0))
    return np.asarray(pid * smooth * gyro, dtype=np.complex128)


@dataclass(frozen=True)
class RateLoop:
    """A rate loop without its gains: what the model answers, and what filters stand beside it [Hz].

    Attributes:
        model: what answers the command. axis, rate, command: names.
        filters: of the controller, by their short names: corners [Hz].
        gyro_filter: of the gyro where the model lacks it [Hz].
        structure: the model in time; None for transfer functions that cannot be stepped.
        fit: where the model comes from one, for the bounds of margins.
    """

    model: LinearResponse
    axis: str
    rate: str
    command: str
    filters: Mapping[str, float]
    gyro_filter: float
    structure: StateSpaceModel | None = None
    fit: Fitted | None = None

    def plant(self, omega: Array) -> Complex:
        return pair_response(self.model, self.rate, self.command, omega)

    def _responses(self, omega: Array, axes: tuple[RateLoop, ...]) -> Complex:
        """From the commands of some axes to their rates, shape (n, axes, axes)."""
        rows = [self.model.outputs.index(loop.rate) for loop in axes]
        columns = [self.model.inputs.index(loop.command) for loop in axes]
        return np.asarray(self.model.response(omega)[:, rows][:, :, columns])

    def controller(self, gains: Mapping[str, float], omega: Array) -> Complex:
        """From the rate to the command with its sign turned, gyro filter included where the model lacks it."""
        return controller_response(gains, omega, gyro_filter=self.gyro_filter)

    def ahead(self, gains: Mapping[str, float], omega: Array) -> Complex:
        """From the demanded rate to the command: its filter, feed-forward, the controller without the gyro's filter."""
        without, k = replace(self, gyro_filter=0.0), short(gains)
        if "FLTG" in k:
            k |= {"FLTG": 0.0, "D": 0.0}
        smooth = _first_order(np.asarray(1j * omega, dtype=np.complex128), k.get("FLTT", 0.0))
        return np.asarray(smooth * (k.get("FF", 0.0) + without.controller(k, omega)))

    def figures(self, gains: Mapping[str, float], omega: Array) -> LoopFigures:
        """Margins, with bounds where a fit has them, and what the loop does."""
        controller, plant = self.controller(gains, omega), self.plant(omega)
        loop = np.asarray(controller * plant, dtype=np.complex128)
        sensitivity = np.abs(1.0 / (1.0 + loop))
        if self.fit is None:
            read = margins(omega, loop)
        else:
            read = model_margins(self.fit, self.rate, self.command, omega, controller)
        follows = np.abs(plant * self.ahead(gains, omega) / (1.0 + loop))
        one = {name: np.array([value]) for name, value in short(gains).items()}
        shaken = np.abs(self._answers(one, target=0.0, disturbance=DISTURBED)[:, 0])
        return LoopFigures(
            read,
            float(np.max(sensitivity)),
            _first_below(omega, follows, HALF_POWER),
            _first_above(omega, sensitivity, HALF_POWER),
            float(self.overshoots(one)[0]),
            float(np.max(shaken)),
            float(np.max(shaken[-_LAST:])),
            float(np.max(np.abs(controller[omega >= _NOISY]))),
        )

    def overshoots(self, gains: Mapping[str, Array]) -> Array:
        """Of the rate beyond a step of the demand, for each of m sets of gains, shape (m,)."""
        return np.asarray(np.maximum(0.0, self._answers(gains).max(axis=0) - 1.0))

    def _answers(self, gains: Mapping[str, Array], *, target: float = 1.0, disturbance: float = 0.0) -> Array:
        """The rate after a step of the demand and of the command, shape (n, m); NaN where nothing can be stepped."""
        if self.structure is None:
            return np.full((1, max(np.size(v) for v in gains.values())), np.nan)
        return stepped(
            self.structure, gains, self.rate, self.command,
            seconds=_SETTLING, gyro_filter=self.gyro_filter, target=target, disturbance=disturbance,
        )  # fmt: skip

    @cached_property
    def steady(self) -> float:
        """The rate per command that a held command settles at before attitude and speed act; NaN where there is none.

        Of a transfer function its value at zero frequency; of a structure the value with the states of attitude,
        heading, speed and place held. NaN where the rate is not within a quarter of it after two seconds.
        """
        if self.structure is None:
            return NAN
        a, b, c, d = self.structure.explicit()
        kept = [k for k, name in enumerate(self.structure.states) if name not in _SLOWER]
        i, o = self.structure.inputs.index(self.command), self.structure.outputs.index(self.rate)
        fast, through, fast_row = a[np.ix_(kept, kept)], float(d[o, i]), c[o, kept]
        if kept and np.max(np.linalg.eigvals(fast).real) >= 0.0:
            return NAN
        reached = np.linalg.solve(fast, b[kept, i]) if kept else np.zeros(0)
        settled = through - float(fast_row @ reached)
        missing = float(fast_row @ expm(fast * _SETTLING) @ reached) if kept else 0.0
        return settled if settled and abs(missing) <= _SETTLED * abs(settled) else NAN

    @property
    def unstable(self) -> float:
        """Size of the fastest growing mode [rad/s], zero for none."""
        modes = self.model.eigenvalues()
        return float(np.max(np.abs(modes[modes.real > 1e-6]), initial=0.0))


def couplings(loops: tuple[RateLoop, ...], gains: tuple[Mapping[str, float], ...], omega: Array) -> tuple[float, ...]:
    """Per axis, the largest answer of another axis' rate to its demand with all loops closed (NaN: one axis alone)."""
    if len(loops) < 2:
        return (NAN,) * len(loops)
    H = loops[0]._responses(omega, loops)
    back, ahead = (
        np.stack([getattr(loop, part)(k, omega) for loop, k in zip(loops, gains, strict=True)], axis=1)
        for part in ("controller", "ahead")
    )
    closed = np.linalg.solve(np.eye(len(loops)) + H * back[:, None, :], H * ahead[:, None, :])
    size = np.abs(closed)
    return tuple(float(np.max(np.delete(size[:, :, k], k, axis=1))) for k in range(len(loops)))


def _first_order(s: Complex, hertz: float) -> Complex | float:
    return 1.0 / (1.0 + s / (2.0 * np.pi * hertz)) if hertz > 0.0 else 1.0


def _first_below(omega: Array, size: Array, level: float) -> float:
    """Where a gain first falls through a level; 0 where it starts below, infinite where it never does."""
    below = np.flatnonzero(size < level)
    return float(omega[below[0]]) * bool(below[0] > 0) if below.size else np.inf


def _first_above(omega: Array, size: Array, level: float) -> float:
    """Where a gain first rises through a level; 0 where it starts above, infinite where it never does."""
    above = np.flatnonzero(size > level)
    return float(omega[above[0]]) * bool(above[0] > 0) if above.size else np.inf
