"""The filter along one record, and how it moves with its numbers, in pieces that are compiled once for a kind.

XLA compiles for seconds whatever has another shape. So all that differs from fit to fit stays outside the compiled
pieces: which numbers are free, how many records there are and how long they run. A piece takes whole rows of numbers,
a block of directions in which they move, and a stretch of samples.

Slopes in two passes. The states that the filter went through are known; the equations' slopes at all samples are then
independent of each other, and are taken many samples at a time. The second pass is the same filter with each sample's
step replaced by its tangent plane at that state: there its slopes are those of the filter itself, and it only
multiplies matrices (measured: half the time of carrying every slope through the equations sample by sample).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, FilterState, StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.time.beginning import Begun, FilterNumbers, first_state
from swashplate.identification.time.compiled_filter import FilterRun, compiled_filter
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.simulation.compilation import FEW_PASSES, QUICK_TO_COMPILE, lengthened

STRETCH = 256
"""Samples that a compiled piece runs along."""

_DIRECTIONS = 8
"""Directions come in whole blocks of so many."""

_TOGETHER = 32
"""Samples whose slopes are taken side by side: what stays in a core's cache."""

RUNS = 64
"""Predictions that run side by side."""


class Planes(NamedTuple):
    """The steps of a stretch of samples.

    Attributes:
        place: where each began (n, states and disturbances). following: where it led (n, states).
        slopes: by the place, the commands and some directions of the parameters side by side (n, states, moves).
    """

    place: Any
    following: Any
    slopes: Any


# ---- along the record ----------------------------------------------------------------------------------------------
def along(
    model: StochasticModel, begin: Begun, numbers: FilterNumbers, readings: Array, commands: Array, voltage: Array
) -> FilterRun:
    """Innovations and the states after each reading: in C, where that can be had.

    Args:
        model, numbers: of the filter.
        begin: of `begun`.
        readings, commands, voltage: by sample.
    """
    if (in_c := compiled_filter(model)) is not None:
        return in_c.along(begin, numbers, (readings, commands, voltage))
    state, n, parts = first_state(model, begin.x, numbers.nuisance), len(readings), []
    for rows in stretches(readings, commands, voltage):
        state, part = _along(model, state, begin.gain, numbers, *rows)
        parts.append(part)
    return FilterRun(*whole(parts, n))


@jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)
def _along(
    model: StochasticModel,
    state: FilterState,
    gain: FilterGain,
    numbers: FilterNumbers,
    readings: Float[jax.Array, "samples outputs"],
    commands: Float[jax.Array, "samples inputs"],
    voltage: Float[jax.Array, " samples"],
) -> tuple[FilterState, tuple[Any, FilterState]]:
    parameters = model.vehicle.parameters(*numbers.parameters)

    def advance(x: Any, acting: Any, now: tuple[Any, Any]) -> Any:
        return model.step(x, acting, now[0], parameters, now[1])

    told = (commands, voltage)
    noise, nuisance = Noise(*numbers.noise), Nuisance(*numbers.nuisance)
    return model.run(state, readings, advance, told, noise, nuisance, gain)


def ahead_of(
    model: StochasticModel,
    states: FilterState,
    numbers: FilterNumbers,
    commands: Array,
    voltage: Array,
    starts: NDArray[np.intp],
    ahead: int,
) -> Array:
    """States predicted 1, 2, ... samples after some starts, with nothing measured any more (starts, ahead, states).

    Args:
        model, numbers: of the filter.
        states: after each reading, of `along`.
        commands, voltage: by sample, `ahead` of them beyond the last start.
        starts: samples. ahead: how many samples to predict.
    """
    if (in_c := compiled_filter(model)) is not None:
        return in_c.ahead_of(states, numbers, commands, voltage, starts, ahead)
    parts = [np.zeros((0, ahead, len(model.vehicle.state_names)))]
    for first in range(0, len(starts), RUNS):
        here = np.pad(starts[first : first + RUNS], (0, max(0, first + RUNS - len(starts))), mode="edge")
        rows = here[:, None] + np.arange(ahead)
        begin = jax.tree.map(lambda part, at=here: np.asarray(part)[at], states)
        parts.append(_ahead_of(model, begin, numbers, commands[rows], voltage[rows]))
    return whole(parts, len(starts))


