"""A rate loop closed over an identified model, in time: the answer to a step of the target, and to a disturbance.

ArduPilot's controller of `ardupilot_gains`: u = FF target + P e + I int e + D de/dt, with the filters FLTT of the
target, FLTE of the error and FLTD of the derivative, all of first order; with FLTG, Rotorflight's filter of the gyro,
the derivative is that of the gyro alone. The loop is stepped at 400 Hz, as ArduPilot runs (Rotorflight is faster), with
the model exact between steps (zero-order hold) and its delay in whole steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from swashplate.arrays import Array
from swashplate.control.analysis.rate_gain_names import short
from swashplate.errors import ControllerError
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.shown import Shown

RATE = 400.0
"""Hz: ArduPilot's loop."""
DISTURBED = 0.1
"""Of the command: the step of a disturbance."""
_WILD = 50.0
"""A rate beyond so many times the target, or an answer that still grows: the loop is unstable."""


@dataclass(frozen=True)
class RateSteps(Shown):
    """How a rate loop answers.

    Attributes:
        time: from the step on [s], shape (n,).
        step: rate over a target of 1, shape (n,).
        disturbance: rate after a step of 0.1 of the command, in the model's unit, shape (n,).
        stable: whether both settle; where they do not, no gains should be flown.
        overshoot: of the step beyond 1 (NaN where it leaves all bounds); settled: its last value.
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
        gains: by ArduPilot's names (`ATC_RAT_RLL_P`, ...) or their ends (`P`, `I`, `D`, `FF`, `FLTT`, `FLTE`, `FLTD`),
            or by Rotorflight's (`roll_p_gain`, ...).
        rate, command: the model's output and input.
        seconds: how long.
        gyro_filter: corner of a gyro filter that the model has not seen [Hz]; 0 for none.

    Raises:
        ControllerError: no gain among the names, or a model without these channels.
    """
    structure = structure_of(model) if isinstance(model, Vehicle) else model
    k = short(gains)
    if not {"P", "I", "D", "FF"} & set(k):
        raise ControllerError(f"hold no gain of a rate loop: {', '.join(gains) or 'none'}.", channel="gains")
    for name, names in ((rate, structure.outputs), (command, structure.inputs)):
        if name not in names:
            raise ControllerError(f"is no channel of the model; it has {', '.join(names)}.", channel=name)
    row = {name: np.array([value]) for name, value in k.items()}
    step = stepped(structure, row, rate, command, seconds=seconds, gyro_filter=gyro_filter)[:, 0]
    shaken = stepped(
        structure, row, rate, command, seconds=seconds, gyro_filter=gyro_filter, target=0.0, disturbance=DISTURBED
    )[:, 0]
    time = np.arange(step.size) / RATE
    stable = not _grows(step - step[-1]) and not _grows(shaken - shaken[-1])
    return RateSteps(time, step, shaken, stable, float(np.maximum(0.0, np.max(step) - 1.0)), float(step[-1]))


class HeldModel(NamedTuple):
    """From a command that is held over each step to a rate: matrices (n, n), (n, m), (n,), (m,), and delays [steps]."""

    ad: Array
    bd: Array
    cd: Array
    dd: Array
    delay_steps: NDArray[np.int64]


def held_model(model: StateSpaceModel, rate: str, command: str) -> HeldModel:
    """A model stepped at the loop's rate, exact between steps; m is at how many delays the command acts."""
    model, owner = model.wide  # one input for every time at which the command acts
    a, b, c, d = model.explicit()
    driven = [k for k, j in enumerate(owner) if model.inputs[j] == command]
    o, n, dt = model.outputs.index(rate), a.shape[0], 1.0 / RATE
    held = expm(np.block([[a, b[:, driven]], [np.zeros((len(driven), n + len(driven)))]]) * dt)
    # One step at least: commands act after it.
    delay_steps = np.array([max(1, round(model.delay(rate, model.inputs[k]) * RATE)) for k in driven], dtype=np.int64)
    return HeldModel(held[:n, :n], held[:n, n:], c[o], d[o, driven], delay_steps)


def stepped(
    model: StateSpaceModel,
    gains: Mapping[str, Array],
    rate: str,
    command: str,
    *,
    seconds: float,
    gyro_filter: float = 0.0,
    target: float = 1.0,
    disturbance: float = 0.0,
) -> Array:
    """The rate with each of m sets of gains, shape (n, m); NaN from where it leaves all bounds.

    Args:
        gains: by their short names (`P`, `I`, ...), shape (m,) each.
        target, disturbance: steps at the start, of the demanded rate and of the command.
    """
    k = {
        name: np.asarray(gains.get(name, 0.0), dtype=np.float64)
        for name in ("FF", "P", "I", "D", "FLTT", "FLTE", "FLTD", "FLTG")
    }
    m = max(value.size for value in k.values())
    ad, bd, cd, dd, delay_steps = held_model(model, rate, command)
    n, dt = ad.shape[0], 1.0 / RATE
    given = np.zeros((int(delay_steps.max()), m))
    wanted, slow, filtered, sloped, before, summed, x = *np.zeros((6, m)), np.zeros((n, m))
    target_share, error_share, slope_share, gyro_share = (
        np.where(k[name] > 0.0, 1.0 - np.exp(-2.0 * np.pi * k[name] * dt), 1.0)
        for name in ("FLTT", "FLTE", "FLTD", "FLTG")
    )
    of_gyro = "FLTG" in gains
    gyro, flying = _Gyro(gyro_filter, dt, m), np.ones(m, dtype=bool)
    rates = np.full((round(seconds * RATE) + 1, m), np.nan)
    for step in range(len(rates)):
        acting = given[-delay_steps]
        y = cd @ x + dd @ acting
        flying &= np.abs(y) < _WILD * max(1.0, abs(target))
        rates[step, flying] = y[flying]
        wanted = wanted + target_share * (target - wanted)
        slow = slow + gyro_share * (gyro(np.where(flying, y, 0.0)) - slow)
        filtered = filtered + error_share * (wanted - slow - filtered)
        summed = summed + filtered * dt
        changing = -slow if of_gyro else filtered
        sloped = sloped + slope_share * ((changing - before) / dt - sloped)
        before = changing
        asked = k["FF"] * wanted + k["P"] * filtered + k["I"] * summed + k["D"] * sloped + disturbance
        given = np.concatenate([given[1:], asked[None]])
        x = (ad @ x + bd @ acting) * flying
    return rates


class _Gyro:
    """ArduPilot's second-order low-pass, as states of two numbers; nothing where the corner is 0."""

    def __init__(self, corner: float, dt: float, size: int) -> None:
        w = 2.0 * np.pi * corner
        self._on, a = corner > 0.0, np.array([[0.0, 1.0], [-(w**2), -np.sqrt(2.0) * w]])
        held = expm(np.block([[a, np.array([[0.0], [w**2]])], [np.zeros((1, 3))]]) * dt)
        self._a, self._b, self._x = held[:2, :2], held[:2, 2], np.zeros((2, size))

    def __call__(self, value: Array) -> Array:
        if not self._on:
            return value
        self._x = self._a @ self._x + np.outer(self._b, value)
        return np.asarray(self._x[0])


def _grows(values: Array) -> bool:
    """Whether an oscillation is larger in the last third than in the one before, or left all bounds."""
    third = values.size // 3
    early, last = np.ptp(values[third : 2 * third]), np.ptp(values[2 * third :])
    return not last < 1.05 * early + 1e-6
