"""Modes and margins of a vehicle under a sampled controller, from the linearised map of `sampled_loop`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swashplate.control.margins import Margins, margins
from swashplate.control.sampled_loop import SampledLoop, sampled_loop
from swashplate.errors import ControllerError
from swashplate.simulation.closed_loop import Controller
from swashplate.simulation.trim import Trim
from swashplate.vehicles.vehicle import Vehicle

_LOWEST = 0.02
"""rad/s; below it an aircraft with integrators has gain to spare."""
_SAMPLES = 20.0
"""Samples per period that a controller needs for a mode that it must hold."""
_NEUTRAL = 1e-6
"""1/s; a mode that grows slower is one that nobody asked to be held: the place of an aircraft that holds its speed."""
_NO_STATE = 1e-8
"""Below this modulus an eigenvalue of the map is no mode: memory that every sample writes anew."""


def loop_modes(vehicle: Vehicle, controller: Controller, trim: Trim) -> NDArray[np.complex128]:
    """Eigenvalues [1/s] of the closed loop about a hover, with the controller's sampling and hold in them.

    The sampled map of states and memory is differentiated and its eigenvalues z are given as rate ln z, least stable
    first. Terms such as u |u| have no slope at hover and no part in it.

    Args:
        vehicle: what flies, which need not be what the controller was designed on.
        controller: see `swashplate.simulation.closed_loop.Controller`.
        trim: the hover; the reference is its place and heading.

    Raises:
        SwashError: where the loop is not finite there.
    """
    return modes_of(sampled_loop(vehicle, controller, trim))


def modes_of(loop: SampledLoop) -> NDArray[np.complex128]:
    """The same for a loop that is already linearised."""
    values = np.linalg.eigvals(loop.matrix).astype(np.complex128)
    modes = np.log(values[np.abs(values) > _NO_STATE]) * loop.rate
    return np.asarray(modes[np.argsort(-modes.real, kind="stable")])


def loop_margins(vehicle: Vehicle, controller: Controller, trim: Trim, *, points: int = 400) -> Margins:
    """Margins of the same loop, opened at the inputs of the vehicle, from 0.02 rad/s to Nyquist's frequency.

    Args:
        vehicle, controller, trim: as in `loop_modes`.
        points: of the frequency grid.

    Raises:
        ControllerError: where the closed loop is not stable: it has no margins.
    """
    return margins_of(sampled_loop(vehicle, controller, trim), points=points, where=vehicle.name)


def frequencies_of(loop: SampledLoop, *, points: int) -> NDArray[np.float64]:
    """The grid [rad/s] from 0.02 rad/s to Nyquist's frequency, shape (points,)."""
    return np.geomspace(_LOWEST, np.pi * loop.rate * 0.999, points)


def margins_of(loop: SampledLoop, *, points: int = 400, where: str = "") -> Margins:
    """The same for a loop that is already linearised.

    Raises:
        ControllerError: where the closed loop is not stable.
    """
    require_stable(complex(modes_of(loop)[0]), rate=loop.rate, where=where)
    w = frequencies_of(loop, points=points)
    return margins(w, loop.opened(w), loop.inputs)


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
