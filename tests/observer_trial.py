"""Flights under an observer, and whether its sigmas are right: true states, estimates and what it claims, side by side.

The vehicle is disturbed by white noise on its states, as the observer has it, and by gusts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.control.lqg.constant_gain import steady_sigmas
from swashplate.control.lqg.controller import Lqg
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row
from swashplate.engine.law import REFERENCES
from swashplate.engine.trace import traced_force
from swashplate.engine.virtual import rk4_graph
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.wind import Gusts, dryden

SETTLING, SUBSTEPS = 4.0, 4


@dataclass(frozen=True)
class Consistency:
    """One state: root mean square of its error, of the claimed sigma, of their ratio squared, share within three."""

    name: str
    error: float
    sigma: float
    nees: float
    within: float


@dataclass(frozen=True)
class Trial:
    """All states, and how far place and height stray in each flight [m]."""

    states: tuple[Consistency, ...]
    place: Array
    height: Array

    def of(self, name: str) -> Consistency:
        return next(state for state in self.states if state.name == name)


def trial(vehicle: Vehicle, controller: Lqg, *, duration: float, seeds: Sequence[int], gusts: Gusts) -> Trial:
    """Fly a controller with its observer, once per seed."""
    flights = [_flown(vehicle, controller, duration, seed, gusts) for seed in seeds]
    truth, estimates, sigmas = (np.stack([flight[i] for flight in flights], axis=1) for i in range(3))
    judged = slice(round(SETTLING * controller.rate), None)
    error = estimates[judged] - truth[judged]
    psi = vehicle.index("psi")
    error[..., psi] = np.arctan2(np.sin(error[..., psi]), np.cos(error[..., psi]))
    ratio = error / sigmas[judged]
    states = tuple(
        Consistency(
            name,
            float(np.sqrt(np.mean(error[..., i] ** 2))),
            float(np.sqrt(np.mean(sigmas[judged][..., i] ** 2))),
            float(np.mean(ratio[..., i] ** 2)),
            float(np.mean(np.abs(ratio[..., i]) <= 3.0)),
        )
        for i, name in enumerate(vehicle.state_names)
    )
    away = truth[judged][..., :3] - controller.start.state[:3]
    place = np.sqrt(np.mean(np.sum(away[..., :2] ** 2, axis=-1), axis=0))
    return Trial(states, place, np.sqrt(np.mean(away[..., 2] ** 2, axis=0)))


def _flown(vehicle: Vehicle, controller: Lqg, duration: float, seed: int, gusts: Gusts) -> tuple[Array, Array, Array]:
    """True states, estimates and claimed sigmas after every sample, (samples, states) each."""
    plan, law, n = controller.plan, controller.law(vehicle), len(vehicle.state_names)
    samples, N = round(duration * plan.rate), len(plan.names)
    start = controller.start
    around = np.zeros((samples, len(SURROUNDINGS)))
    around[:, 3] = float(start.environment.voltage)
    blowing = dryden(gusts, samples=samples, rate=plan.rate, seed=seed)
    around[:, :3] = np.stack([blowing[name][:, 0] for name in SURROUNDINGS[:3]], axis=1)
    wanted = np.array([start.states().get(name, 0.0) for name in REFERENCES])
    spread = np.sqrt(np.asarray(controller.numbers.process)[:n])
    pushes = np.random.default_rng([seed, 2]).standard_normal((samples, n)) * spread
    draws, memory = controller.draws(samples, seed), controller.memory_of_law(seed)
    step, felt = rk4_graph(equations_of(vehicle)), traced_force(equations_of(vehicle))
    p, x, inputs = parameter_row(vehicle, start.environment), start.state, np.zeros(len(vehicle.input_names))
    sent = [start.inputs] * (max(plan.delays) + 1)
    promised = steady_sigmas(controller)[:n] if plan.period else np.zeros(n)
    kept = []
    for k in range(samples):
        force = np.asarray(felt(x, np.concatenate([inputs, around[k]]), p)).ravel()
        told = np.concatenate([x, force, around[k, 3:], draws[k]])
        after = np.asarray(law.function(memory, told[law.places], wanted)).ravel()
        memory, command = after[: law.memory], after[law.memory :]
        sent = [command, *sent[:-1]]
        inputs = np.array([sent[late][j] for j, late in enumerate(plan.delays)])
        w = np.concatenate([inputs, around[k]])
        for _ in range(SUBSTEPS):
            x = np.asarray(step(x, w, w, w, p, plan.dt / SUBSTEPS)).ravel()
        x = x + pushes[k]
        sure = promised if plan.period else np.sqrt(np.diag(memory[N : N + N * N].reshape(N, N)))[:n]
        kept.append((x, memory[:n], sure))
    truth, estimates, sigmas = (np.array([row[i] for row in kept]) for i in range(3))
    return truth, estimates, sigmas
