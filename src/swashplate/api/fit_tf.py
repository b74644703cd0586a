"""The verb `fit_tf`: transfer functions from frequency responses, verified in time where they can be flown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from swashplate.api.gains import suggest_gains
from swashplate.api.linear_study import LinearStudy, marked
from swashplate.api.saying import Say, silent
from swashplate.errors import IdentificationError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.frequency.handling_readings import handling_lines, margin_lines
from swashplate.identification.frequency.transfer_function_fit import (
    as_state_space,
    fit_transfer_function,
)
from swashplate.identification.frequency.transfer_function_forms import BAND, TriedStructure, suggest
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.transfer_function import Form
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.validation.verify import verify_inside


def fit_tf(
    responses: FrequencyResponse,
    *,
    input: str,
    outputs: Sequence[str] | None = None,
    form: Form | str | None = None,
    fixed: Mapping[str, float] | None = None,
    band: tuple[float, float] | None = None,
    least_coherence: float = 0.6,
    margins: bool = False,
    gains: bool = False,
    hold_out: Flight | Iterable[Flight] = (),
    rate: float = 100.0,
    cutoff: float = 0.0,
    names: Mapping[str, str] | None = None,
    say: Say = silent,
) -> LinearStudy:
    """Fit transfer functions with a delay; without a form the usual structures are tried and one is suggested.

    Args:
        responses: from `respond`.
        input: the input channel.
        outputs: with shared poles; all where None.
        form: zeros over poles, "1/2"; "0/1+1s" has an integrator. Tried where None and nothing is fixed.
        fixed: values of parameters that are held.
        band: limits [Hz].
        least_coherence: from which a response is used.
        margins: also read margins (the responses taken as broken loops), bandwidth and phase delay of the attitude.
        gains: also suggest ArduPilot rate-loop gains.
        hold_out: flights as logged, to verify on.
        rate, cutoff, names: how they are brought to one rate, see `uniform_records`.
        say: told what is being done.

    Raises:
        IdentificationError: no coherent response, a fixed name that the form does not have, or a hold-out for a form
            that cannot be flown.
        FlightError: a hold-out flight without the model's channels.
    """
    say("fitting")
    trials: tuple[TriedStructure, ...] = ()
    if form is None and not fixed:
        best, trials = suggest(
            responses,
            input=input,
            outputs=outputs,
            band=band,
            least_coherence=least_coherence,
            tell=lambda done, total: say("fitting", done=done, total=total),
        )
        fit, band = best.fit, best.fit.settings.get(BAND, band)
    else:
        fit = fit_transfer_function(
            responses,
            form or "1/2",
            input=input,
            outputs=outputs,
            band=band,
            fixed=fixed,
            least_coherence=least_coherence,
        )
    unseen = as_flights(hold_out)
    remarks: tuple[str, ...] = ()
    model = verification = None
    try:
        model = as_state_space(fit)
    except IdentificationError as error:
        if unseen:
            raise
        remarks = (str(error),)
    if unseen and model is not None:
        say("flying the model along what the fit has not seen")
        called = {**responses.settings.get("channels", {}), **(names or {})}
        wanted = (*model.inputs, *model.outputs)
        flights = uniform_records(unseen, wanted, rate=rate, cutoff=cutoff, names=called)
        verification = marked(verify_inside(model, flights, band=band), responses.sources)
    advice = suggest_gains(fit, responses, unseen=verification) if gains else ()
    measured = responses.select(tuple(m.output for m in fit.solution), (input,))
    read = (*margin_lines(responses, fit, fit.targets), *handling_lines(measured, (fit,))) if margins else ()
    material = ResponseMaterial(measured, (fit,), trials, verification=verification, gains=advice)
    return LinearStudy(material, margins=read, structure=model, remarks=remarks)
