"""Where a filter begins, its constant gain, and how both move with its numbers: by NumPy, from slopes of the equations.

The gain takes slopes of the equations, its own slopes take second ones, which are wanted at one place only. So the
first slopes are taken a little to either side, and Riccati's equation gives what follows from them for all directions
at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import CONSTANTS
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, FilterState, StochasticModel
from swashplate.filtering.filter_library import filter_code
from swashplate.filtering.following import measured_slopes
from swashplate.filtering.nuisance import DELAYS, PUSHES, Nuisance
from swashplate.filtering.riccati import steady_gain, steady_gain_moved
from swashplate.identification.core.records import Record
from swashplate.identification.time.start_states import (
    INNER_STEPS,
    NUDGE,
    STEPS,
    STRIDE,
    mean_velocity,
    measured_start,
    slopes,
)
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.steady import assemble, unrest_at

_XP = ArrayBackend()
_BODY = len(RigidBody._fields)

_ASIDE = 2e-3
"""How far to either side of a row slopes are taken, in scaled units, by four points: exact to 1e-10."""

_PUSHES = np.array([Nuisance._fields.index(name) for name in PUSHES])

_OF_COMMANDS = [Nuisance._fields.index(name) for name in DELAYS]

_OF_PLACES = np.array([Noise._fields.index(name) for name in ("speed", "wind", "tau_wind")])

_POINTS = (1.0, -1.0, 2.0, -2.0)
_WEIGHTS = (8.0 / 12.0, -8.0 / 12.0, -1.0 / 12.0, 1.0 / 12.0)
"""The four points of a slope and their weights (Abramowitz and Stegun 1972, 25.3.6)."""

_SETTLED = 1e-14
"""A Newton step that no longer counts."""


class FilterNumbers(NamedTuple):
    """What a filter's run depends on, as rows; or directions in which they move, with one more axis in front.

    Attributes:
        parameters: of the equations.
        noise, nuisance: in the order of `Noise` and of `Nuisance`.
        inputs: mean of the commands that reach the vehicle while it starts.
    """

    parameters: Array
    noise: Array
    nuisance: Array
    inputs: Array


class FirstMotion(NamedTuple):
    """What a record shows of its beginning.

    Attributes:
        value, rate: of every measured channel at the first sample.
        velocity: mean ahead, right and down [m/s] that the gain is for (`start_states.mean_velocity`).
        voltage: of the battery at the first sample, and its mean [V].
        running: seconds since the flight's time zero, where motors begin.
    """

    value: Array
    rate: Array
    velocity: Array
    voltage: Array
    running: float = 0.0


class Begun(NamedTuple):
    """The constant gain of a run, and the state that it begins with."""

    gain: FilterGain
    x: Array


def seen_at_start(vehicle: Vehicle, record: Record) -> FirstMotion:
    """What a record shows of its beginning."""
    value, rate = slopes(record, np.array([0]))
    voltage = np.array([record.voltage[0], np.mean(record.voltage)])
    return FirstMotion(value[0], rate[0], mean_velocity(vehicle, record), voltage, float(record.time[0]))


def starting_samples(dt: float) -> int:
    """How many of a record's first samples the commands are averaged over, for the state that it begins with."""
    return max(1, round(0.5 / dt))


def begun(
    model: StochasticModel,
    numbers: FilterNumbers,
    first: FirstMotion,
    known: tuple[FilterNumbers, FilterGain] | None = None,
) -> Begun:
    """The gain and the start of a run; a known gain of other numbers serves where only commands tell them apart."""
    rows = FilterNumbers(*(np.asarray(row)[None] for row in numbers))
    start = starting_rows(model, rows, first)[0]
    if known is not None and all(map(np.array_equal, _of_gain(known[0]), _of_gain(numbers))):
        return Begun(known[1], start)
    K, S, _ = steady_gain(*(part[0] for part in joined_at(model, rows, first)))
    return Begun(model.gain_of(K, S), start)


def _of_gain(numbers: FilterNumbers) -> tuple[Array, Array, Array]:
    """The numbers without those that only move commands."""
    return numbers.parameters, numbers.noise, np.delete(numbers.nuisance, _OF_COMMANDS)


def first_state(model: StochasticModel, x: Array, nuisance: Array) -> FilterState:
    """State rows (..., states) with nothing known of the air yet, and drifts where the records' numbers have them."""
    return FilterState(x, np.zeros((*x.shape[:-1], model.n_gusts)), nuisance[..., _PUSHES])


