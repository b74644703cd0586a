"""Equilibria: the attitude, inputs and inner states with which a vehicle flies steadily."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row
from swashplate.errors import TrimError
from swashplate.models.doubts import doubts, nominal_voltage
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.environment import Environment
from swashplate.physics.ground_contact import Grip
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.steady import ACCELERATIONS, ANGULAR_ACCELERATIONS, BODY, assemble, unrest_at

_XP = ArrayBackend()


class Residual(Protocol):
    """What is left of the rates of change at the unknowns `z`, and its slope, at a share of the course."""

    def __call__(self, z: Array, *, share: float = 1.0) -> tuple[Array, Array]: ...


_STEPS = 60
_MOVING = np.array([True, True, True, False, True, False])
"""What of a course is motion: velocities and the rate of turn."""
_ROUNDING = 1e-13
"""Attitudes, inputs and inner states below it are what rounding leaves of zero, and differ between processors."""

_TOLERANCE = 1e-10
"""m/s^2 and rad/s^2 (and inner rates): far below any sensor, far above rounding."""
_AT_REST = 1e-3 * _TOLERANCE
"""Where the search ends, if rounding lets it."""
_NEAR_REST = 1e4 * _TOLERANCE
"""Inner rates from where all unknowns are searched for together."""


@dataclass(frozen=True)
class Trim:
    """A steady flight.

    Attributes:
        state, inputs: rows in the order of the names.
        state_names, input_names: their names.
        environment: wind, air, gravity and voltage that it holds for.
        speed, lateral, climb: velocity ahead, to the right (both level, in the direction of heading) and up [m/s].
        residual: the largest rate of change left [SI units].
        turn: rate of turn to the right [rad/s].
        battery: whether the voltage is in the equations.
    """

    state: Array
    inputs: Array
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    environment: Environment
    speed: float
    lateral: float
    climb: float
    residual: float
    turn: float = 0.0
    battery: bool = False

    def states(self) -> dict[str, float]:
        """The states by name."""
        return dict(zip(self.state_names, self.state.tolist(), strict=True))

    def commands(self) -> dict[str, float]:
        """The inputs by name."""
        return dict(zip(self.input_names, self.inputs.tolist(), strict=True))

    def __repr__(self) -> str:
        head = f"Trim at {self.speed:g} m/s ahead, {self.lateral:g} m/s right, {self.climb:g} m/s up, "
        head += f"turning {np.degrees(self.turn):g} deg/s, " if self.turn else ""
        head += f"in air of {float(self.environment.air_density):.4g} kg/m^3"
        if self.battery:
            head += f", {float(self.environment.voltage):g} V"
        head += f" (residual {self.residual:.1e})"
        lines = [
            f"  {name:<14}{round(value, 5) + 0.0: .5f}" for name, value in {**self.commands(), **self.states()}.items()
        ]
        return "\n".join([head, *lines])


def need_whole_body(vehicle: Vehicle) -> None:
    """Refuse a vehicle that is not enough to fly.

    Raises:
        TrimError: saying what it lacks.
    """
    if vehicle.traits.no_trim:
        hint = "It can be fitted, simulated and exported; a trim needs the motion of a whole body."
        raise TrimError(f"{vehicle.traits.no_trim}.", where=vehicle.card.where, hint=hint)


def trim(
    vehicle: Vehicle,
    *,
    speed: float = 0.0,
    lateral: float = 0.0,
    climb: float = 0.0,
    turn: float = 0.0,
    heading: float = 0.0,
    height: float | None = None,
    voltage: float | None = None,
    environment: Environment | None = None,
    near: Trim | None = None,
) -> Trim:
    """The steady flight of a vehicle at a given ground velocity, by Newton's method with exact derivatives.

    Attitude, inputs and inner states (disc tilt, bar, rotor speeds) are solved for so that every rate but that of
    the position vanishes.

    Args:
        vehicle: whose state begins with a `RigidBody`.
        speed, lateral, climb: velocity ahead and to the right in the level plane of the heading, and up [m/s].
        turn: rate of turn to the right [rad/s]; the velocity turns with the heading.
        heading: psi [rad].
        height: above the local origin [m]; it matters only to a vehicle that can touch the ground, which by default is
            well above it (10 m), any other at 0.
        voltage: battery voltage [V], instead of the environment's.
        environment: surroundings; wind enters as it should (a trim in wind is not a trim in calm air).
        near: a trim of the same vehicle to start from, e.g. at the speed before on a trim curve.

    Raises:
        TrimError: naming the input whose limit prevents it, or the state that does not come to rest.
    """
    surroundings = environment_of(vehicle, environment)
    if voltage is not None:
        surroundings = surroundings._replace(voltage=voltage)
    need_whole_body(vehicle)
    if vehicle.state_names[:BODY] != RigidBody._fields:
        raise TrimError(f"'{vehicle.name}' has no rigid body to bring into equilibrium.")
    equations = equations_of(vehicle)
    if height is None:
        touches = vehicle.card.options.get("ground") or set(Grip._fields) <= set(vehicle.state_names)
        height = _CLEAR if touches else 0.0
    if turn and (surroundings.wind_north or surroundings.wind_east):
        raise TrimError(
            "a turn in wind is no steady flight.",
            where=vehicle.card.where,
            hint="Ask for the turn in calm air, or no turn.",
        )
    course = np.array([speed, lateral, -climb, heading, turn, -height])
    row = np.array([getattr(surroundings, name) for name in SURROUNDINGS], dtype=np.float64)
    p = parameter_row(vehicle, surroundings)
    asked = {"speed": speed, "lateral": lateral, "climb": climb, "turn": turn, "heading": heading, "height": height}
    around = dict(zip(SURROUNDINGS, row.tolist(), strict=True))
    strange = [name for name, value in (asked | around).items() if not np.isfinite(value)]
    if strange:
        raise TrimError("is not a finite number.", where=vehicle.card.where, channel=", ".join(strange))
    nominal = nominal_voltage(vehicle)
    if nominal is not None and around["voltage"] <= 0.0:
        raise TrimError(
            f"is {around['voltage']:g} V: no motor turns on that.",
            where=vehicle.card.where,
            channel="voltage",
            hint=f"Give the battery's voltage; the card's is {nominal:g} V.",
        )

    last, answer = np.empty(0), (np.empty(0), np.empty(0))

    def residual(z: Array, *, share: float = 1.0) -> tuple[Array, Array]:
        nonlocal last, answer
        now = np.array([*z, share])
        if not np.array_equal(now, last):  # one search begins where another has ended
            answer, last = unrest_at(equations, z, course * np.where(_MOVING, share, 1.0), row, p), now
        return answer

    z = _first_guess(vehicle, residual) if near is None else _unknowns(vehicle, near)
    z, value = _newton(z, residual)
    share = 1.0
    if not _at_rest(value) and near is None:
        z, value, share = _on_the_way(vehicle, residual)
    z = np.where(np.abs(z) < _ROUNDING, 0.0, z)
    state, inputs = assemble(equations, z, course, _XP)
    largest = float(np.max(np.abs(value))) if np.all(np.isfinite(value)) else np.inf
    where = f"{speed:g} m/s ahead, {lateral:g} m/s right, {climb:g} m/s up"
    if nominal is not None:
        where += f" at {float(surroundings.voltage):g} V"
    if turn:
        where += f", turning {np.degrees(turn):g} deg/s"
    if share < 1.0 and largest < _TOLERANCE:
        _check_limits(vehicle, inputs, f"{where} is out of reach: {share:.0%} of the way there")
    if share < 1.0 or not largest < _TOLERANCE:
        _, value = _newton(z, residual)
        largest = float(np.max(np.nan_to_num(np.abs(value), nan=np.inf)))
        worst = _residual_names(vehicle)[int(np.argmax(np.nan_to_num(np.abs(value), nan=np.inf)))]
        raise TrimError(
            f"no equilibrium was found for {where}: {worst} keeps changing at {largest:.2g} per second.",
            where=vehicle.card.where,
            channel=worst,
            hint=_near_there(vehicle, state, inputs, surroundings) + "Ask for a slower flight, or check the card.",
        )
    _check_limits(vehicle, inputs, where)
    names, battery = (vehicle.state_names, vehicle.input_names), "voltage_nominal" in vehicle.card.parameters
    return Trim(state, inputs, *names, surroundings, speed, lateral, climb, largest, turn, battery)


def _near_there(vehicle: Vehicle, state: Array, inputs: Array, surroundings: Environment) -> str:
    """What of the equations does not hold where the search for a trim ended: stalled blades carry no more."""
    if not np.all(np.isfinite([*state, *inputs])):
        return ""
    return "".join(f"Near there {doubt}. " for doubt in doubts(vehicle, state, inputs, surroundings))


_CLEAR = 10.0
"""m: a height at which no skid touches."""


def _residual_names(vehicle: Vehicle) -> tuple[str, ...]:
    names = vehicle.state_names
    return (*names[ACCELERATIONS], *names[ANGULAR_ACCELERATIONS], *names[BODY:])


def _first_guess(vehicle: Vehicle, residual: Residual) -> Array:
    """Level, inputs in the middle of their ranges, and the inner states where these inputs hold them."""
    held = dict(vehicle.trim_held)
    limits = zip(vehicle.input_names, vehicle.input_limits, strict=True)
    middle = [0.5 * (low + high) for name, (low, high) in limits if name not in held]
    inside = list(leaves(vehicle.state))[BODY:]
    inner = len(inside)
    z = np.array([0.0, 0.0, *middle, *inside])
    for _ in range(5):
        value, slope = residual(z)
        if np.max(np.abs(value[6:]), initial=0.0) < _NEAR_REST:
            break
        z[z.size - inner :] -= np.linalg.lstsq(slope[6:, z.size - inner :], value[6:], rcond=None)[0]
    return z


def _unknowns(vehicle: Vehicle, known: Trim) -> Array:
    """The unknowns of `assemble` at a known trim."""
    held = dict(vehicle.trim_held)
    inputs = [value for name, value in known.commands().items() if name not in held]
    attitude = [known.states()["phi"], known.states()["theta"]]
    return np.array([*attitude, *inputs, *known.state[BODY:]])


def _newton(z: Array, residual: Residual) -> tuple[Array, Array]:
    """Newton's method; a step is halved until the residual shrinks."""
    value, slope = residual(z)
    for _ in range(_STEPS):
        if not np.all(np.isfinite(slope)) or np.max(np.abs(value)) < _AT_REST:
            break
        step = -np.linalg.lstsq(slope, value, rcond=None)[0]
        for fraction in 0.5 ** np.arange(12):
            tried, tried_slope = residual(z + fraction * step)
            if np.linalg.norm(tried) < np.linalg.norm(value):
                break
        else:
            break
        z, value, slope = z + fraction * step, tried, tried_slope
    return z, value


