"""One controller on many aircraft: models drawn from what an identification does not know, flown in closed loop."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from swashplate.arrays import Array
from swashplate.errors import ControllerError
from swashplate.identification.core.result import Result
from swashplate.identification.core.result_file import load
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

SENSOR_NOISE: Mapping[str, float] = {
    **dict.fromkeys(("x", "y", "z"), 0.002),
    **dict.fromkeys(("u", "v", "w"), 0.02),
    **dict.fromkeys(("phi", "theta", "psi"), 0.005),
    **dict.fromkeys(("p", "q", "r"), 0.01),
}
"""White noise on each sample of what a controller is told [m, m/s, rad, rad/s]; assumed, as of cameras and gyros."""


def draw_models(
    model: Vehicle | StateSpaceModel,
    fit: Result[Any, Any] | str | Path,
    *,
    count: int,
    seed: int,
    corrected: bool = True,
) -> dict[str, Array]:
    """Parameters of models that the data of a fit cannot tell from the identified one, shape (count,) each.

    Args:
        model: whose bounds hold.
        fit: a result, or its file (the `fit.json` beside a model file).
        count, seed, corrected: see `Result.draw_values`.

    Raises:
        ControllerError: where the fit is of another model.
        DocumentError: where the file is no result.
        IdentificationError: where the fit knows no spread, or one that lies mostly outside the bounds of physics.
    """
    result = fit if isinstance(fit, Result) else load(fit, equations=model if isinstance(model, Vehicle) else None)
    where = "the fit" if isinstance(fit, Result) else str(fit)
    if isinstance(model, Vehicle):
        model = model.structure or model
    known = model.card.parameters if isinstance(model, Vehicle) else model.parameters
    strange = sorted(set(result.names) - set(known))
    if strange:
        raise ControllerError(f"is of another model: {model.name} has no {', '.join(strange)}.", where=where)
    return result.draw_values(count, seed=seed, corrected=corrected, within=model)
