"""Whether the page's own pilot holds a vehicle with late commands and identified sensors: its loop about the hover."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from swashplate.arrays import Array
from swashplate.links.live.pilots import WANTED, Mode, Pilot
from swashplate.links.live.sensors import TrackedSensors
from swashplate.simulation.linearize import LinearModel

_GROWS = 1.001
"""Deviations that grow more than this from sample to sample are not held; a free place has 1."""
_STEP = 1e-6


def holds(pilot: Pilot, mode: Mode, model: LinearModel, back: NDArray[np.int_], sensors: TrackedSensors) -> bool:
    """Whether deviations from the hover fade, or grow no faster than they would were nothing late and all states seen.

    Args:
        pilot: its law. mode: in which it flies.
        model: of the vehicle about the hover.
        back: how many commands ago the one was given that acts in a step, shape (steps of a period, inputs).
        sensors: what the law reads.
    """
    usual = _growth(pilot, _feedback(pilot, mode, model, TrackedSensors()), model, 0 * back)
    return _growth(pilot, _feedback(pilot, mode, model, sensors), model, back) <= max(_GROWS, usual)


def _feedback(pilot: Pilot, mode: Mode, model: LinearModel, sensors: TrackedSensors) -> Array:
    """Slopes of what is carried and commanded to what was carried and the states, by differences."""
    x = np.array(model.trim.state, dtype=np.float64)
    wanted = np.zeros(len(WANTED))
    wanted[:4] = sensors.read(x)[[model.states.index(name) for name in ("x", "y", "z", "psi")]]
    at, size = np.concatenate([pilot.memory, x]), pilot.memory.size
    voltage, gains = float(model.trim.environment.voltage or 0.0), pilot.gains[mode, True]

    def decided(row: Array) -> Array:
        readings = np.concatenate([sensors.read(row[size:]), np.zeros(3), [voltage]])
        return np.concatenate(pilot.decide(row[:size], readings, wanted, gains))

    steps = _STEP * np.eye(at.size)
    return np.stack([(decided(at + one) - decided(at - one)) / (2.0 * _STEP) for one in steps], axis=1)


def _growth(pilot: Pilot, fed: Array, model: LinearModel, back: NDArray[np.int_]) -> float:
    """By how much the worst deviation grows in a period. A row is states, what is carried, and the last commands."""
    n, m = model.B.shape
    rate = pilot.rate * len(back)
    held = expm(np.block([[model.A, model.B], [np.zeros((m, n + m))]]) / rate)
    carried, past = pilot.memory.size, 1 + int(np.max(back))
    size = n + carried + past * m
    measured = np.zeros((carried + m, size))
    measured[:, n : n + carried], measured[:, :n] = fed[:, :carried], fed[:, carried:]
    commands = np.zeros(((past + 1) * m, size))
    commands[:m], commands[m:, n + carried :] = measured[carried:], np.eye(past * m)
    state = np.eye(n, size)
    for row in back:
        state = held[:n, :n] @ state + held[:n, n:] @ commands[row * m + np.arange(m)]
    after = np.concatenate([state, measured[:carried], commands[: past * m]])
    return float(np.abs(np.linalg.eigvals(after)).max())
