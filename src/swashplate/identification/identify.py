"""`identify`: the verb from data to a result, whatever the model and the method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import ESTIMATORS, Data, Estimator, Question, check_method
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle


def identify(
    model: Vehicle | StateSpaceModel,
    flights: Flight | Sequence[Flight] | FrequencyResponse,
    *,
    method: str | None = None,
    **asked: Any,
) -> Result[object, object]:
    """Identify a model's parameters from one or more conditioned flights, or from frequency responses.

    Args:
        model: the equations and the numbers to start from.
        flights: conditioned flights; each unbroken piece is a record with its own delays, trims and start. Or measured
            responses, for a state-space model.
        method: one of `ESTIMATORS`; None takes the first that suits model and data.
        asked: fields of `Question`.

    Returns:
        The result; `result.failed` tells whether its numbers may be used.

    Raises:
        IdentificationError: where no fit can be started: no method suits, unknown names, parameters that leave no
            trace, divergence.
        FlightError: where a flight lacks a channel or is not on a uniform grid.
    """
    data: Data = flights if isinstance(flights, FrequencyResponse) else as_flights(flights)
    question = Question(**asked)
    if isinstance(model, Vehicle) and model.structure is not None and question.free is None:
        model = model.structure  # its named parameters say themselves what is free; entries of matrices are named
    name, estimator = _suited(model, data, method)
    unheard = sorted(set(question.asked) - estimator.takes)
    if unheard:
        others = [
            n for n in ESTIMATORS if set(unheard) <= ESTIMATORS[n].takes and not ESTIMATORS[n].unsuited(model, data)
        ]
        raise IdentificationError(
            f"the method '{name}' does not know it for this model; it takes {', '.join(sorted(estimator.takes))}.",
            channel=", ".join(unheard),
            hint=f"Leave it away, or choose method {' or '.join(n.split('/')[0] for n in others)}."
            if others
            else "Leave it away, or choose another method.",
        )
    return estimator.estimate(model, data, question)


def _suited(model: Vehicle | StateSpaceModel, data: Data, method: str | None) -> tuple[str, Estimator]:
    """The first estimator of that method (None: of any) that suits."""
    check_method(method)
    refused = {}
    for name in ESTIMATORS:
        if method in (None, name.split("/")[0]):
            estimator = ESTIMATORS[name]
            reason = estimator.unsuited(model, data)
            if not reason:
                return name.split("/")[0], estimator
            refused[name] = reason
    reasons = "; ".join(f"{name}: {reason}" for name, reason in refused.items())
    raise IdentificationError(f"no method suits this model and these data ({reasons}).", where=f"'{model.name}'")