def begun_moved(model: StochasticModel, numbers: FilterNumbers, first: FirstMotion, directions: FilterNumbers) -> Begun:
    """Slopes of `begun` along directions, which come first."""
    rows = _aside(numbers, directions)
    matrices = joined_at(model, rows, first)
    here = A, C, Q, R = tuple(part[0] for part in matrices)
    P = steady_gain(A, C, Q, R)[2]
    dK, dS = steady_gain_moved(here, P, tuple(map(_slope_aside, matrices)))  # pyrefly: ignore[bad-argument-type]
    return Begun(model.gain_of(dK, dS), _slope_aside(starting_rows(model, rows, first)))


def starting_row(model: StochasticModel, numbers: FilterNumbers, first: FirstMotion) -> Array:
    """The state that a run begins with; noise and mean velocity do not count."""
    return np.asarray(starting_rows(model, FilterNumbers(*(np.asarray(row)[None] for row in numbers)), first)[0])


def starting_row_moved(
    model: StochasticModel, numbers: FilterNumbers, first: FirstMotion, directions: FilterNumbers
) -> Array:
    """Slopes of `starting_row` along directions, which come first."""
    return _slope_aside(starting_rows(model, _aside(numbers, directions), first))


def _aside(numbers: FilterNumbers, directions: FilterNumbers) -> FilterNumbers:
    """Rows of numbers: themselves, then all directions at each of the points around them."""
    return FilterNumbers(
        *(
            np.concatenate([np.asarray(at)[None], *(at + _ASIDE * point * to for point in _POINTS)])
            for at, to in zip(numbers, directions, strict=True)
        )
    )


def _slope_aside(rows: Array) -> Array:
    """Slopes by direction of what the rows of `_aside` lead to."""
    around = rows[1:].reshape(len(_POINTS), -1, *rows.shape[1:])
    return np.asarray(np.tensordot(_WEIGHTS, around, 1) / _ASIDE)


def joined_at(model: StochasticModel, rows: FilterNumbers, first: FirstMotion) -> tuple[Array, Array, Array, Array]:
    """A, C, Q and R of the joined system in steady flight, one of each for every row of numbers."""
    noise, nuisance = Noise(*rows.noise.T), Nuisance(*rows.nuisance.T)
    mean = first.voltage[1]
    windy = rows.noise[:, _OF_PLACES] if model.windy else rows.noise[:, :0]  # of the noise what `model.places` asks for
    decisive = np.concatenate([rows.parameters, windy], axis=1)
    apart = np.flatnonzero(np.any(decisive != decisive[0], axis=1))
    which = np.zeros(len(decisive), dtype=np.intp)
    which[apart], apart = 1 + np.arange(apart.size), np.concatenate([[0], apart])
    x, u = steady_rows(model, rows.parameters[apart], mean, first.velocity)
    places = model.places(x, Noise(*rows.noise[apart].T))
    taken = [_slopes(model, place, u, rows.parameters[apart], mean) for place in places]
    by_x, by_gust = (np.mean(parts, axis=0)[which] for parts in zip(*taken, strict=True))
    return model.joined(by_x, by_gust, measured_slopes(model, x[which], nuisance), noise)


def numbers_and_constants(vehicle: Vehicle, parameters: Array) -> Array:
    """Parameters (..., parameters) and constant surroundings behind them, as the equations take them."""
    around = environment_of(vehicle, parameters=vehicle.parameters(*np.moveaxis(parameters, -1, 0)))
    constants = [np.broadcast_to(getattr(around, name), parameters.shape[:-1]) for name in CONSTANTS]
    return np.concatenate([parameters, np.stack(constants, axis=-1)], axis=-1)


def numbers_moved(vehicle: Vehicle, parameters: Array) -> Array:
    """Directions of `numbers_and_constants` (count, numbers), from those of the parameters (count, parameters)."""
    places = [vehicle.parameter_names.index(a) if a in vehicle.parameter_names else None for a in CONSTANTS]
    around = [np.zeros(len(parameters)) if place is None else parameters[:, place] for place in places]
    return np.column_stack([parameters, *around])


def _driving(inputs: Array, voltage: float) -> Array:
    """Inputs in calm air."""
    return np.array([*inputs, 0.0, 0.0, 0.0, voltage])


