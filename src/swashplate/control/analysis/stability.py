"""Modes and margins of a vehicle under a sampled controller, from the linearised map of `sampled_loop`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from swashplate.control.analysis.margins import Margins, margins
from swashplate.control.analysis.sampled_loop import SampledLoop, sampled_loop
from swashplate.errors import ControllerError
from swashplate.identification.frequency.handling import crossing_delays
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim

_LOWEST = 0.02
"""rad/s; below it an aircraft with integrators has gain to spare."""
_SAMPLES = 20.0
"""Samples per period that a controller needs for a mode that it must hold."""
_NEUTRAL = 1e-6
"""1/s; a mode that grows slower is one that nobody asked to be held: the place of an aircraft that holds its speed."""
_GROWS = 1e-5
"""1/s; from here on a mode grows in a loop with more delay."""
_LONG_SAMPLES = 40.0
"""Delays of so many samples are long against a period at Nyquist's frequency."""
_NO_LOOP = 1e-12
"""Below this size there is no loop at an input."""
_NO_STATE = 1e-8
"""Below this modulus an eigenvalue of the map is no mode: memory that every sample writes anew."""


def loop_modes(
    vehicle: Vehicle,
    controller: Controller,
    trim: Trim,
    *,
    delays: Mapping[str, float] | float | None = None,
) -> NDArray[np.complex128]:
    """Eigenvalues [1/s] of the closed loop about a hover, with the controller's sampling and hold in them.

    The sampled map of states and memory is differentiated and its eigenvalues z are given as rate ln z, least stable
    first. Terms such as u |u| have no slope at hover and no part in it.

    Args:
        vehicle: what flies, which need not be what the controller was designed on.
        controller: see `swashplate.simulation.closed_loop.Controller`.
        trim: the hover; the reference is its place and heading.
        delays: as in `sampled_loop`.

    Raises:
        SwashError: where the loop is not finite there.
    """
    return modes_of(sampled_loop(vehicle, controller, trim, delays=delays))


def modes_of(loop: SampledLoop) -> NDArray[np.complex128]:
    """The same for a loop that is already linearised."""
    values = np.linalg.eigvals(loop.matrix).astype(np.complex128)
    modes = np.log(values[np.abs(values) > _NO_STATE]) * loop.rate
    return np.asarray(modes[np.argsort(-modes.real, kind="stable")], dtype=np.complex128)


def loop_margins(
    vehicle: Vehicle,
    controller: Controller,
    trim: Trim,
    *,
    delays: Mapping[str, float] | float | None = None,
    points: int = 400,
) -> Margins:
    """Margins of the same loop, opened at the inputs of the vehicle, from 0.02 rad/s to Nyquist's frequency.

    Args:
        vehicle, controller, trim, delays: as in `loop_modes`.
        points: of the frequency grid.

    Raises:
        ControllerError: where the closed loop is not stable: it has no margins.
    """
    return margins_of(sampled_loop(vehicle, controller, trim, delays=delays), points=points, where=vehicle.name)


def frequencies_of(loop: SampledLoop, *, points: int) -> NDArray[np.float64]:
    """The grid [rad/s] from 0.02 rad/s to Nyquist's frequency, shape (points,)."""
    return np.geomspace(_LOWEST, np.pi * loop.rate * 0.999, points)


def margins_of(loop: SampledLoop, *, points: int = 400, where: str = "") -> Margins:
    """The same for a loop that is already linearised.

    Raises:
        ControllerError: where the closed loop is not stable.
    """
    require_stable(complex(modes_of(loop)[0]), rate=loop.rate, where=where)
    return margins_at(loop, points=points)


