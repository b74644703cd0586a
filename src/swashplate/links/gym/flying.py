"""The physics, observation and reward that the single and the vector environment share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, parameter_row
from swashplate.engine.fly import FlightPlan, fly
from swashplate.errors import SwashError
from swashplate.links.gym.tasks import Task
from swashplate.models.catalogue import vehicle as find_vehicle
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, local_to_body
from swashplate.simulation.standing import at_rest, standing
from swashplate.simulation.stepping import LONGEST_STEP
from swashplate.simulation.trim import Trim, trim

OBSERVED = (
    *("ahead", "right", "below"),
    *("u", "v", "w"),
    *("roll", "pitch", "heading"),
    *("p", "q", "r"),
)
"""What is observed: target minus actual of place [m], velocity [m/s] (body axes), roll, pitch and heading [rad]; body
rates [rad/s]. Rotor, bar and inflow states stay hidden unless they are asked for."""
LIMITS = np.array([50.0] * 3 + [50.0] * 3 + [np.pi] * 3 + [20.0] * 3)
"""Observations are clipped to these."""
INNER_LIMIT = 1000.0
"""The same for inner states, in their own units."""
_BODY = len(OBSERVED)
SPREAD = {"place": 0.3, "velocity": 0.2, "attitude": 0.05, "rates": 0.1}
"""Half width of the uniform distribution about the trim that episodes start from [m, m/s, rad, rad/s]."""
ABOVE = 2.0
"""m above the ground that a task's place is for a vehicle that starts on it."""
CRASH = -10.0
"""Reward of the step that ends an episode by leaving the limits."""
EFFORT = 0.01
"""What the mean square of the action costs at each step."""


