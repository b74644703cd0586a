"""The sampled linear model that an observer works with about a trim: states, disturbances, biases, late readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering import observer
from swashplate.filtering.disturbances import DISTURBED
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.simulation.discretisation import held_late, with_late_inputs
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim import Trim


@dataclass(frozen=True)
class SampledObserverModel:
    """The sampled model that an observer works with about a trim.

    Attributes:
        F, G: of states, disturbances, biases, late readings and waiting commands.
        H: outputs.
        process, noise: covariances per sample; the noise of a sensor that is heard every k-th time is k times its own.
        names: of its states.
        vehicle: places of the vehicle's states in it; all but disturbances and biases follow the vehicle.
        driven: places of what a truth without disturbances and biases has.
    """

    F: Array
    G: Array
    H: Array
    process: Array
    noise: Array
    names: tuple[str, ...]
    vehicle: tuple[int, ...]
    driven: tuple[int, ...]


def sampled_observer_model(
    plan: ObserverPlan,
    numbers: Numbers,
    model: LinearModel,
    *,
    without: Sequence[str] = (),
    delays: Sequence[float] | None = None,
) -> SampledObserverModel:
    """The observer's linear model about a model's trim.

    Args:
        plan, numbers: the observer.
        model: of the vehicle; states behind those of the vehicle (actuators) are allowed.
        without: states left out (a place that nothing sees).
        delays: of the inputs [s], where they are not the plan's whole samples.
    """
    n, nb = len(model.states), len(plan.biases)
    first = n + 6 + nb
    A = disturbed(numbers, model, first)
    B = np.zeros((first, plan.inputs))
    B[:n] = model.B
    lags = [d * plan.dt for d in plan.delays] if delays is None else delays
    F, G, before, steps = held_late(A, B, plan.dt, lags)
    slopes, more = outputs(plan, numbers, model.trim), n - plan.n
    H = np.hstack([slopes[:, : plan.n], np.zeros((len(slopes), more)), slopes[:, plan.n : first - more]])
    names = [*model.states, *(f"disturbance {d}" for d in DISTURBED), *(f"bias {b}" for b in plan.biases)]
    noise_of = np.asarray(numbers.process)
    process = np.concatenate([noise_of[: plan.n], np.full(more, 1e-8), noise_of[plan.n : first - more]])
    F, H, added = _late_readings(F, H, plan)
    G, before = (np.vstack([part, np.zeros((len(added), plan.inputs))]) for part in (G, before))
    names += added
    F, G, waiting = with_late_inputs(F, G, steps, before)
    H = np.hstack([H, np.zeros((H.shape[0], len(waiting)))])
    names += [f"{model.inputs[j]} {ago} ago" for j, ago in waiting]
    every = [at.every for s, at in zip(plan.sensors, plan.sampling, strict=True) for _ in s.channels]
    noise = np.diag(np.asarray(numbers.measurement) * every)
    full = np.zeros(len(names))
    full[:first] = process
    kept = [i for i, name in enumerate(names) if name not in without]
    names = [names[i] for i in kept]
    vehicle = tuple(names.index(name) for name in model.states if name not in without)
    unmoved = {f"disturbance {d}" for d in DISTURBED} | {f"bias {b}" for b in plan.biases}
    driven = tuple(i for i, name in enumerate(names) if name not in unmoved)
    return SampledObserverModel(
        F[np.ix_(kept, kept)], G[kept], H[:, kept], np.diag(full[kept]), noise, tuple(names), vehicle, driven
    )


def disturbed(numbers: Numbers, model: LinearModel, size: int) -> Array:
    """A of the vehicle's states and the disturbances that fade behind them; the rest of `size` states stands still."""
    n = len(model.states)
    A = np.zeros((size, size))
    A[:n, :n] = model.A
    for i, name in enumerate(DISTURBED):
        A[model.states.index(name), n + i] = 1.0
    A[n : n + 6, n : n + 6] = -np.diag(np.asarray(numbers.fade))
    return A


def _late_readings(F: Array, H: Array, plan: ObserverPlan) -> tuple[Array, Array, list[str]]:
    """The model with chains of samples for readings that arrive late."""
    channel, names = 0, []
    for sensor, at in zip(plan.sensors, plan.sampling, strict=True):
        rows = slice(channel, channel + len(sensor.channels))
        channel = rows.stop
        for step in range(at.delay):
            size, m = F.shape[0], len(sensor.channels)
            larger = np.zeros((size + m, size + m))
            larger[:size, :size], larger[size:, :size] = F, H[rows]
            wider = np.hstack([H, np.zeros((H.shape[0], m))])
            wider[rows] = 0.0
            wider[rows, size:] = np.eye(m)
            F, H = larger, wider
            names += [f"{sensor.kind}.{name} {step + 1} ago" for name in sensor.channels]
    return F, H, names


def outputs(plan: ObserverPlan, numbers: Numbers, trim: Trim) -> Array:
    """Slopes of all channels by everything estimated, about a trim."""
    if not plan.sensors:
        return np.zeros((0, len(plan.names)))
    e = np.concatenate([trim.state, np.zeros(len(plan.names) - plan.n)])
    w = np.array([*trim.inputs, trim.environment.voltage], dtype=np.float64)
    return observer.linearised_at(observer.shown, plan, numbers, e, w)[1]
