"""The table of derivatives by exact slopes of the nonlinear equations."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row, unpack_rows
from swashplate.engine.slopes import Slopes, slopes_of
from swashplate.errors import SwashError
from swashplate.models.conventional.derivative_table import COLUMNS, CONTROLS, MOTIONS, DerivativeTable
from swashplate.models.conventional.helicopter import CONTRIBUTORS, loads
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.models.nesting import leaves, rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend
from swashplate.simulation.trim import Trim

if TYPE_CHECKING:
    from swashplate.engine.equations import Rows

_FAST = ("a1", "b1", "lam0", "lam_c", "lam_s")
"""States that follow without delay in a table of derivatives with six degrees of freedom."""


def derivative_table(vehicle: Vehicle, trim: Trim) -> DerivativeTable:
    """All derivatives of forces and moments about a trim, by contributor, exactly.

    Flapping and dynamic inflow are residualised (their rates set to zero); bar, servos, gyro and rotor speed are held.

    Raises:
        SwashError: for a vehicle that is no single-rotor helicopter.
    """
    if not isinstance(vehicle.options, HelicopterOptions):
        raise SwashError("has no table of derivatives.", where=vehicle.name, hint="It needs a single-rotor card.")
    surroundings = [float(getattr(trim.environment, name)) for name in SURROUNDINGS]
    w = np.array([*trim.inputs, *surroundings])
    numbers = parameter_row(vehicle, trim.environment)
    _, by_x, by_w = _slopes(equations_of(vehicle))(np.asarray(trim.state), w, numbers)
    fast = [vehicle.index(name) for name in _FAST if name in vehicle.state_names]
    motions = [vehicle.index(name) for name in MOTIONS]
    controls = [vehicle.input_names.index(name) for name in CONTROLS]
    if "theta0_servo" in vehicle.state_names:
        direct = by_x[:, [vehicle.index(f"{name}_servo") for name in CONTROLS]]
    else:
        direct = by_w[:, controls]
    columns = np.concatenate([by_x[:, motions], direct], axis=1)
    n = 6 * len(CONTRIBUTORS)
    following = np.asarray(-np.linalg.solve(by_x[n:, fast], columns[n:]), dtype=np.float64)
    columns = columns[:n] + by_x[:n, fast] @ following
    par = vehicle.values()
    scale = np.array([par.mass] * 3 + [par.inertia_xx, par.inertia_yy, par.inertia_zz])[:, None]
    blocks = columns.reshape(len(CONTRIBUTORS), 6, len(COLUMNS)) / scale
    parts = {name: block for name, block in zip(CONTRIBUTORS, blocks, strict=True) if name != "ground" or block.any()}
    return DerivativeTable(parts, following[:2], "automatic differentiation")


@lru_cache(maxsize=16)
def _slopes(equations: Equations) -> Slopes:
    vehicle = equations.vehicle
    sizes = (len(vehicle.state_names), len(vehicle.input_names) + 4, len(vehicle.parameter_names) + 2)

    def acting(x: Rows, w: Rows, p: Rows, xp: Backend) -> list[Any]:
        return _acting(equations, x, w, p=p, xp=xp)

    return slopes_of(acting, sizes, where=vehicle.name)


def _acting(equations: Equations, x: Rows, w: Rows, *, p: Rows, xp: Backend) -> list[Any]:
    """Forces and moments by contributor, and the rates of disc and inflow; rows as of `engine.trace.traced_rates`."""
    vehicle = equations.vehicle
    inputs, parameters, environment = unpack_rows(equations, w, p)
    state = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
    commands = vehicle.inputs(*(inputs[i] for i in range(len(vehicle.input_names))))
    load = loads(state, commands, parameters, environment, xp, options=vehicle.options)
    rows = []
    for name in CONTRIBUTORS:
        part = getattr(load, name)
        rows += [0.0] * 6 if part is None else [*part.force, *part.moment]
    return [*rows, *leaves(load.disc), *leaves(load.inflow)]
