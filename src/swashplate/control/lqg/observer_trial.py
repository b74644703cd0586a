"""Is the observer as sure as it may be? Many flights with a truth that strays as the observer was told, and in gusts.

The truth moves by the nonlinear equations at a finer step, in Dryden gusts that the observer knows nothing of but its
disturbing accelerations, with white noise on inner states as in `Unrest`, and is seen through the simulated sensors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from swashplate.arrays import Array
from swashplate.control.lqg.constant_gain import steady_sigmas
from swashplate.control.lqg.controller import Lqg, SensedStep
from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import REFERENCES, told
from swashplate.simulation.compilation import QUICK_FLIGHT
from swashplate.simulation.dynamics import enable_double_precision, row_rates
from swashplate.simulation.runge_kutta import rk4_steps
from swashplate.simulation.wind import Gusts, dryden

_SETTLING = 2.0
"""Seconds at the start that are not judged."""


@dataclass(frozen=True)
class Consistency:
    """One state over all flights.

    Attributes:
        name: of the state.
        error: RMS of the estimate's error [its unit].
        sigma: RMS of what the observer claimed.
        nees: mean of (error / sigma)^2: one where it claims what is true (Bar-Shalom et al. 2001, sec. 5.4).
        within: share of the samples within three sigmas.
    """

    name: str
    error: float
    sigma: float
    nees: float
    within: float


@dataclass(frozen=True)
class ObserverTrial:
    """Many flights under an observer.

    Attributes:
        states: by state.
        place, height: RMS of the distance to the place asked for, level and vertical [m], per flight.
        truth, estimates, sigmas: (samples, flights, states) of the flights.
    """

    states: tuple[Consistency, ...]
    place: Array
    height: Array
    truth: Array
    estimates: Array
    sigmas: Array

    def of(self, name: str) -> Consistency:
        """The state of that name."""
        return next(state for state in self.states if state.name == name)

    def __repr__(self) -> str:
        lines = [f"{self.place.size} flights; place {1e3 * np.sqrt(np.mean(self.place**2)):.1f} mm RMS, height "]
        lines[0] += f"{1e3 * np.sqrt(np.mean(self.height**2)):.1f} mm RMS"
        lines.append(f"{'state':<14}{'error':>11}{'claimed':>11}{'(e/s)^2':>9}{'in 3 s':>9}")
        for s in self.states:
            lines.append(f"{s.name:<14}{s.error:>11.3g}{s.sigma:>11.3g}{s.nees:>9.2f}{100 * s.within:>8.1f}%")
        return "\n".join(lines)


def trial(
    vehicle: Vehicle,
    controller: Lqg,
    *,
    duration: float,
    seeds: Sequence[int],
    gusts: Gusts | None = None,
    substeps: int = 4,
    reference: Sequence[float] | None = None,
) -> ObserverTrial:
    """Fly a controller with its observer, once per seed.

    Args:
        vehicle: the truth, which need not be the model of the controller.
        controller: an `Lqg` with sensors.
        duration: [s].
        seeds: of noise, biases, gusts.
        gusts: none where not given.
        substeps: steps of the truth per sample.
        reference: the row of `REFERENCES`; the start's place and heading where not given.
    """
    enable_double_precision()
    plan = controller.plan
    samples, n = round(duration * plan.rate), plan.n
    states = controller.start.states()
    wanted = np.array([states.get(name, 0.0) for name in REFERENCES] if reference is None else reference)
    around = np.zeros((samples, len(SURROUNDINGS), len(seeds)))
    around[:, 3] = float(controller.start.environment.voltage)
    if gusts is not None:
        for i, seed in enumerate(seeds):
            blowing = dryden(gusts, samples=samples, rate=plan.rate, seed=int(seed))
            around[:, :3, i] = np.stack([blowing[name][:, 0] for name in SURROUNDINGS[:3]], axis=1)
    # The disturbing accelerations stand for the gusts, so they are no noise of the truth; the white ones are.
    spread = np.sqrt(np.asarray(controller.numbers.process)[:n])
    arrays = _fly(
        equations_of(vehicle),
        controller.step,
        substeps,
        jnp.asarray(controller.start.state),
        jnp.asarray(controller.start.inputs),
        jnp.asarray(controller.memories(seeds)),
        jnp.asarray(controller.gains),
        jnp.asarray(np.asarray(seeds, dtype=np.int64)),
        jnp.asarray(around),
        jnp.asarray(wanted),
        jnp.asarray(parameter_row(vehicle, controller.start.environment)),
        jnp.asarray(spread),
        jnp.asarray(steady_sigmas(controller)[:n] if plan.period else np.zeros(n)),
    )
    truth, estimates, sigmas = (np.moveaxis(np.asarray(part), 0, 1) for part in arrays)
    judged = slice(round(_SETTLING * plan.rate), None)
    error = estimates[judged] - truth[judged]
    psi = plan.equations.vehicle.index("psi")
    error[..., psi] = np.arctan2(np.sin(error[..., psi]), np.cos(error[..., psi]))
    ratio = error / sigmas[judged]
    made = tuple(
        Consistency(
            name,
            float(np.sqrt(np.mean(error[..., i] ** 2))),
            float(np.sqrt(np.mean(sigmas[judged][..., i] ** 2))),
            float(np.mean(ratio[..., i] ** 2)),
            float(np.mean(np.abs(ratio[..., i]) <= 3.0)),
        )
        for i, name in enumerate(vehicle.state_names)
    )
    away = truth[judged][..., :3] - wanted[:3]
    place = np.sqrt(np.mean(np.sum(away[..., :2] ** 2, axis=-1), axis=0))
    height = np.sqrt(np.mean(away[..., 2] ** 2, axis=0))
    return ObserverTrial(made, place, height, truth, estimates, sigmas)


@jit(static_argnums=(0, 1, 2), compiler_options=QUICK_FLIGHT)
def _fly(
    equations: Equations,
    control: SensedStep,
    substeps: int,
    x0: Float[jax.Array, " states"],
    first: Float[jax.Array, " inputs"],
    memories: Float[jax.Array, "memory flights"],
    gains: Float[jax.Array, " gains"],
    seeds: Int[jax.Array, " flights"],
    around: Float[jax.Array, "samples surroundings flights"],
    wanted: Float[jax.Array, " references"],
    p: Float[jax.Array, " parameters"],
    spread: Float[jax.Array, " states"],
    promised: Float[jax.Array, " states"],
) -> Any:
    rates = row_rates(equations, padded=False)
    n, N, dt = x0.shape[0], len(control.plan.names), control.plan.dt
    late = jnp.asarray(control.plan.delays)
    before = jnp.broadcast_to(first, (max(control.plan.delays) + 1, first.shape[0]))

    def one(
        memory: Float[jax.Array, " memory"], seed: Int[jax.Array, ""], winds: Float[jax.Array, "samples surroundings"]
    ) -> Any:
        own = jax.random.fold_in(jax.random.key(seed), 1_000_003)

        def sample(carry: Any, now: Any) -> Any:
            x, memory, inputs, sent, k = carry
            measured = told(control, equations, x, inputs, now, p)
            memory, command = control(memory, k * dt, measured, wanted, gains)
            sent = jnp.concatenate([command[None], sent[:-1]])
            inputs = jnp.take_along_axis(sent, late[None], axis=0)[0]
            w = jnp.concatenate([inputs, now])
            after = rk4_steps(lambda x, w: rates(x, w, p), x, lambda *_: w, dt / substeps, substeps)
            after = after + spread * jax.random.normal(jax.random.fold_in(own, k), x.shape)
            sure = promised  # constant gains carry no covariance
            if not control.plan.period:
                sure = jnp.sqrt(jnp.diagonal(memory[N : N + N * N].reshape(N, N))[:n])
            predicted = memory[:n], sure
            return (after, memory, inputs, sent, k + 1), (after, *predicted)

        start = (x0, memory, jnp.zeros(len(equations.vehicle.input_names)), before, 0)
        return jax.lax.scan(sample, start, winds)[1]

    # One flight after the other: a batch of covariances does not fit into the cache.
    return jax.lax.map(lambda each: one(*each), (memories.T, seeds, jnp.moveaxis(around, 2, 0)))
