"""`validate`: the verb that asks how well a model predicts flights which no fit has seen, whatever the model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, overload

from swashplate.errors import SwashError
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.result import Result
from swashplate.identification.core.spans import CALIBRATION, HORIZONS
from swashplate.identification.time.flight_details import FlightDetails
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.validation.validation import Validation
from swashplate.validation.verification import Verification
from swashplate.validation.verify import verify


@overload
def validate(
    model: Result[Vehicle, FlightDetails],
    flights: Flight | Iterable[Flight],
    *,
    published: Vehicle | None = None,
    horizons: Sequence[float] = HORIZONS,
    every: float = 0.1,
    calibration: float = CALIBRATION,
    close_loop: Sequence[str] = (),
    draws: Sequence[Vehicle] = (),
    outputs: Sequence[str] | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> Validation: ...


@overload
def validate(
    model: Result[Any, Any] | Vehicle | StateSpaceModel,
    flights: Flight | Iterable[Flight],
    *,
    published: Vehicle | None = None,
    horizons: Sequence[float] = HORIZONS,
    every: float = 0.1,
    calibration: float = CALIBRATION,
    close_loop: Sequence[str] = (),
    draws: Sequence[Vehicle] = (),
    outputs: Sequence[str] | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> Validation | Verification: ...


def validate(
    model: Result[Any, Any] | Vehicle | StateSpaceModel,
    flights: Flight | Iterable[Flight],
    *,
    published: Vehicle | None = None,
    horizons: Sequence[float] = HORIZONS,
    every: float = 0.1,
    calibration: float = CALIBRATION,
    close_loop: Sequence[str] = (),
    draws: Sequence[Vehicle] = (),
    outputs: Sequence[str] | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> Validation | Verification:
    """Predict unseen flights and judge the result.

    A vehicle with the states of a rigid body, in flights whose pose was tracked, is predicted from many start points
    beside the published card and naive predictors: see `swashplate.validation.validate.validate` for what is told. Any
    other vehicle, a state-space model and transfer functions are flown along the recorded inputs; start states, shifts
    and biases are solved for.

    Args:
        model: what an identification returned, or a model.
        flights: conditioned flights that the fit has not seen.
        published: the card to compare with (None: the card that the model was identified from).
        horizons: seconds ahead.
        every: seconds between starts.
        calibration: seconds at the start of each record that tell its delays and trims.
        close_loop: axes ("yaw", "heave") whose controller also predicts in the place of the recorded command.
        draws: models that the fit cannot tell from this one (`fit.draw(39, seed=1)`), for bands of what is not known.
        outputs: channels to compare, for models that are flown along the inputs; all that both have where None.
        progress: called with the number of records done and their number.

    Returns:
        A `Validation`, or the `Verification` of a model that is flown along the inputs.

    Raises:
        FlightError: where no record is long enough, or the flights lack what the model needs.
        SwashError: for a calibration that is too short, an axis whose loop cannot be closed, draws that are too few or
            of another model, or `published` or `draws` beside a model that is flown along the inputs.
        CardError: for an identified model that does not say what it was identified from, and no `published`.
    """
    model, logs = fitted(model), as_flights(flights)
    held = model.solution if isinstance(model, Result) else model
    rigid = isinstance(held, Vehicle) and set(PREDICTED) <= set(held.state_names)
    # What flies nonlinear vehicles compiles; linear models need none of it, and it takes a second to import.
    if rigid and outputs is None:
        from swashplate.validation.validate import validate as predict_flights

        return predict_flights(
            model,
            logs,
            published=published,
            horizons=horizons,
            every=every,
            calibration=calibration,
            close_loop=close_loop,
            draws=draws,
            progress=progress,
        )
    if close_loop:
        raise SwashError("closes nothing: such a model is flown along the recorded inputs alone.", channel="close_loop")
    if draws:
        raise SwashError("have no bands here: such a model is flown along the recorded inputs alone.", channel="draws")
    if published is not None:
        raise SwashError(
            "is compared with nothing: such a model is flown along the recorded inputs alone.", channel="published"
        )
    return along_inputs(model, logs, outputs=outputs)


def fitted(model: Any) -> Any:
    """The fit of what an identifying verb returned as one object (`sp.fit_tf`, `sp.fit_ss`); others as they are."""
    return getattr(model, "fit", None) or model


def along_inputs(
    model: Result[Any, Any] | Vehicle | StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
) -> Verification:
    """Any model flown along recorded inputs: start states, shifts and biases are solved for.

    Args:
        model: what an identification returned, or a model. flights: conditioned. outputs: see `validate`.

    Raises:
        FlightError: an input that the flights lack, or no output that both have.
    """
    model = fitted(model)
    held = model.model if isinstance(model, Result) else model
    if isinstance(held, Vehicle) and held.structure is None:
        from swashplate.validation.vehicle_verification import verify_vehicle

        return verify_vehicle(held, flights, outputs=outputs)
    return verify(held, flights, outputs=outputs)
