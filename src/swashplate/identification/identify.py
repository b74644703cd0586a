"""`identify`: the verb from data to a result, whatever the model and the method."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import ESTIMATORS, Data, Estimator, Question, check_method
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.card import Card
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.traits import Free
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment


def identify(
    model: Vehicle | StateSpaceModel,
    flights: Flight | Sequence[Flight] | FrequencyResponse,
    *,
    free: str | Sequence[str | Free] | None = None,
    method: str | None = None,
    ties: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    prior_card: Card | None = None,
    outputs: Sequence[str] | None = None,
    iterations: int | None = None,
    keep_unexcited: bool = False,
    wind: bool = False,
    leave_out: Sequence[tuple[float, float]] = (),
    environment: Environment | None = None,
    shifts: bool | None = None,
    biases: Sequence[str] = (),
    gusts: str | None = None,
    horizon: Sequence[float] | None = None,
    residual: bool = False,
    progress: Callable[[int, float], None] | None = None,
) -> Result[Any, Any]:
    """Identify a model's parameters from one or more conditioned flights, or from frequency responses.

    Args:
        model: the equations and the numbers to start from.
        flights: conditioned flights; each unbroken piece is a record with its own delays, trims and start. Or measured
            responses, for a state-space model.
        free: "full", "flight" (the paper's six) or names; "full" where nothing is said and the vehicle has that choice.
            A state-space model says itself what is free.
        method: one of `ESTIMATORS`; None takes the first that suits model and data. "filter-error" (disturbed air, or
            feedback) has a Kalman gain made of the noise that it estimates: gusts that last for helicopters with their
            pose tracked, white noise on every state's rate for other equations. "prediction-error" has a free gain:
            any stationary gust, for long records. "output-error" has none: undisturbed open-loop flights and
            simulations.
        ties: "name = expression" each.
        fixed: values of parameters that are not to move.
        priors: mean and standard deviation by name.
        prior_card: a card from the bench or from another flight: see `parameterize`.
        outputs: measured channels.
        iterations: at most this many.
        keep_unexcited: True also frees parameters of axes that the flights do not move independently.
        wind: True estimates a horizontal wind that acts through the equations (filter error of tracked helicopters
            only): for flights outdoors or in strong gusts.
        leave_out: stamps (start, stop) [s] of stretches that the filter passes and nothing is learnt from, as where the
            aircraft was touched (`Contact.intervals`; as `wind`).
        environment: wind, density and gravity, for equations of your own.
        shifts: constants in the states' rates, per record (None: for state-space models alone).
        biases: outputs with a constant of their own, per record.
        gusts: of filter error for state-space models, "white" (None) or "lasting", which move the air that the states
            u, v, w fly through.
        horizon: (FIRST, LAST) in seconds: after maximum likelihood, make errors FIRST, 2 FIRST, ... LAST seconds ahead
            small, predicted from the filter's states; for methods with a filter (`core.multi_step`). Bounds are those
            of this criterion, corrected for predictions that overlap.
        residual: also fit accelerations that the equations lack, linear in motion and inputs (`models.residual`), as
            far as blocks of these flights, left out, speak for them; to the innovations together with the physics, or
            with `horizon` to the errors ahead, the physics held. `result.problems` says what it gained, its part of
            each acceleration and which physics moved.
        progress: called with the iteration's number and cost.

    Returns:
        The result; `result.failed` tells whether its numbers may be used.

    Raises:
        IdentificationError: where no fit can be started: no method suits, unknown names, parameters that leave no
            trace, divergence.
        FlightError: where a flight lacks a channel or is not on a uniform grid.
    """
    data: Data = (
        flights
        if isinstance(flights, FrequencyResponse)
        else (flights,)
        if isinstance(flights, Flight)
        else tuple(flights)
    )
    question = Question(
        free=free,
        ties=tuple(ties),
        fixed=fixed,
        priors=priors,
        prior_card=prior_card,
        outputs=None if outputs is None else tuple(outputs),
        iterations=iterations,
        keep_unexcited=keep_unexcited,
        wind=wind,
        leave_out=tuple((float(start), float(stop)) for start, stop in leave_out),
        environment=environment,
        shifts=shifts,
        biases=tuple(biases),
        gusts=gusts,
        horizon=None if horizon is None else tuple(horizon),
        residual=residual,
        progress=progress,
    )
    if isinstance(model, Vehicle) and model.structure is not None and free is None:
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
