"""One vehicle stepped from outside, a call a step: for programs that wait for every answer.

Attitude is carried as a quaternion (`tumbling`): what an autopilot or a hand does may end upside down.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row
from swashplate.engine.trace import unrolled_rates
from swashplate.engine.tumbling import TumblingBody, counted_on, from_euler, tumbling, with_euler_angles
from swashplate.engine.virtual import rk4_graph
from swashplate.errors import DivergenceError
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, FloatBackend, Scalar
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector, body_to_local
from swashplate.physics.rigid_body import RigidBody, gravity

LONGEST_STEP = 5e-4
"""s, of one Runge-Kutta step: skids on the ground are the stiffest part (friction of a light body: 1/1400 s)."""

_FLOATS = FloatBackend()
_SPEEDS = slice(RigidBody._fields.index("u"), RigidBody._fields.index("w") + 1)
_COUNTED = (RigidBody._fields.index("phi"), RigidBody._fields.index("psi"))
"""Angles that do not jump where a turn is full."""


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
    states: list[float]


class SteppingEngine(Protocol):
    """What moves a state row of `tumbling`: by a virtual machine here, or C (`export.stepping_c`)."""

    def place(self, row: Array) -> None:
        """Put the vehicle into a state row of `tumbling`, shape (n_states + 1,)."""

    def advance(self, inputs: Sequence[float], around: Array, step: float, steps: int) -> list[float]:
        """Take Runge-Kutta steps of `step` [s] under held inputs and surroundings (`SURROUNDINGS`).

        Returns:
            What `motion_row` tells of where they lead.
        """


class NativeFrame(NamedTuple):
    """What moves a vehicle, for C that calls it.

    Attributes:
        function: address of `frame_code`'s function.
        rows: of doubles that it is given: states, inputs, surroundings, parameters, gravity; and what it tells.
    """

    function: int
    rows: tuple[Array, Array, Array, Array, Array, Array]


MakeEngine = Callable[[Vehicle, Environment], SteppingEngine]
"""From a vehicle of `tumbling` and its constant air to what moves it."""


class Stepping:
    """A vehicle and where it is.

    Args:
        vehicle: what moves; from `standing` where it may touch the ground.
        state: its state row at the start.
        environment: air and gravity, and wind and voltage at the start.
        engine: makes what moves it; None for the virtual machine.
    """

    def __init__(
        self, vehicle: Vehicle, state: Array, environment: Environment, *, engine: MakeEngine | None = None
    ) -> None:
        self.vehicle = vehicle
        around = environment_of(vehicle, environment)
        self._engine: SteppingEngine = (engine or VirtualEngine)(tumbling(vehicle), around)
        self._n = len(vehicle.state_names)
        self._around = np.array([getattr(around, name) for name in SURROUNDINGS])
        self._limits = [(float(low), float(high)) for low, high in vehicle.input_limits]
        self.place(state)

    @property
    def native(self) -> NativeFrame | None:
        """What moves it, for C that calls it; None where it is no C."""
        return getattr(self._engine, "native", None)

    @property
    def surroundings(self) -> Array:
        """Wind and voltage now, in the order of `SURROUNDINGS`."""
        return self._around.copy()

    def place(self, state: Array) -> None:
        """Put the vehicle into a state."""
        row = np.array(state, dtype=np.float64)
        self._last = row.tolist()
        self._engine.place(from_euler(row))

    def surround(self, **values: float) -> None:
        """Change wind or voltage, by name."""
        for name, value in values.items():
            self._around[SURROUNDINGS.index(name)] = value

    def advance(self, inputs: Sequence[float] | Array, duration: float) -> Motion:
        """Hold inputs (cut to their limits) for `duration` [s] and tell where that leads.

        Raises:
            DivergenceError: where a state is no longer finite; the vehicle stays where it last was.
        """
        steps = steps_of(duration)
        held = [low if v < low else min(v, high) for v, (low, high) in zip(inputs, self._limits, strict=True)]
        return self.motion(self._engine.advance(held, self._around, duration / steps, steps))

    def motion(self, row: list[float]) -> Motion:
        """The motion that an engine told.

        Raises:
            DivergenceError: as `advance`.
        """
        n = self._n
        if not math.isfinite(sum(row)) and (wild := [k for k, v in enumerate(row) if not math.isfinite(v)]):
            self.place(np.array(self._last))
            name = self.vehicle.state_names[wild[0] if wild[0] < n else _SPEEDS.start + (wild[0] - n) % 3]
            raise DivergenceError("left the finite numbers.", time=float("nan"), state=name)
        for angle in _COUNTED:
            row[angle] = counted_on(row[angle], self._last[angle])
        self._last = row[:n]
        body, velocity, force = row[: len(RigidBody._fields)], row[n : n + 3], row[n + 3 :]
        return Motion(RigidBody._make(body), Vector._make(velocity), Vector._make(force), self._last)


def steps_of(duration: float) -> int:
    """Runge-Kutta steps in so long [s]."""
    return max(1, math.ceil(duration / LONGEST_STEP - 1e-9))


class VirtualEngine:
    """Steps by CasADi's virtual machine: where there is no compiler."""

    def __init__(self, vehicle: Vehicle, environment: Environment) -> None:
        equations = equations_of(vehicle)
        self._step, self._rates = rk4_graph(equations), unrolled_rates(equations)
        self._parameters = parameter_row(vehicle, environment)
        self._gravity = float(environment.gravity)

    def place(self, row: Array) -> None:
        self._state = row

    def advance(self, inputs: Sequence[float], around: Array, step: float, steps: int) -> list[float]:
        w = np.concatenate([inputs, around])
        for _ in range(steps):
            self._state = self._step(self._state, w, w, w, self._parameters, step)
        rates = self._rates(self._state, w, self._parameters)
        states, changes = (np.asarray(column, dtype=np.float64).ravel().tolist() for column in (self._state, rates))
        return motion_row(states, changes, self._gravity, _FLOATS)


def motion_row(states: Sequence[Scalar], rates: Sequence[Scalar], g: Scalar, xp: Backend) -> list[Scalar]:
    """What sensors need, from a state row of `tumbling` and its rates, as one row.

    The specific force is the acceleration less gravity, seen from turning axes (Stevens, Lewis and Johnson 2016, eq.
    1.7-15): one evaluation of the equations then tells everything.

    Returns:
        The vehicle's own state row with roll and yaw [rad] within half a turn, velocity north-east-down [m/s], and
        specific force in body axes [m/s^2], 6 + n_states numbers.
    """
    body = with_euler_angles(TumblingBody._make(states[: len(TumblingBody._fields)]), xp)
    change, pull = Vector._make(rates[_SPEEDS]), gravity(1.0, g, body.attitude, xp)
    force = change + body.rates.cross(body.velocity) + pull.scaled(-1.0)
    rest = states[len(TumblingBody._fields) :]
    return [*body, *rest, *body_to_local(body.velocity, body.attitude, xp), *force]


def at_standstill(states: Array | Sequence[float], g: float) -> Motion:
    """The motion of a body that does not move, under gravity g [m/s^2]: its state row and what it weighs."""
    row = list(map(float, states))
    body = RigidBody._make(row[: len(RigidBody._fields)])
    weight = gravity(1.0, g, body.attitude, _FLOATS).scaled(-1.0)
    return Motion(body, Vector(0.0, 0.0, 0.0), weight, row)
