"""One vehicle stepped from outside, a compiled call a step: for programs that wait for every answer.

Dispatch is what such a step costs, so all that changes goes in as one row, all that is wanted comes out as one row, and
nothing is left outside the loop: XLA hoists what does not change in it into some hundred kernels of their own, unless a
barrier holds it (measured on two cores: 170 us a step with them, 23 us without, 9 us of it the bare call).

Attitude is carried as a quaternion (`tumbling`): what an autopilot or a hand does may end upside down.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from swashplate.arrays import Array
from swashplate.errors import DivergenceError
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector, body_to_local
from swashplate.physics.rigid_body import RigidBody, gravity
from swashplate.simulation.dynamics import (
    SURROUNDINGS,
    Equations,
    enable_double_precision,
    equations_of,
    parameter_row,
    row_rates,
)
from swashplate.simulation.runge_kutta import rk4_step
from swashplate.simulation.tumbling import from_euler, to_euler, tumbling

LONGEST_STEP = 5e-4
"""s, of one Runge-Kutta step: skids on the ground are the stiffest part (friction of a light body: 1/1400 s)."""

_FLOATS = FloatBackend()
_SPEEDS = slice(RigidBody._fields.index("u"), RigidBody._fields.index("w") + 1)


class Motion(NamedTuple):
    """What sensors need to know.

    Attributes:
        body: rigid-body state.
        velocity: of the CG, north-east-down [m/s].
        force: specific force at the CG, body axes [m/s^2].
        states: the whole state row.
    """

    body: RigidBody
    velocity: Vector
    force: Vector
    states: Array


class SteppingEngine(Protocol):
    """What moves a state row of `tumbling`: compiled by XLA here, or C (`export.stepping_c`)."""

    def place(self, row: Array) -> None:
        """Put the vehicle into a state row of `tumbling`, shape (n_states + 1,)."""

    def advance(self, inputs: Array, around: Array, step: float, steps: int) -> Array:
        """Take Runge-Kutta steps of `step` [s] under held inputs and surroundings (`SURROUNDINGS`).

        Returns:
            The state row and its derivative behind it, shape (2 (n_states + 1),); not to be changed.
        """


MakeEngine = Callable[[Vehicle, Environment], SteppingEngine]
"""From a vehicle of `tumbling` and its constant air to what moves it."""


class Stepping:
    """A vehicle and where it is.

    Args:
        vehicle: what moves; from `standing` where it may touch the ground.
        state: its state row at the start.
        environment: air and gravity, and wind and voltage at the start.
        engine: makes what moves it; None for XLA.
    """

    def __init__(
        self, vehicle: Vehicle, state: Array, environment: Environment, *, engine: MakeEngine | None = None
    ) -> None:
        self.vehicle, self._moved = vehicle, tumbling(vehicle)
        around = environment_of(vehicle, environment)
        self._engine: SteppingEngine = (engine or XlaEngine)(self._moved, around)
        self._n = len(self._moved.state_names)
        self._gravity = float(around.gravity)
        self._around = np.array([getattr(around, name) for name in SURROUNDINGS])
        self._low, self._high = np.array(vehicle.input_limits).T
        self.place(state)

    @property
    def surroundings(self) -> Array:
        """Wind and voltage now, in the order of `SURROUNDINGS`."""
        return self._around.copy()

    def place(self, state: Array) -> None:
        """Put the vehicle into a state."""
        self._last = np.array(state, dtype=np.float64)
        self._engine.place(from_euler(self._last))

    def surround(self, **values: float) -> None:
        """Change wind or voltage, by name."""
        for name, value in values.items():
            self._around[SURROUNDINGS.index(name)] = value

    def advance(self, inputs: Array, duration: float) -> Motion:
        """Hold inputs (cut to their limits) for `duration` [s] and tell where that leads.

        Raises:
            DivergenceError: where a state is no longer finite; the vehicle stays where it last was.
        """
        steps = max(1, math.ceil(duration / LONGEST_STEP - 1e-9))
        held = np.minimum(np.maximum(inputs, self._low), self._high)
        values = self._engine.advance(held, self._around, duration / steps, steps)
        if not math.isfinite(values.sum()) and not np.isfinite(values).all():
            self.place(self._last)
            first = int(np.argmin(np.isfinite(values))) % self._n
            name = self._moved.state_names[first]
            raise DivergenceError("left the finite numbers.", time=float("nan"), state=name)
        self._last = to_euler(values[: self._n], self._last)
        return motion(self._last, Vector(*values[self._n :][_SPEEDS].tolist()), self._gravity)


class XlaEngine:
    """Steps compiled by XLA, a call a frame."""

    def __init__(self, moved: Vehicle, environment: Environment) -> None:
        enable_double_precision()
        self._advance = _compiled(equations_of(moved))
        self._parameters = jax.device_put(parameter_row(moved, environment))

    def place(self, row: Array) -> None:
        self._state = jax.device_put(row)

    def advance(self, inputs: Array, around: Array, step: float, steps: int) -> Array:
        row = np.concatenate([inputs, around, (step, float(steps))])
        self._state, told = self._advance(self._state, row, self._parameters)
        return np.asarray(told)


def motion(states: Array, change: Vector, g: float) -> Motion:
    """What sensors need, from a state row and the rates of u, v and w [m/s^2].

    The specific force is the acceleration less gravity, seen from turning axes (Stevens, Lewis and Johnson 2016, eq.
    1.7-15): one evaluation of the equations then tells everything.
    """
    body = RigidBody(*states[: len(RigidBody._fields)].tolist())
    pull = gravity(1.0, g, body.attitude, _FLOATS)
    force = change + body.rates.cross(body.velocity) + pull.scaled(-1.0)
    return Motion(body, body_to_local(body.velocity, body.attitude, _FLOATS), force, states)


@lru_cache(maxsize=16)
def _compiled(equations: Equations) -> Any:
    return jax.jit(partial(_advance, equations), donate_argnums=0)


def _advance(
    equations: Equations,
    x: Float[jax.Array, " states"],
    row: Float[jax.Array, " row"],
    p: Float[jax.Array, " parameters"],
) -> tuple[Any, Any]:
    """Steps of Runge-Kutta under held inputs: the state row, and it again with its derivative behind it."""
    rates = row_rates(equations, padded=True)
    w, h, steps = row[:-2], row[-2], row[-1].astype(jnp.int32)

    barrier: Any = jax.lax.optimization_barrier

    def held(x: Float[jax.Array, " states"], w: Float[jax.Array, " driving"]) -> Any:
        return rates(*barrier((x, w, p)))

    def one(i: Int[jax.Array, ""], carry: tuple[Any, Any]) -> tuple[Any, Any]:
        after = rk4_step(held, carry[0], lambda _: w, h, looped=True)
        return after, held(after, w)

    x, slope = jax.lax.fori_loop(0, steps, one, (x, jnp.zeros_like(x)))
    return x, jnp.concatenate([x, slope])
