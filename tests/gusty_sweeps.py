"""Sweeps flown in a loop through gusts, by a program or by hand, many flights at once; the reference is kept apart.

The aircraft is a published model in hover (`r50.truth`); the loop is that of `r50.fly`. What the loop makes of gusts is
in the recorded inputs, as in every real log of a sweep.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_continuous_are

from r50 import AMPLITUDE, NOISE, RATE
from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.flights.provenance import Provenance
from swashplate.models.linear.state_space import StateSpaceModel

GUSTS = {"none": 0.0, "light": 0.5, "moderate": 1.0, "strong": 2.0, "severe": 4.0}
"""Standard deviation of the wind along each axis [m/s]; in severe gusts the loop moves the sticks as much as the sweep
does, the collective more."""
SIZES = {name: 0.3 * size for name, size in AMPLITUDE.items()}
"""Of a sweep: 7 degrees per second of roll, as one flies them."""
LOOP = {"u": 0.02, "v": 0.02, "w": 0.02, "phi": 0.2, "theta": 0.2, "r": 0.05}
"""Weights of the hold, for a linear-quadratic one; 1e-4 for the other states, one for the controls."""
BANDS = {"automatic": (0.05, 6.0), "by hand": (0.08, 3.0)}
"""What is swept [Hz]: a hand is slower, and has no patience for 20 s a cycle."""
SECONDS = 120.0


@dataclass(frozen=True)
class Question:
    """One record to fly: which axis, how, in what gusts [m/s], with which seed."""

    axis: str
    kind: str
    gust: float
    seed: int


def automatic(question: Question, time: Array) -> Array:
    """Tischler's schedule, as programs fly it."""
    length = float(time[-1]) - 6.0
    made = Maneuver("sweep", (question.axis,), length, SIZES[question.axis], BANDS["automatic"])
    return made.signals(time - 3.0)[question.axis]


def by_hand(question: Question, time: Array) -> Array:
    """What a pilot makes of a sweep: irregular speed and size, pauses, a wave that is no sine.

    The frequency follows the schedule at a speed that wanders by 35 % over some seconds, and itself by 12 % from one
    cycle to the next; two or three times the stick is held still for 1 to 4 s and taken up again at another phase.
    """
    random = np.random.default_rng([question.seed, 7])
    dt, count = float(time[1] - time[0]), time.size
    low, high = BANDS["by hand"]
    speed = np.exp(0.35 * _wander(random, count, dt, 5.0))
    held = np.zeros(count, dtype=bool)
    for at in random.uniform(0.2, 0.95, random.integers(2, 4)) * time[-1]:
        held |= (time > at) & (time < at + random.uniform(1.0, 4.0))
    progress = np.cumsum(np.where(held, 0.0, speed)) * dt
    progress = np.clip((progress - 3.0) / (progress[-1] - 6.0), 0.0, 1.0)
    rise = np.expm1(4.0 * progress) / np.expm1(4.0)
    cycle = np.exp(0.12 * _wander(random, count, dt, 1.0))
    frequency = (low + (high - low) * rise) * cycle
    phase = 2.0 * np.pi * np.cumsum(np.where(held, 0.0, frequency)) * dt
    edges = np.flatnonzero(np.diff(held.astype(int)) > 0)
    phase = phase + sum(random.uniform(-1.0, 1.0) * (np.arange(count) > edge) for edge in edges)
    size = np.exp(0.2 * _wander(random, count, dt, 3.0))
    wave = np.sin(phase) - 0.08 * np.sin(3.0 * phase + 0.3)
    inside = (progress > 0.0) & (progress < 1.0) & ~held
    smooth = np.hanning(25) / np.hanning(25).sum()
    return np.asarray(SIZES[question.axis] * np.convolve(np.where(inside, size * wave, 0.0), smooth, mode="same"))


def corrections(question: Question, time: Array, inputs: Sequence[str]) -> Array:
    """What a pilot adds besides: pulses on any stick every 6 s or so, and a tremor; shape (n, inputs)."""
    random = np.random.default_rng([question.seed, 8])
    added = np.zeros((time.size, len(inputs)))
    for j, name in enumerate(inputs):
        for at in np.cumsum(random.exponential(24.0, 20)):
            length, size = random.uniform(0.3, 1.2), random.normal(0.0, 0.25)
            part = (time - at) / length
            added[:, j] += np.where((part > 0) & (part < 1), size * SIZES[name] * np.sin(np.pi * part) ** 2, 0.0)
        added[:, j] += 0.02 * SIZES[name] * _wander(random, time.size, float(time[1] - time[0]), 0.3)
    return added


