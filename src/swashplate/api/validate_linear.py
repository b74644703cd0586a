"""The verb `validate_linear`: a linear model along recorded inputs, beside another model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from swashplate.api.fit_ss import Linear, linear
from swashplate.api.linear_study import LinearStudy
from swashplate.api.saying import Say, silent
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight, as_flights
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.validation.verification import Verification
from swashplate.validation.verify import verify_inside


def validate_linear(
    model: Linear,
    flights: Flight | Iterable[Flight],
    *,
    published: Vehicle | None = None,
    band: tuple[float, float] | None = None,
    rate: float = 100.0,
    cutoff: float = 0.0,
    names: Mapping[str, str] | None = None,
    say: Say = silent,
) -> LinearStudy:
    """Fly a linear model along each flight's inputs, biases and shifts solved for, and judge it.

    Args:
        model: a file, a ready structure's name, or a linear model.
        flights: as logged, that the fit has not seen.
        published: what it is compared with: another linear model, or a vehicle that flies linearised in hover.
        band: limits [Hz] that the model was fitted over; the verdict is on them.
        rate, cutoff, names: how flights are brought to one rate, see `uniform_records`.
        say: told what is being done.

    Raises:
        FlightError: an input that the flights lack, or no output that model and flights share.
    """
    identified, raw = linear(model), as_flights(flights)
    compared = None if published is None else _other(published)
    say("flying the model along the inputs")

    def along(one: StateSpaceModel) -> Verification:
        flown = uniform_records(raw, one.inputs, rate=rate, cutoff=cutoff, names=names, also=one.outputs)
        return verify_inside(one, flown, band=band)

    verification, rival = along(identified), None if compared is None else along(compared)
    return LinearStudy(ResponseMaterial(verification=verification, rival=rival), structure=identified)


def _other(vehicle: Vehicle) -> StateSpaceModel:
    """What an identified model is compared with: another model, or a vehicle linearised in hover."""
    if vehicle.structure is not None:
        return vehicle.structure
    from swashplate.identification.time.linearised_model import model_of
    from swashplate.simulation.linearize import linearize

    return model_of(linearize(vehicle), name=f"{vehicle.name}, linearised in hover")
