"""Which inputs the four sticks move, which way and how far, for vehicles that are flown by state feedback."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.control.laws.linear_decoupling import static_decoupling
from swashplate.errors import SwashError
from swashplate.flights.maneuvers.series import AXES
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.discretisation import zero_order_hold
from swashplate.simulation.linearize import LinearModel

STICKS = AXES
_OUTPUTS = ("p", "q", "r", "w")
_MOVED = ("phi", "theta", "psi", "z")
_SENSE = np.array([1.0, -1.0, 1.0, -1.0])
"""A stick's way in these: right, nose down (ahead), nose right, up."""
_SHARES = np.array([0.2, 0.2, 0.4, 0.25])
"""Of half an input's range that a full stick moves."""
_EXCITED = 0.15
"""Of half an input's range that a maneuver moves."""
_SOON = 0.5
"""s: an axis goes where a step of its inputs has moved the aircraft by then."""
_ENOUGH = np.array([0.2, 0.2, 0.35, 0.5])
"""rad, m: how far a full stick turns or lifts a linear model by then at most; its inputs' ranges are often assumed."""
_SINGULAR = 1e-6
"""Condition (inverse) below which the axes cannot be told apart."""


@dataclass(frozen=True)
class Axes:
    """What sticks do to inputs.

    Attributes:
        directions: inputs that an axis moves, shape (n_inputs, 4) in the order of `STICKS`.
        spans: how far inputs go along them, from end to end [unit of the inputs], shape (4,).
        mixing: full sticks to inputs, with and without decoupling, shape (n_inputs, 4).
        amplitude: of maneuvers by axis [unit of the inputs].
        excited: what a maneuver moves, as it is called in one: the axis, or an input.
    """

    directions: Array
    spans: Array
    mixing: Mapping[bool, Array]
    amplitude: Mapping[str, float]
    excited: Mapping[str, str]


def axes_of(vehicle: Vehicle, model: LinearModel) -> Axes:
    """The axes of a vehicle whose linear model about hover is known.

    Raises:
        SwashError: where the inputs are fewer than four or move too little.
    """
    soon = zero_order_hold(model.A, model.B, _SOON)[1][[vehicle.index(name) for name in _MOVED]]
    directions, excited = _directions(vehicle, soon)
    response = soon @ directions
    reached = np.diag(response)
    if not np.all(reached):
        lost = ", ".join(out for out, value in zip(_MOVED, reached, strict=True) if not value)
        raise SwashError(
            f"has no input that moves {lost}: it cannot be flown by four sticks.", where=vehicle.card.where
        )
    ranges = np.ptp(np.array(vehicle.input_limits), axis=1)
    half = np.array([0.5 * np.min(ranges[column != 0.0]) for column in directions.T])
    travel = _SHARES * half
    if vehicle.traits.linear:
        travel = np.minimum(travel, _ENOUGH / np.abs(reached))
    scale = np.sign(reached) * _SENSE * travel
    # Axes to inputs: the rotors' senses decide about signs (nose down is ahead, thrust is up).
    matrix = None if vehicle.traits.linear else _at_once_decoupled(model, directions)
    if matrix is None:
        matrix = _soon_decoupled(response, vehicle)
    mixing = {True: directions @ matrix @ np.diag(scale), False: directions @ np.diag(scale)}
    amplitude = dict(zip(STICKS, (_EXCITED / _SHARES * travel).tolist(), strict=True))
    return Axes(directions, 2.0 / _SHARES * travel, mixing, amplitude, excited)


def _at_once_decoupled(model: LinearModel, directions: Array) -> Array | None:
    """Axes that leave each other's rates alone at first, shape (4, 4).

    None where the first derivatives do not tell the axes apart: thrust perpendicular to the disc leaves the cyclic
    nothing to do until the disc has tilted, while collective pitches at once.
    """
    by_axis = dataclasses.replace(model, B=model.B @ directions, D=np.zeros((len(model.states), 4)), inputs=STICKS)
    try:
        return static_decoupling(by_axis, inputs=STICKS, outputs=_OUTPUTS).matrix
    except SwashError:
        return None


def _soon_decoupled(response: Array, vehicle: Vehicle) -> Array:
    """Axes whose steps have not turned or lifted each other after `_SOON`, shape (4, 4).

    Identified inputs often reach a rate by several ways (pitch at once by a small Mcol, by flapping a moment later), of
    which the first says little.
    """
    ratio = response / np.diag(response)[:, None]
    if np.linalg.cond(ratio) * _SINGULAR > 1.0:
        raise SwashError("has inputs that move two axes alike: four sticks cannot fly it.", where=vehicle.card.where)
    return np.asarray(np.linalg.inv(ratio), dtype=np.float64)


def _directions(vehicle: Vehicle, soon: Array) -> tuple[Array, dict[str, str]]:
    """Inputs by axis: those whose names say it, otherwise those that move the axes most."""
    names = vehicle.input_names
    by_axis: dict[str, Mapping[str, float]] = dict(vehicle.stick_axes)
    excited = {axis: axis for axis in STICKS}
    if not set(STICKS) <= set(by_axis):
        if len(names) < len(STICKS):
            raise SwashError(
                f"has the inputs {', '.join(names)}: too few for four sticks.",
                where=vehicle.card.where,
                hint="A model that is flown by hand needs four: roll, pitch, yaw and heave.",
            )
        from scipy.optimize import linear_sum_assignment

        ranges = np.ptp(np.array(vehicle.input_limits), axis=1)
        strength = np.abs(soon) * ranges
        strength = strength / np.maximum(np.max(strength, axis=1, keepdims=True), 1e-300)
        _, columns = linear_sum_assignment(strength, maximize=True)
        excited = {axis: names[column] for axis, column in zip(STICKS, columns, strict=True)}
        by_axis = {axis: {name: 1.0} for axis, name in excited.items()}
    return np.array([[by_axis[axis].get(name, 0.0) for axis in STICKS] for name in names]), excited