def _wander(random: np.random.Generator, count: int, dt: float, over: float) -> Array:
    """A random walk that comes back (Ornstein-Uhlenbeck), of unit size, over some seconds."""
    from scipy.signal import lfilter

    keep = np.exp(-dt / over)
    kicks = np.sqrt(1.0 - keep**2) * random.standard_normal(count)
    return np.asarray(lfilter([1.0], [1.0, -keep], kicks))


SHAPES = {"automatic": automatic, "by hand": by_hand}


def fly(
    model: StateSpaceModel, questions: Sequence[Question], *, seconds: float = SECONDS, size: float = 1.0
) -> list[Flight]:
    """The flights, one per question, all at once; channel `truth_reference` holds what was asked of the swept input.

    Args:
        model: the truth. questions: the records. seconds: length of each. size: of all that the pilot does.
    """
    a, b, c, d = model.explicit()
    n, m, dt, many = len(model.states), len(model.inputs), 1.0 / RATE, len(questions)
    weights = np.diag([LOOP.get(state, 1e-4) for state in model.states])
    gain = np.linalg.solve(np.eye(m), b.T @ solve_continuous_are(a, b, weights, np.eye(m)))
    wind = a[:, [model.states.index(s) for s in ("u", "v", "w")]]
    held = np.hstack([b, -wind])
    k = held.shape[1]
    block = np.zeros((n + 2 * k, n + 2 * k))
    block[:n, :n], block[:n, n : n + k] = a, held
    block[n : n + k, n + k :] = np.eye(k) / dt
    step = expm(block * dt)
    phi, g0, g1 = step[:n, :n], step[:n, n : n + k], step[:n, n + k :]
    count = round(seconds * RATE)
    time = np.arange(count) * dt
    asked = np.zeros((count, many, m))
    swept = np.zeros((count, many))
    shake, noise = np.zeros((count, many, 3)), np.zeros((count, many, len(model.outputs)))
    sizes = np.array([NOISE[name] for name in model.outputs])
    for f, question in enumerate(questions):
        random = np.random.default_rng(question.seed)
        swept[:, f] = size * SHAPES[question.kind](question, time)
        place = model.inputs.index(question.axis)
        mixing = 0.15 * random.standard_normal(m)
        mixing[place] = 1.0
        asked[:, f] = swept[:, f, None] * mixing
        if question.kind == "by hand":
            asked[:, f] += size * corrections(question, time, model.inputs)
        shake[:, f] = question.gust * np.stack([_wander(random, count, dt, 1.5) for _ in range(3)], axis=1)
        noise[:, f] = sizes * random.standard_normal((count, len(sizes)))
    late = np.array([model.delay(model.outputs[0], name) / dt for name in model.inputs])
    whole, part = late.astype(int), late - late.astype(int)
    felt = model.matrices()["H1"] @ wind
    commands, outputs, x = np.zeros((count, many, m)), np.zeros((count, many, len(sizes))), np.zeros((many, n))
    before = np.zeros((many, k))
    columns = np.arange(m)
    reach = int(whole.max()) + 2
    padded = np.zeros((count + reach, many, m))
    for i in range(count):
        padded[i + reach] = asked[i] - x @ gain.T
        recent = padded[i + reach - whole, :, columns].T
        older = padded[i + reach - whole - 1, :, columns].T
        delayed = recent + part * (older - recent)
        after = np.concatenate([delayed, shake[i]], axis=1)
        if i:
            x = x @ phi.T + before @ g0.T + (after - before) @ g1.T
        outputs[i] = x @ c.T + delayed @ d.T - shake[i] @ felt.T
        before = after
    commands = padded[reach:]
    measured = outputs + noise
    flights = []
    for f, question in enumerate(questions):
        table = {name: measured[:, f, i] for i, name in enumerate(model.outputs)}
        table |= {name: commands[:, f, i] for i, name in enumerate(model.inputs)}
        table["truth_reference"] = swept[:, f]
        units = dict.fromkeys(model.inputs, "1") | {"truth_reference": "rad"}
        source = f"{question.axis} {question.kind} {question.seed}"
        flights.append(Flight({"uniform": stream(time, table, units)}, Provenance(source=source, simulated=True)))
    return flights