def _at_rest(value: Array) -> bool:
    return bool(np.all(np.isfinite(value)) and np.max(np.abs(value)) < _TOLERANCE)


def _on_the_way(vehicle: Vehicle, residual: Residual) -> tuple[Array, Array, float]:
    """The last equilibrium on the way from no motion to the wanted one, found in steps, and its share of the way."""
    z, value = _newton(_first_guess(vehicle, partial(residual, share=0.0)), partial(residual, share=0.0))
    share, step = 0.0, 0.25
    while _at_rest(value) and share < 1.0 and step > _SHORTEST:
        tried, left = _newton(z, partial(residual, share=share + step))
        if _at_rest(left):
            z, value, share = tried, left, min(1.0, share + step)
        else:
            step *= 0.5
    return z, value, share


_SHORTEST = 0.01
"""Share of the way to a course below which steps are no longer halved."""


def _check_limits(vehicle: Vehicle, inputs: Array, where: str) -> None:
    battery = "voltage_nominal" in vehicle.parameter_names
    kinds = zip(vehicle.input_names, vehicle.input_units, inputs, vehicle.input_limits, strict=True)
    for name, unit, value, (low, high) in kinds:
        if not low <= value <= high:
            limit = high if value > high else low
            exceeded = [
                f"{np.degrees(v):.1f} deg" if unit == "rad" else f"{v:.3g} {unit}".removesuffix(" 1")
                for v in (value, limit)
            ]
            raise TrimError(
                f"{where} needs {name} = {exceeded[0]}, but its limit is {exceeded[1]}.",
                where=vehicle.card.where,
                channel=name,
                hint=_hint(battery=battery, too_low=value < low),
            )