@jit(static_argnums=0)
def _ahead_of(
    model: StochasticModel,
    begin: FilterState,
    numbers: FilterNumbers,
    commands: Float[jax.Array, "runs samples inputs"],
    voltage: Float[jax.Array, "runs samples"],
) -> Any:
    parameters, noise = model.vehicle.parameters(*numbers.parameters), Noise(*numbers.noise)

    def advance(x: Any, acting: Any, now: tuple[Any, Any]) -> Any:
        return model.step(x, acting, now[0], parameters, now[1])

    def sample(state: FilterState, now: tuple[Any, Any]) -> tuple[FilterState, Any]:
        following = model.predict(state, noise, advance, now)
        return following, following.x

    return jax.vmap(lambda state, told: jax.lax.scan(sample, state, told)[1])(begin, (commands, voltage))


# ---- slopes --------------------------------------------------------------------------------------------------------
def moved(
    model: StochasticModel,
    begin: Begun,
    begin_moved: Begun,
    numbers: FilterNumbers,
    directions: FilterNumbers,
    series: tuple[Array, Array, Array],
    run: FilterRun,
    late: tuple[int, Array],
    *,
    free: int,
) -> Array:
    """Slopes of a run's innovations along directions (directions, n, n_outputs).

    Args:
        model, begin, numbers: as of `along`; series: its readings, commands and voltage.
        begin_moved: of `begun_moved`. directions: in which the numbers move.
        run: of `along`.
        late: the first of the directions that move the commands, and how they do (directions, n, inputs).
        free: so many directions, the first, are of parameters.
    """
    if (in_c := compiled_filter(model)) is not None and run.roots is not None:
        return in_c.moved(begin, begin_moved, numbers, directions, series, run.roots, late)
    readings, commands, voltage = series
    p, (first, pushed) = len(directions.parameters), late
    steps = planes(model, run.states, commands, voltage, numbers.parameters, directions.parameters[:free])
    pushes = np.zeros((p, *commands.shape)), np.eye(p, free)
    pushes[0][first : first + len(pushed)] = pushed
    return along_moved(model, begin, begin_moved, numbers, directions, readings, steps, pushes)


def planes(
    model: StochasticModel, states: FilterState, commands: Array, voltage: Array, parameters: Array, directions: Array
) -> list[Planes]:
    """Each sample's tangent plane, by stretch.

    Args:
        model: of the filter.
        states: after each reading, of `along`.
        commands, voltage: by sample. parameters: of the equations.
        directions: of the parameters (k, parameters).
    """
    place = np.concatenate([states.x, _acting(model, states)], axis=1)
    first = place.shape[1] + commands.shape[1]
    moves = np.zeros((first + len(directions), first + len(parameters)))
    moves[:first, :first] = np.eye(first)
    moves[first:, first:] = directions
    moves = _filled(moves)
    return [Planes(rows[0], *_planes(model, *rows, parameters, moves)) for rows in stretches(place, commands, voltage)]


@jit(static_argnums=0, compiler_options=FEW_PASSES)
def _planes(
    model: StochasticModel,
    place: Float[jax.Array, "samples place"],
    commands: Float[jax.Array, "samples inputs"],
    voltage: Float[jax.Array, " samples"],
    parameters: Float[jax.Array, " parameters"],
    moves: Float[jax.Array, "moves directions"],
) -> tuple[Any, Any]:
    """Where each step leads (n, states), and its slopes along the moves (n, states, moves)."""
    n = len(model.vehicle.state_names)
    s, m = place.shape[1], place.shape[1] + commands.shape[1]

    def one(sample: tuple[Any, Any, Any]) -> Any:
        here, u, volts = sample

        def step(z: Any) -> Any:
            return model.step(z[:n], z[n:s], z[s:m], model.vehicle.parameters(*z[m:]), volts)

        at = jnp.concatenate([here, u, parameters])
        return jax.vmap(lambda move: jax.jvp(step, (at,), (move,)), out_axes=(None, -1))(moves)

    return jax.lax.map(one, (place, commands, voltage), batch_size=_TOGETHER)


