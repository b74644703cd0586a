"""Results that no fit has made: estimates with a given covariance, for the tests of what draws from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.result import Estimate, Result, correlation_of


def result(
    model: Any,
    values: Mapping[str, float],
    covariance: Array,
    *,
    corrected: Array | None = None,
    ties: Mapping[str, str] | None = None,
) -> Result[Any, None]:
    """A result of a model (a vehicle or a state-space model) with these free parameters."""
    free = [Estimate(n, "1", v, v, sigma=float(np.sqrt(covariance[i, i]))) for i, (n, v) in enumerate(values.items())]
    tied = [Estimate(name, "1", 0.1, 0.1, tie=tie) for name, tie in (ties or {}).items()]
    return Result(
        method="made",
        solution=model,
        start=model,
        estimates=(*free, *tied),
        names=tuple(values),
        covariance=covariance,
        covariance_corrected=np.full_like(covariance, np.nan) if corrected is None else corrected,
        correlation=correlation_of(covariance),
        details=None,
        history=(2.0, 1.0),
    )