def _hint(*, battery: bool, too_low: bool) -> str:
    if battery:
        return "Ask for a slower flight, less payload or a fuller battery."
    return "Ask for a slower flight." if too_low else "Ask for a slower flight or less weight."


def surroundings_of_start(
    vehicle: Vehicle, start: Trim | Mapping[str, Any] | None, environment: Environment | None
) -> Environment:
    """What a simulation flies in: the environment given, else that of the trim it starts from, else the vehicle's."""
    if environment is None and isinstance(start, Trim):
        environment = start.environment
    return environment_of(vehicle, environment)


def start_row(vehicle: Vehicle, start: Trim | Mapping[str, float] | None, environment: Environment) -> Array:
    """The state row that a simulation starts from: a trim's, or hover (or rest) with some states replaced.

    Raises:
        TrimError: where a named state is not one of the vehicle's.
    """
    if isinstance(start, Trim):
        if start.state_names != vehicle.state_names:
            raise TrimError("the start is a trim of another vehicle.", where=vehicle.card.where)
        return np.array(start.state)
    named = dict(start or {})
    for name in named:
        if name not in vehicle.state_names:
            raise TrimError(
                f"is not a state; expected {', '.join(vehicle.state_names)}.", where=vehicle.card.where, channel=name
            )
    if set(named) == set(vehicle.state_names):
        return np.array([named[name] for name in vehicle.state_names], dtype=np.float64)
    rest = vehicle.traits.rest
    if rest is not None:
        resting = rest(vehicle.card)
        row = np.array([resting[name] for name in vehicle.state_names], dtype=np.float64)
    else:
        row = np.array(trim(vehicle, environment=environment).state)
    for name, value in named.items():
        row[vehicle.index(name)] = value
    return row