def margins_at(
    loop: SampledLoop, inputs: Sequence[str] | None = None, *, points: int = 400, exact: bool = True
) -> Margins:
    """The same for a loop that is known to be stable.

    Args:
        loop: linearised.
        inputs: where it is opened; all where not given.
        points: of the frequency grid.
        exact: delay margins by the eigenvalues of the loop with the delay in it, which hold up to Nyquist's frequency;
            otherwise by phase over crossover.
    """
    w, L, names = opened_at(loop, inputs, points=points)
    by_axis = margins(w, L, names)
    if not exact or loop.later is None:
        return by_axis
    S = np.linalg.inv(np.eye(len(names)) + L)
    axes = tuple(
        replace(
            axis, delay=delay_margin(loop, [axis.name], crossing_delays(w, (1.0 / S[:, i, i] - 1.0)[:, None, None]))
        )
        for i, axis in enumerate(by_axis.axes)
    )
    return replace(by_axis, axes=axes, delay=delay_margin(loop, names, crossing_delays(w, L)))


def delay_margin(loop: SampledLoop, inputs: Sequence[str], guesses: NDArray[np.float64]) -> float:
    """The further delay of these inputs at which a mode of the loop begins to grow [s], within 1 %; infinite for none.

    Args:
        loop: stable, with `later`.
        inputs: whose commands get later, all alike.
        guesses: where it may be, ascending (`crossing_delays`); one that turns out to hold is passed over. From
            `_LONG_SAMPLES` samples on a guess is taken as it is: there phase over crossover is right.
    """
    assert loop.later is not None
    later = loop.later
    chosen = np.array([name in inputs for name in loop.inputs], dtype=np.float64)

    def grows(delay: float) -> bool:
        return bool(modes_of(later(delay * chosen))[0].real > _GROWS)

    held = 0.0
    for guess in map(float, guesses):
        if guess * loop.rate > _LONG_SAMPLES:
            return guess
        lost = 1.03 * guess + 0.01 / loop.rate
        if lost <= held:
            continue
        if not grows(lost):
            held = lost
            continue
        near = 0.97 * guess
        if near > held and not grows(near):
            held = near
        while lost - held > 0.01 * lost:
            tried = 0.5 * (held + lost)
            held, lost = (held, tried) if grows(tried) else (tried, lost)
        return 0.5 * (held + lost)
    return float("inf")


def opened_at(
    loop: SampledLoop, inputs: Sequence[str] | None = None, *, points: int
) -> tuple[NDArray[np.float64], NDArray[np.complex128], tuple[str, ...]]:
    """The grid [rad/s], the loop opened at some inputs with the others closed, and the names of those that it moves.

    Args:
        loop: linearised.
        inputs: where it is opened; all where not given.
        points: of the grid.
    """
    w = frequencies_of(loop, points=points)
    L = loop.opened(w)
    kept = [loop.inputs.index(name) for name in inputs or loop.inputs]
    if len(kept) < len(loop.inputs):
        inner = np.linalg.inv(np.eye(len(loop.inputs)) + L)[:, kept][:, :, kept]
        L = np.asarray(np.linalg.inv(inner) - np.eye(len(kept)), dtype=np.complex128)
    closed = [i for i in range(len(kept)) if np.any(np.abs(L[:, i, i]) > _NO_LOOP)]
    return w, L[:, closed][:, :, closed], tuple(loop.inputs[kept[i]] for i in closed)


def require_stable(mode: complex, *, rate: float, where: str) -> None:
    """Say which mode a loop does not hold.

    Args:
        mode: the least stable of `loop_modes` [1/s].
        rate: of the controller [Hz].
        where: the model.

    Raises:
        ControllerError: where the mode grows (one at the origin does not); fewer than `_SAMPLES` samples per period are
            named as the likely reason.
    """
    if mode.real < _NEUTRAL:
        return
    frequency = abs(mode) / (2.0 * np.pi)
    slow = frequency * _SAMPLES > rate
    raise ControllerError(
        f"the loop at {rate:g} Hz has a growing mode at {mode.real:+.3g} +- {abs(mode.imag):.3g}j 1/s.",
        where=where,
        hint=f"Run it at {_SAMPLES * frequency:.0f} Hz or more." if slow else "Change its gains.",
    )
