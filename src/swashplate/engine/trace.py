"""A vehicle's rates traced by CasADi on flat rows, with its roots left to be found in loops."""

from __future__ import annotations

from functools import lru_cache

from swashplate.engine.equations import Equations, unpack_rows
from swashplate.engine.graph import Graph
from swashplate.engine.roots import Looped, Looping, require_casadi
from swashplate.engine.untraced import untraced
from swashplate.models.nesting import rebuild
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.frames import Euler
from swashplate.physics.quaternion import Quaternion, euler_of, quaternion_of


def _rows_of(equations: Equations) -> tuple[Graph, Graph, Graph]:
    """Symbols for the rows x, w and p of `dynamics.row_rates`."""
    vehicle = equations.vehicle
    sizes = (len(vehicle.state_names), len(vehicle.input_names) + 4, len(vehicle.parameter_names) + 2)
    x, w, p = (require_casadi().SX.sym(name, size) for name, size in zip("xwp", sizes, strict=True))
    return x, w, p


def traced_rates(equations: Equations) -> Looped:
    """The rates as a function of (x, w, p, guess, root); rows as in `dynamics.row_rates`.

    Raises:
        ExportError: for equations that CasADi cannot trace.
        MissingLibraryError: without CasADi.
    """
    casadi, vehicle = require_casadi(), equations.vehicle
    x, w, p = _rows_of(equations)
    looping = Looping(casadi)
    try:
        return looping.looped([x, w, p], [casadi.vertcat(*vehicle.rates(x, *unpack_rows(equations, w, p), looping))])
    except Exception as error:  # whatever a model of another package does with numbers that are none
        raise untraced(error, "equations", vehicle.name) from error


def traced_force(equations: Equations) -> Graph:
    """The specific force [m/s^2] as a CasADi function of (x, w, p); rows and errors as in `traced_rates`."""
    casadi, vehicle = require_casadi(), equations.vehicle
    x, w, p = _rows_of(equations)
    u, parameters, environment = unpack_rows(equations, w, p)
    state = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
    commands = vehicle.inputs(*(u[i] for i in range(len(vehicle.input_names))))
    try:
        felt = vehicle.specific_force(state, commands, parameters, environment, CasadiBackend())
        return casadi.Function("felt", [x, w, p], [casadi.densify(casadi.vertcat(*felt))], {"cse": True})
    except Exception as error:  # as of the rates
        raise untraced(error, "specific force", vehicle.name) from error


def traced_angles() -> Graph:
    """Roll, pitch and yaw [rad] as a CasADi function of a quaternion."""
    casadi = require_casadi()
    q = casadi.SX.sym("q", 4)
    angles = euler_of(Quaternion(*(q[i] for i in range(4))), CasadiBackend())
    return casadi.Function("angles", [q], [casadi.vertcat(*angles)], {"cse": True})


def traced_placing(states: int) -> Graph:
    """A state row with Euler angles as one with a quaternion, a CasADi function of a row of so many states."""
    casadi = require_casadi()
    x = casadi.SX.sym("x", states)
    turned = quaternion_of(Euler(x[6], x[7], x[8]), CasadiBackend())
    return casadi.Function("placing", [x], [casadi.densify(casadi.vertcat(x[:6], *turned, x[9:]))], {"cse": True})


@lru_cache(maxsize=32)
def unrolled_rates(equations: Equations) -> Graph:
    """The rates as a CasADi function of (x, w, p), with roots sought in a fixed number of steps.

    Raises:
        ExportError: for equations that CasADi cannot trace.
        MissingLibraryError: without CasADi.
    """
    casadi, vehicle = require_casadi(), equations.vehicle
    x, w, p = _rows_of(equations)
    try:
        rates = vehicle.rates(x, *unpack_rows(equations, w, p), CasadiBackend())
        return casadi.Function("rates", [x, w, p], [casadi.densify(casadi.vertcat(*rates))], {"cse": True})
    except Exception as error:  # whatever a model of another package does with numbers that are none
        raise untraced(error, "equations", vehicle.name) from error