def along_moved(
    model: StochasticModel,
    begin: Begun,
    begin_moved: Begun,
    numbers: FilterNumbers,
    directions: FilterNumbers,
    readings: Array,
    steps: list[Planes],
    pushes: tuple[Array, Array],
) -> Array:
    """Slopes of the innovations along directions (directions, n, n_outputs).

    Args:
        model, begin, numbers, readings: as of `along`.
        begin_moved: of `begun_moved`.
        directions: in which the numbers move.
        steps: of `planes`.
        pushes: how each direction moves the commands by sample (directions, n, inputs), and how far it goes along
            each of the directions that the planes know (directions, k).
    """
    moved, to = (jax.tree.map(_filled, part) for part in (begin_moved, directions))
    state, moving = (first_state(model, x, told) for x, told in ((begin.x, numbers.nuisance), (moved.x, to.nuisance)))
    commands, further = pushes
    room = steps[0].slopes.shape[-1] - steps[0].place.shape[-1] - commands.shape[-1] - further.shape[-1]
    further = _filled(np.pad(further, ((0, 0), (0, room))))
    parts = []
    for step, (read,), pushed in zip(steps, stretches(readings), _stretches_of(_filled(commands)), strict=True):
        pushing = (pushed, further)
        state, moving, slopes = _along_moved(
            model, (state, begin.gain), (moving, moved.gain), numbers, to, read, step, pushing
        )
        parts.append(slopes)
    return np.concatenate(parts, axis=1)[: len(directions.parameters), : len(readings)]


@jit(static_argnums=0, compiler_options=FEW_PASSES)
def _along_moved(
    model: StochasticModel,
    here: tuple[FilterState, FilterGain],
    moved: tuple[FilterState, FilterGain],
    numbers: FilterNumbers,
    directions: FilterNumbers,
    readings: Float[jax.Array, "samples outputs"],
    step: Planes,
    pushes: tuple[Any, Any],
) -> tuple[FilterState, FilterState, Any]:
    """The state at the end, how it moves, and how the innovations move."""

    def run(state: FilterState, gain: FilterGain, noise: Any, nuisance: Any, commands: Any, further: Any) -> Any:
        place = step.place.shape[-1]
        last = place + commands.shape[-1]
        by_place, by_command, by_number = jnp.split(step.slopes, (place, last), axis=-1)
        led = step.following + jnp.einsum("nij,nj->ni", by_command, commands) + by_number @ further

        def advance(x: Any, acting: Any, now: tuple[Any, Any, Any]) -> Any:
            led, place, by_place = now
            return led + by_place @ (jnp.concatenate([x, acting]) - place)

        told = (led, step.place, by_place)
        end, (innovations, _) = model.run(state, readings, advance, told, Noise(*noise), Nuisance(*nuisance), gain)
        return end, innovations

    still = jax.tree.map(lambda rows: jnp.zeros(rows.shape[1:]), pushes)
    at = (*here, numbers.noise, numbers.nuisance, *still)
    to = (*moved, directions.noise, directions.nuisance, *pushes)
    (end, _), (end_moved, slopes) = jax.vmap(lambda d: jax.jvp(run, at, d), out_axes=((None, None), 0))(to)
    return end, end_moved, slopes


# ---- blocks and stretches ------------------------------------------------------------------------------------------
def _filled(rows: Any) -> Any:
    """Rows with zeros behind them up to the next whole block."""
    rows = np.asarray(rows)
    rest = -len(rows) % _DIRECTIONS
    return np.concatenate([rows, np.zeros((rest, *rows.shape[1:]))]) if rest else rows


def stretches(*rows: Array) -> Iterator[tuple[Array, ...]]:
    """Series cut into stretches of `STRETCH` samples, the last one lengthened by its last sample."""
    n = len(rows[0])
    for first in range(0, n, STRETCH):
        yield tuple(lengthened(np.asarray(part[first : first + STRETCH]), STRETCH) for part in rows)


def _stretches_of(moved: Array) -> Iterator[Array]:
    """The same of slopes, whose samples come second; nothing moves beyond the last."""
    rest = -moved.shape[1] % STRETCH
    moved = np.concatenate([moved, np.zeros((len(moved), rest, *moved.shape[2:]))], axis=1)
    for first in range(0, moved.shape[1], STRETCH):
        yield moved[:, first : first + STRETCH]


def whole(parts: Any, n: int) -> Any:
    """Stretches or blocks one after the other, the first n of their rows."""
    return jax.tree.map(lambda *rows: np.concatenate([np.asarray(row) for row in rows])[:n], *parts)


def _acting(model: StochasticModel, states: FilterState) -> Array:
    """The disturbances that act at every sample (n, disturbances)."""
    drift = np.asarray(states.drift)
    wind = np.zeros((len(drift), model.n_gusts - N_DISTURBANCES))
    acting: Array = np.asarray(states.gust) + np.concatenate([drift, wind], axis=1)
    return acting
