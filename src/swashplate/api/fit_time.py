"""The verb `fit_time`: a state-space model from records in time, verified on others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from swashplate.api.fit_ss import Linear, linear, with_given
from swashplate.api.linear_study import LinearStudy, marked
from swashplate.api.saying import Say, silent
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.identification.core import stopping
from swashplate.identification.identify import identify
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.validation.verify import verify


def fit_time(
    model: Linear,
    flights: Flight | Iterable[Flight],
    *,
    method: str = "output-error",
    outputs: Sequence[str] | None = None,
    biases: Sequence[str] = (),
    shifts: bool = True,
    start: Mapping[str, float] | None = None,
    fixed: Mapping[str, float] | None = None,
    iterations: int = 80,
    gusts: str | None = None,
    horizon: Sequence[float] | None = None,
    hold_out: Flight | Iterable[Flight] = (),
    rate: float = 100.0,
    cutoff: float = 0.0,
    names: Mapping[str, str] | None = None,
    say: Say = silent,
) -> LinearStudy:
    """Fit a state-space model, delays included, to records in time by maximum likelihood, and verify it on others.

    Args:
        model: a file with start values, a ready structure's name, or a linear model.
        flights: as logged.
        method: "output-error"; in gusts "filter-error" (a gain made of the noise) or "prediction-error" (a free gain).
        outputs: channels to fit; all of the model's where None.
        biases: outputs with a constant of their own in each record. shifts: constants in the states' rates.
        start: start values by name. fixed: values of parameters that are held.
        iterations: at most this many.
        gusts: "white" (None) or "lasting", of filter error: see `identify`.
        horizon: (FIRST, LAST) seconds ahead of errors to make small after maximum likelihood, see `identify`.
        hold_out: flights as logged, to verify on; without them the records of the fit are shown, and marked as such.
        rate, cutoff, names: how flights are brought to one rate, see `uniform_records`.
        say: told what is being done.

    Raises:
        CardError: a name that the model does not have, or a value outside its bounds.
        FlightError: a flight without the model's channels.
        IdentificationError: where no fit can be started.
    """
    begun = linear(model)
    wanted = tuple(outputs or begun.outputs)
    begun, channels = with_given(begun, start, fixed), (*begun.inputs, *wanted)
    records = uniform_records(flights, channels, rate=rate, cutoff=cutoff, names=names)
    say("fitting")
    with stopping.kept():
        fit = identify(
            begun,
            records,
            outputs=wanted,
            shifts=shifts,
            biases=biases,
            method=method,
            iterations=iterations,
            gusts=gusts,
            horizon=horizon,
            progress=lambda i, cost: say("fitting", note=f"iteration {i}, cost {cost:.5g}"),
        )
    fit = stopping.told(fit)
    say("flying the model")
    unseen = uniform_records(hold_out, channels, rate=rate, cutoff=cutoff, names=names) or records
    verification = marked(verify(fit.solution, unseen, outputs=wanted), fit.settings["records"])
    material = ResponseMaterial(time_fit=fit, verification=verification)
    return LinearStudy(material, structure=fit.solution)