@dataclass(frozen=True)
class Flying:
    """A vehicle with a task.

    Attributes:
        vehicle, task, trim: what flies, what it should do, and where actions of zero hold it.
        free: places of the inputs that an action moves (a throttle that a governor stands behind is none).
        reach: what an action of 1 adds to those inputs.
        dt: between actions [s]. substeps: Runge-Kutta steps in it. steps: of an episode.
        table: targets at every step, shape (steps + 1, 9).
        parameters: the card's numbers and the surroundings' constants.
        scatter: relative standard deviations of parameters, drawn anew for each episode; by place in the row.
        spread: scale of the start's distribution.
        inner: whether states beyond the rigid body's are observed as well, less the trim's.
        rest: the state row that episodes start from instead, on the ground with its rotors stopped; None for the trim.
    """

    vehicle: Vehicle
    task: Task
    trim: Trim
    free: tuple[int, ...]
    reach: Array
    dt: float
    substeps: int
    steps: int
    table: Array
    parameters: Array
    scatter: Mapping[int, float]
    spread: float
    inner: bool = False
    rest: Array | None = None

    @property
    def observed(self) -> tuple[str, ...]:
        """What an observation holds, by name."""
        return (*OBSERVED, *(self.vehicle.state_names[_BODY:] if self.inner else ()))

    @property
    def edges(self) -> Array:
        """The largest observation."""
        return np.concatenate([LIMITS, np.full(len(self.observed) - _BODY, INNER_LIMIT)])

    def start(self, random: np.random.Generator) -> tuple[Array, Array]:
        """A state row and a parameter row of a new episode."""
        if self.rest is None:
            x = np.array(self.trim.state)
            for first, name in zip((0, 3, 6, 9), SPREAD, strict=True):
                x[first : first + 3] += self.spread * SPREAD[name] * random.uniform(-1.0, 1.0, 3)
        else:
            x = np.array(self.rest)
            x[8] = self.spread * SPREAD["attitude"] * random.uniform(-1.0, 1.0)
        p = self.parameters.copy()
        for place, sigma in self.scatter.items():
            p[place] *= 1.0 + sigma * float(np.clip(random.standard_normal(), -3.0, 3.0))
        return x, p

    def observe(self, x: Array, k: NDArray[np.int64]) -> NDArray[np.float32]:
        """Observations of states (n, n_states) at steps (n,)."""
        return self._with_inner(_clipped(_errors(x.T, self.table[k].T, self._angles)).T, x)

    def _with_inner(self, body: Array, x: Array) -> NDArray[np.float32]:
        if self.inner:
            beyond = np.nan_to_num(x[:, _BODY:] - self.trim.state[_BODY:])
            body = np.concatenate([body, np.clip(beyond, -INNER_LIMIT, INNER_LIMIT)], axis=1)
        return body.astype(np.float32)

    def advance(
        self, x: Array, k: NDArray[np.int64], actions: NDArray[Any], p: Array
    ) -> tuple[Array, NDArray[np.float32], Array, NDArray[np.bool_]]:
        """States, observations, rewards and whether the limits were left, one step later, for n vehicles at once."""
        action = np.clip(np.asarray(actions, dtype=np.float64).T, -1.0, 1.0)
        inputs = np.repeat(self.trim.inputs[:, None], len(x), axis=1)
        inputs[list(self.free)] += self.reach[:, None] * action
        low, high = np.array(self.vehicle.input_limits).T[:, :, None]
        around = np.array([[getattr(self.trim.environment, name)] for name in SURROUNDINGS])
        held = np.concatenate([np.clip(inputs, low, high), np.repeat(around, len(x), axis=1)])
        numbers = p.T if self.scatter else self.parameters[:, None]
        step = self.dt / self.substeps
        rows = np.stack([held, held])
        plan = FlightPlan(x.T, numbers, rows, step, hold=self.substeps, keep=self.substeps)
        after = fly(self.vehicle, plan, quaternion=False)[0][-1]
        target = self.table[np.minimum(k + 1, self.steps)].T
        with np.errstate(invalid="ignore", over="ignore"):
            observations, rewards, lost = self._judged(after, action, target)
        return after.T, self._with_inner(observations.T, after.T), rewards, lost

    def _judged(self, after: Array, action: Array, target: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Observations (12, n), rewards and whether the limits were left (n,) of states (n_states, n)."""
        errors = _errors(after, target, self._angles)
        away = target[:3] - after[:3]
        level, height = np.hypot(away[0], away[1]), np.abs(away[2])
        speed, lean = np.sqrt(np.sum(errors[3:6] ** 2, axis=0)), np.hypot(errors[6], errors[7])
        far = np.stack([level, height, speed, lean, errors[8]]) / np.array(self.task.scales)[:, None]
        leaning = np.maximum(np.abs(after[6]), np.abs(after[7]))
        edges = np.array([self.task.level_limit, self.task.height_limit, self.task.lean_limit])
        inside = np.all(np.isfinite(after), axis=0)
        inside &= np.all(np.stack([level, height, leaning]) < edges[:, None], axis=0)
        reward = np.exp(-np.sum(far**2, axis=0)) - EFFORT * np.mean(action**2, axis=0)
        return _clipped(errors), np.where(inside, reward, CRASH), ~inside

    @property
    def _angles(self) -> Array:
        return np.array([self.trim.states()["phi"], self.trim.states()["theta"]])


class FlyingOptions(TypedDict, total=False):
    """How both environments fly; `flying` has the defaults.

    Attributes:
        rate: actions per second [Hz]; 50.
        substeps: Runge-Kutta steps between actions; None for 5, or as many as skids on the ground need.
        authority: share of an input's whole range that an action of 1 adds to its trim; 0.2.
        spread: scale of `SPREAD`, 1; 0 starts every episode at the trim.
        randomize: relative standard deviation by parameter name, drawn anew for each episode, cut at three.
        wind: north, east and down [m/s].
        inner: observe the states of rotors, bar and inflow too.
        ground: there is ground at z = 0 (`standing`), and episodes start on it with the rotors stopped and the heading
            spread; the task's place is `ABOVE` it. A throttle that a trim holds is then an action like the others.
    """

    rate: float
    substeps: int | None
    authority: float
    spread: float
    randomize: Mapping[str, float] | None
    wind: tuple[float, float, float]
    inner: bool
    ground: bool


def flying(
    vehicle: Vehicle | str,
    task: Task,
    *,
    rate: float = 50.0,
    substeps: int | None = None,
    authority: float = 0.2,
    spread: float = 1.0,
    randomize: Mapping[str, float] | None = None,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inner: bool = False,
    ground: bool = False,
) -> Flying:
    """A vehicle with a task, ready to step.

    Args:
        vehicle: a vehicle, its name or a card's or model's file.
        task: see `tasks`.
        rate, substeps, authority, spread, randomize, wind, inner, ground: see `FlyingOptions`.

    Raises:
        SwashError: for numbers that make no sense, a parameter that the vehicle does not have, or one without ground.
        TrimError: where there is no hover.
    """
    chosen = find_vehicle(vehicle) if isinstance(vehicle, str) else vehicle
    if ground:
        chosen = standing(chosen)
    if substeps is None:
        substeps = max(1, math.ceil(1.0 / (rate * LONGEST_STEP) - 1e-9)) if ground and rate > 0.0 else 5
    if not (rate > 0.0 and substeps >= 1 and 0.0 < authority <= 1.0 and spread >= 0.0):
        raise SwashError(
            f"rate is {rate:g}, substeps {substeps}, authority {authority:g} and spread {spread:g}; expected positive "
            "numbers, authority at most 1."
        )
    surroundings = environment_of(chosen, Environment(*wind))
    for name in randomize or {}:
        if name not in chosen.parameter_names:
            raise SwashError("is no parameter of the vehicle.", where=chosen.name, channel=f"randomize {name}")
    held = {} if ground else dict(chosen.trim_held)  # who spools up has the throttle
    free = tuple(i for i, name in enumerate(chosen.input_names) if name not in held)
    steps = round(task.duration * rate)
    low, high = np.array(chosen.input_limits).T
    hover = trim(chosen, height=ABOVE if ground else None, environment=surroundings)
    table = task.targets(np.arange(steps + 1) / rate)
    table[:, :3] += hover.state[:3]
    return Flying(
        chosen,
        task,
        hover,
        free,
        authority * (high - low)[list(free)],
        1.0 / rate,
        substeps,
        steps,
        table,
        parameter_row(chosen, surroundings),
        {chosen.parameter_names.index(name): float(sigma) for name, sigma in (randomize or {}).items()},
        spread,
        inner,
        at_rest(chosen, surroundings) if ground else None,
    )


def _wrapped(angle: Array) -> Array:
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def _errors(x: Array, target: Array, angles: Array) -> Array:
    """`OBSERVED`, not clipped, of states (n_states, n) and targets (9, n): shape (12, n)."""
    attitude = Euler(x[6], x[7], x[8])
    place = local_to_body(Vector(*(target[:3] - x[:3])), attitude, ArrayBackend())
    wanted = local_to_body(Vector(*target[3:6]), attitude, ArrayBackend())
    turned = (angles[0] + target[7] - x[6], angles[1] + target[8] - x[7], _wrapped(target[6] - x[8]))
    speed = (wanted.x - x[3], wanted.y - x[4], wanted.z - x[5])
    return np.stack([*place, *speed, *turned, x[9], x[10], x[11]])


def _clipped(errors: Array) -> Array:
    return np.clip(np.nan_to_num(errors), -LIMITS[:, None], LIMITS[:, None])
