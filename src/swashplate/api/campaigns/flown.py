"""What several kinds of campaign read of their files: vehicles, gusts, what is free and where a fit starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from swashplate.api.campaigns.tasks import Columns
from swashplate.arrays import Array
from swashplate.errors import CampaignError
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.result import Result, bounds_of
from swashplate.models.catalogue import vehicle as find_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.wind import Gusts, indoor, outdoor


@lru_cache(maxsize=4)
def vehicle_of(name_or_file: str) -> Vehicle:
    """A vehicle, read once in a worker's life."""
    return find_vehicle(name_or_file)


def gusts_of(given: Mapping[str, float]) -> Gusts | None:
    """Turbulence as a campaign's file asks for it: {indoor = SIGMA}, {outdoor = MEAN} [m/s], or none."""
    if not given:
        return None
    makers: Mapping[str, Any] = {"indoor": indoor, "outdoor": outdoor}
    if len(given) != 1 or next(iter(given)) not in makers:
        raise CampaignError(
            f"{', '.join(given)}: expected one of {{indoor = SIGMA}} and {{outdoor = MEAN}} in m/s.",
            channel="varies.gusts",
        )
    name, value = next(iter(given.items()))
    gusts: Gusts = makers[name](value)
    return gusts


def free_of(model: Vehicle, free: str | Sequence[str] | None, *, ties: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of the numbers of a model that a fit moves.

    Raises:
        IdentificationError, CardError: for names that the model does not have.
    """
    if model.structure is not None:
        return model.structure.free
    return parameterize(model, "full" if free is None else free, ties=ties).names


def identified(model: Vehicle) -> Vehicle | StateSpaceModel:
    """What `identify` takes for a vehicle: of a state-space model its matrices of named expressions."""
    return model if model.structure is None else model.structure


def values_of(model: Vehicle, names: Sequence[str]) -> Array:
    """Values of a model's numbers (p,)."""
    every = model.card.parameters if model.structure is None else model.structure.parameters
    return np.array([every[name].value for name in names], dtype=np.float64)


def within_bounds(model: Vehicle, names: Sequence[str], values: Array) -> Array:
    """Values (p,) that physics allows, the nearest ones."""
    low, high = bounds_of(identified(model), names)
    return np.clip(values, low, high)


def started(model: Vehicle, names: Sequence[str], values: Array) -> Vehicle:
    """The model with other numbers to start a fit from."""
    return model.with_values({name: float(value) for name, value in zip(names, values, strict=True)})


def outcome_columns(fits: Sequence[Result[Any, Any] | str]) -> Columns:
    """Whether each fit came to an end that may be used, its cost, and what was wrong with it; a text is why there is
    none."""
    usable = [not isinstance(fit, str) and not fit.failed for fit in fits]
    return {
        "cost": np.array([np.nan if isinstance(fit, str) else fit.cost for fit in fits]),
        "usable": np.array(usable, dtype=np.int64),
        "converged": np.array([not isinstance(fit, str) and fit.converged for fit in fits], dtype=np.int64),
        "problem": np.array([fit if isinstance(fit, str) else "; ".join(fit.problems) for fit in fits], dtype=np.str_),
    }
