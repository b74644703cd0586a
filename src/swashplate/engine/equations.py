"""A vehicle's equations without its numbers, and the flat rows of compiled code: states, what drives, numbers."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment

Rows = Any
"""A row of numbers or of symbols that can be indexed, or a batch of them with further axes behind."""

SURROUNDINGS = ("wind_north", "wind_east", "wind_down", "voltage")
"""What of the environment may change during a flight, in the order of the driving row."""
CONSTANTS = ("air_density", "gravity")
"""What of the environment stays, in the order of the end of the parameter row."""


@dataclass(frozen=True)
class Equations:
    """A vehicle's equations without its numbers: equal for two cards of one vehicle, so that compiled code is shared.

    Attributes:
        key: what decides the equations (functions, their options, names).
        vehicle: any vehicle that has them; its card is never read in compiled code.
    """

    key: Hashable
    vehicle: Vehicle = field(compare=False, repr=False)


def equations_of(vehicle: Vehicle) -> Equations:
    """The equations of a vehicle, to be the key of compiled code."""
    functions = (_identity(vehicle.derivatives), _identity(vehicle.specific_force))
    return Equations((vehicle.name, vehicle.state_names, vehicle.input_names, *functions), vehicle)


def _identity(function: object) -> Hashable:
    if isinstance(function, partial):  # two of the same function and numbers are the same equations
        keywords = ((name, _identity(value)) for name, value in sorted(function.keywords.items()))
        return (_identity(function.func), tuple(map(_identity, function.args)), tuple(keywords))
    return function


def parameter_row(vehicle: Vehicle, environment: Environment) -> Array:
    """The card's numbers and the constant surroundings side by side, shape (n_parameters + 2,)."""
    around = environment_of(vehicle, environment)
    constants = (getattr(around, name) for name in CONSTANTS)
    return np.array([*vehicle.values(), *constants], dtype=np.float64)


def unpack_rows(equations: Equations, w: Rows, p: Rows) -> tuple[Any, Any, Environment]:
    """Inputs, named parameters and environment from a driving row `w` and a parameter row `p`, or batches of these."""
    n_inputs, names = len(equations.vehicle.input_names), equations.vehicle.parameter_names
    parameters = equations.vehicle.parameters(*(p[i] for i in range(len(names))))
    surroundings = {name: w[n_inputs + i] for i, name in enumerate(SURROUNDINGS)}
    constants = {name: p[len(names) + i] for i, name in enumerate(CONSTANTS)}
    return w[:n_inputs], parameters, Environment(**surroundings, **constants)