def _slopes(model: StochasticModel, x: Array, inputs: Array, parameters: Array, voltage: float) -> tuple[Array, Array]:
    """Slopes of the rates by states and disturbances, by row."""
    vehicle = model.vehicle
    driving = np.column_stack([inputs, np.zeros((len(x), 3)), np.full(len(x), voltage)])
    rows = x, driving, numbers_and_constants(vehicle, parameters)
    _, by_x, by_driving = filter_code(model).rates_and_slopes(*rows)
    pushes = np.broadcast_to(np.eye(len(vehicle.state_names))[:, model.disturbed], (*by_x.shape[:2], N_DISTURBANCES))
    wind = len(vehicle.input_names) + np.arange(model.n_gusts - N_DISTURBANCES)
    return by_x, np.concatenate([pushes, by_driving[:, :, wind]], axis=2)


def steady_rows(model: StochasticModel, parameters: Array, voltage: float, velocity: Array) -> tuple[Array, Array]:
    """States and inputs of steady flight by row: in closed form, or by Newton's method at the first row.

    The other rows lie beside the first: one step from there with its slope is right to first order.
    """
    vehicle = model.vehicle
    if vehicle.traits.hover is not None:
        states, inputs = vehicle.traits.hover(vehicle.parameters(*parameters.T), voltage, _XP)
        row = [np.broadcast_to(states.get(name, 0.0), len(parameters)) for name in vehicle.state_names]
        return np.stack(row, axis=1), np.stack([np.broadcast_to(value, len(parameters)) for value in inputs], axis=1)
    held, course = dict(vehicle.trim_held), np.array([*velocity, 0.0, 0.0, 0.0])
    limits = zip(vehicle.input_names, vehicle.input_limits, strict=True)
    middle = [0.5 * (low + high) for name, (low, high) in limits if name not in held]
    z = np.array([0.0, 0.0, *middle, *list(leaves(vehicle.state))[_BODY:]])
    calm = np.array([0.0, 0.0, 0.0, voltage])

    slopes = filter_code(model).rates_and_slopes

    def unrest(row: Array) -> tuple[Array, Array]:
        return unrest_at(model.equations, z, course, calm, numbers_and_constants(vehicle, row), slopes)

    slope = np.eye(z.size)
    for _ in range(STEPS):
        value, slope = unrest(parameters[0])
        step = _solved(slope, value)
        most = float(np.max(np.abs(step[: 2 + len(middle)])))
        z = z - step * min(1.0, STRIDE / max(most, 1e-300))
        if not np.max(np.abs(step)) > _SETTLED * np.max(np.abs(z)):
            break
    each = [z - _solved(slope, unrest(row)[0]) for row in parameters]
    rows = [assemble(model.equations, one, course, _XP) for one in each]
    return np.array([state for state, _ in rows]), np.array([inputs for _, inputs in rows])


def starting_rows(model: StochasticModel, rows: FilterNumbers, motion: FirstMotion) -> Array:
    """The states that runs begin with, by row; the inner ones of the rows beside the first as in `steady_rows`."""
    vehicle, first = model.vehicle, motion.voltage[0]
    starts = measured_start(
        vehicle,
        model.output_names,
        vehicle.parameters(*rows.parameters.T),
        Nuisance(*rows.nuisance.T),
        value=motion.value,
        rate=motion.rate,
        inputs=rows.inputs,
        voltage=first,
        running=motion.running,
        xp=_XP,
    )
    starts = np.array(np.broadcast_to(starts, (len(rows.parameters), starts.shape[-1])))
    if vehicle.traits.settled is not None:
        return starts

    taken = filter_code(model).rates_and_slopes

    def unrest(row: int, inner: Array) -> tuple[Array, Array]:
        state = np.concatenate([starts[row, :_BODY], inner])
        p = numbers_and_constants(vehicle, rows.parameters[row])
        rates, slope, _ = taken(state, _driving(rows.inputs[row], first), p)
        # A governor at its stop does not move: without this the slope could not be inverted.
        return np.asarray(rates)[_BODY:], np.asarray(slope)[_BODY:, _BODY:] - NUDGE * np.eye(inner.size)

    inner = np.array(list(leaves(vehicle.state))[_BODY:])
    slope = np.eye(inner.size)
    for _ in range(INNER_STEPS):
        value, slope = unrest(0, inner)
        inner = inner - _solved(slope, value)
    for row in range(len(starts)):
        starts[row, _BODY:] = inner - _solved(slope, unrest(row, inner)[0])
    return starts


def _solved(slope: Array, value: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(slope, value), dtype=np.float64)
    except np.linalg.LinAlgError:  # nothing comes to rest: the run's cost is then infinite
        return np.full_like(value, np.nan)
