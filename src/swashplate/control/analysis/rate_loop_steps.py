"""A rate loop closed over an identified model, in time: the answer to a step of the target, and to a disturbance.

ArduPilot's controller of `ardupilot_gains`: u = FF target + P e + I int e + D de/dt, with the error's filter FLTE and
the derivative's FLTD, both of first order. The loop is stepped at 400 Hz, as the autopilot runs, with the model exact
between steps (zero-order hold) and its delay in whole steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from swashplate.arrays import Array
from swashplate.errors import ControllerError
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

RATE = 400.0
"""Hz: ArduPilot's loop."""
_WILD = 50.0
"""A rate beyond so many times the target, or an answer that still grows: the loop is unstable."""


@dataclass(frozen=True)
class RateSteps:
    """How a rate loop answers.

    Attributes:
        time: from the step on [s], shape (n,).
        step: rate over a target of 1, shape (n,).
        disturbance: rate after a step of 0.1 of the command, in the model's unit, shape (n,).
        stable: whether both settle; where they do not, no gains should be flown.
        overshoot: of the step beyond 1; settled: its last value.
    """

    time: Array
    step: Array
    disturbance: Array
    stable: bool
    overshoot: float
    settled: float


def rate_loop_steps(
    model: Vehicle | StateSpaceModel,
    gains: Mapping[str, float],
    *,
    rate: str,
    command: str,
    seconds: float = 2.0,
    gyro_filter: float = 0.0,
) -> RateSteps:
    """Close the loop with gains and let it answer.

    Args:
        model: identified, from the mixer command to the rate.
        gains: by ArduPilot's names (`ATC_RAT_RLL_P`, ...) or their ends (`P`, `I`, `D`, `FF`, `FLTE`, `FLTD`).
        rate, command: the model's output and input.
        seconds: how long.
        gyro_filter: corner of a gyro filter that the model has not seen [Hz]; 0 for none.

    Raises:
        ControllerError: no gain among the names, or a model without these channels.
    """
    structure = structure_of(model) if isinstance(model, Vehicle) else model
    k = {name.rsplit("_", 1)[-1]: float(value) for name, value in gains.items()}
    if not {"P", "I", "D", "FF"} & set(k):
        raise ControllerError(f"hold no gain of a rate loop: {', '.join(gains) or 'none'}.", channel="gains")
    for name, names in ((rate, structure.outputs), (command, structure.inputs)):
        if name not in names:
            raise ControllerError(f"is no channel of the model; it has {', '.join(names)}.", channel=name)
    step, kept = _closed(structure, k, rate, command, seconds, gyro_filter, target=1.0, disturbance=0.0)
    shaken, held = _closed(structure, k, rate, command, seconds, gyro_filter, target=0.0, disturbance=0.1)
    time = np.arange(step.size) / RATE
    stable = kept and held and not _grows(step - step[-1]) and not _grows(shaken - shaken[-1])
    return RateSteps(time, step, shaken, stable, float(max(0.0, np.max(step) - 1.0)), float(step[-1]))


def _closed(
    model: StateSpaceModel,
    k: Mapping[str, float],
    rate: str,
    command: str,
    seconds: float,
    gyro: float,
    *,
    target: float,
    disturbance: float,
) -> tuple[Array, bool]:
    """The rate, and whether it stayed within bounds."""
    a, b, c, d = model.explicit()
    i, o, n = model.inputs.index(command), model.outputs.index(rate), a.shape[0]
    dt = 1.0 / RATE
    held = expm(np.block([[a, b[:, [i]]], [np.zeros((1, n + 1))]]) * dt)
    ad, bd, cd, dd = held[:n, :n], held[:n, n], c[o], float(d[o, i])
    waiting = [0.0] * max(1, round(model.delay(rate, command) * RATE))  # one step at least: commands act after it
    filtered, sloped, before, summed, x = 0.0, 0.0, 0.0, 0.0, np.zeros(n)
    error_share, slope_share = (1.0 - np.exp(-2.0 * np.pi * k.get(f, 0.0) * dt) or 1.0 for f in ("FLTE", "FLTD"))
    seen = _Gyro(gyro, dt)
    found = np.zeros(round(seconds * RATE) + 1)
    for step in range(found.size):
        acting = waiting.pop(0)
        y = float(cd @ x) + dd * acting
        found[step] = y
        if not abs(y) < _WILD * max(1.0, abs(target)):
            found[step:] = np.nan
            return found, False
        filtered += error_share * (target - seen(y) - filtered)
        summed += filtered * dt
        sloped += slope_share * ((filtered - before) / dt - sloped)
        before = filtered
        u = k.get("FF", 0.0) * target + k.get("P", 0.0) * filtered + k.get("I", 0.0) * summed + k.get("D", 0.0) * sloped
        waiting.append(u + disturbance)
        x = ad @ x + bd * acting
    return found, True


class _Gyro:
    """ArduPilot's second-order low-pass, as a state of two numbers; nothing where the corner is 0."""

    def __init__(self, corner: float, dt: float) -> None:
        w = 2.0 * np.pi * corner
        self._on, a = corner > 0.0, np.array([[0.0, 1.0], [-(w**2), -np.sqrt(2.0) * w]])
        held = expm(np.block([[a, np.array([[0.0], [w**2]])], [np.zeros((1, 3))]]) * dt)
        self._a, self._b, self._x = held[:2, :2], held[:2, 2], np.zeros(2)

    def __call__(self, value: float) -> float:
        if not self._on:
            return value
        self._x = self._a @ self._x + self._b * value
        return float(self._x[0])


def _grows(values: Array) -> bool:
    """Whether an oscillation is larger in the last third than in the one before."""
    third = values.size // 3
    early, late = np.ptp(values[third : 2 * third]), np.ptp(values[2 * third :])
    return not late < 1.05 * early + 1e-6
