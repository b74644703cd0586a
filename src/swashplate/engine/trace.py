"""A vehicle's rates traced by CasADi on flat rows, with its roots left to be found in loops."""

from __future__ import annotations

from swashplate.engine.equations import Equations, unpack_rows
from swashplate.engine.roots import Looped, Looping, require_casadi
from swashplate.errors import ExportError


def traced_rates(equations: Equations) -> Looped:
    """The rates as a function of (x, w, p, guess, root); rows as in `dynamics.row_rates`.

    Raises:
        ExportError: for equations that CasADi cannot trace.
        MissingLibraryError: without CasADi.
    """
    casadi, vehicle = require_casadi(), equations.vehicle
    sizes = (len(vehicle.state_names), len(vehicle.input_names) + 4, len(vehicle.parameter_names) + 2)
    x, w, p = (casadi.SX.sym(name, size) for name, size in zip("xwp", sizes, strict=True))
    looping = Looping(casadi)
    try:
        return looping.looped([x, w, p], [casadi.vertcat(*vehicle.rates(x, *unpack_rows(equations, w, p), looping))])
    except Exception as error:  # whatever a model of another package does with numbers that are none
        raise ExportError(f"CasADi cannot trace the equations: {error}", where=vehicle.name) from error
