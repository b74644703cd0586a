"""Linear models from responses and from records in time, and along flights: verified on what no fit has seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from swashplate.api.asking import strings
from swashplate.api.gains import suggest_gains
from swashplate.api.linear_study import LinearStudy, marked
from swashplate.api.saying import Say
from swashplate.api.verbs.respond import load_responses
from swashplate.control.analysis.rate_gain_names import ARDUPILOT
from swashplate.errors import CardError, IdentificationError, SwashError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.identification.core import stopping
from swashplate.identification.core.result import Result
from swashplate.identification.frequency.fitted_pairs import PairChoice
from swashplate.identification.frequency.handling_readings import handling_lines, margin_lines
from swashplate.identification.frequency.response_names import under_names_of
from swashplate.identification.frequency.search_candidates import WIDEST, parameter_names
from swashplate.identification.frequency.start_values import at_flown_trim, from_linear_model, from_models
from swashplate.identification.frequency.state_space_fit import fit_state_space, unmoved_inputs
from swashplate.identification.frequency.structure_search import search_structures
from swashplate.identification.frequency.transfer_function_fit import as_state_space, fit_transfer_function
from swashplate.identification.frequency.transfer_function_forms import BAND, TriedStructure, suggest
from swashplate.identification.identify import identify
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.linearised_model import model_of
from swashplate.identification.time.record_fit import TimeDetails
from swashplate.models.catalogue import vehicle as find
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import is_state_space, structure
from swashplate.models.vehicle import Vehicle
from swashplate.registry import nearest
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.simulation.linearize import linearize
from swashplate.validation.structure_reduction import reduce
from swashplate.validation.verification import Verification
from swashplate.validation.verify import verify, verify_inside

if TYPE_CHECKING:
    from swashplate.api.verbs.identify import FitInTime, FitStateSpace, FitTransferFunctions, LinearFit
    from swashplate.api.verbs.validate import Validate


# ---- from responses --------------------------------------------------------------------------------------------------
def transfer_functions(asked: FitTransferFunctions, say: Say) -> LinearStudy:
    """Transfer functions, verified in time where they can be flown."""
    responses = load_responses(asked.responses)
    input = asked.input or _only_input(responses)
    outputs = strings(asked.outputs) or (_rate_of(input, responses) if asked.gains else None)
    band, apart = asked.split_band()
    if apart:
        raise SwashError("takes one band for transfer functions.", channel="--band")
    unseen = asked.read(asked.hold_out)
    say("fitting")
    trials: tuple[TriedStructure, ...] = ()
    if asked.form is None and not asked.fix:
        best, trials = suggest(
            responses,
            input=input,
            outputs=outputs,
            band=band,
            least_coherence=asked.coherence,
            tell=lambda done, total: say("fitting", done=done, total=total),
        )
        fit, band = best.fit, best.fit.settings.get(BAND, band)
    else:
        fit = fit_transfer_function(
            responses,
            asked.form or "1/2",
            input=input,
            outputs=outputs,
            band=band,
            fixed=asked.fix,
            least_coherence=asked.coherence,
        )
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
        flights = _uniform(asked, unseen, (*model.inputs, *model.outputs), responses)
        verification = marked(verify_inside(model, flights, band=band), responses.sources)
    advice = suggest_gains(fit, responses, unseen=verification) if asked.gains else ()
    measured = responses.select(tuple(m.output for m in fit.solution), (input,))
    read = (*margin_lines(responses, fit, fit.targets), *handling_lines(measured, (fit,))) if asked.margins else ()
    material = ResponseMaterial(measured, (fit,), trials, verification=verification, gains=advice)
    return LinearStudy(material, margins=read, structure=model, remarks=remarks)


def state_space(asked: FitStateSpace, say: Say) -> LinearStudy:
    """A state-space model, verified in time on flights that the fit has not seen.

    With hold-outs a search takes, of the structures that the responses hardly tell apart, the one that follows best.
    """
    if asked.search and asked.start_from is not None:
        raise SwashError("a search takes no start values from elsewhere.", channel="start_from")
    given = list(asked.structures())
    if not asked.search and len(given) != 1:
        raise SwashError(
            "a fit takes one structure.",
            channel="structure",
            hint="Name one (compose:body+flap, see `swash vehicle structures`), or let --search find it.",
        )
    begun = given[0] if given else structure(WIDEST)
    responses, remarks = under_names_of(begun, load_responses(asked.responses), _names(asked))
    if asked.start_from is not None:
        say("finding start values")
        begun = _started(begun, asked.start_from, responses, seed=asked.seed)
    wanted = (
        *(name for name in begun.inputs if not asked.search or name in responses.inputs),
        *(name for name in begun.outputs if name in responses.outputs),
    )
    flights = _uniform(asked, asked.read(asked.hold_out), wanted, responses)
    band, apart = asked.split_band()
    choice = PairChoice(band, apart, strings(asked.without), asked.coherence)
    searched = None
    if asked.search:
        _check_names(given, {*(asked.start or {}), *(asked.fix or {})})
        searched = search_structures(
            responses,
            structures=given,
            choice=choice,
            prepare=lambda one: with_given(
                at_flown_trim(one, responses).with_unmoved(unmoved_inputs(responses)),
                *(_own(one, n) for n in (asked.start, asked.fix)),
            ),
            judge=(lambda one: verify(one, flights, band=band).cost) if flights else None,
            seed=asked.seed,
            say=lambda text: say("trying structures", note=text),
        )
        fit = searched.pick.fit
    else:
        begun = with_given(at_flown_trim(begun, responses), asked.start, asked.fix)
        say("fitting")
        with stopping.kept():
            fit = fit_state_space(
                begun,
                responses,
                band=band,
                bands=apart,
                without=choice.without,
                least_coherence=asked.coherence,
                starts=asked.starts,
                seed=asked.seed,
                progress=_iterations(say),
            )
    fit, whole = stopping.with_stop(fit), fit
    if asked.reduce and fit is whole:  # there is nothing to take out of what was stopped
        fit = reduce(
            fit, hold_out=flights, progress=lambda i, cost: say("reducing", note=f"step {i}, J_ave {cost:.4g}")
        )
    verification = None
    if flights:
        say("flying the model along what the fit has not seen")
        verification = marked(verify_inside(fit.solution, flights, band=band), responses.sources)
    advice = suggest_gains(fit, responses, unseen=verification) if asked.gains else ()
    material = ResponseMaterial(responses, fit=fit, search=searched, verification=verification, gains=advice)
    return LinearStudy(material, structure=fit.solution, remarks=remarks)


# ---- in time ---------------------------------------------------------------------------------------------------------
def in_time(asked: FitInTime, say: Say) -> LinearStudy:
    """A state-space model from records in time, verified on others."""
    (begun,) = asked.structures()
    wanted = strings(asked.outputs) or tuple(begun.outputs)
    begun, channels = with_given(begun, asked.start, asked.fix), (*begun.inputs, *wanted)
    records = _uniform(asked, asked.read(asked.flight), channels)
    unread = asked.read(asked.hold_out)
    say("fitting")
    with stopping.kept():
        result = identify(
            begun,
            records,
            progress=_iterations(say),
            **asked.to_estimators() | {"outputs": wanted, "fix": None},
        )
    fit = cast(Result[StateSpaceModel, TimeDetails], stopping.with_stop(result))
    say("flying the model")
    unseen = _uniform(asked, unread, channels) or records
    verification = marked(verify(fit.solution, unseen, outputs=wanted), fit.settings["records"])
    material = ResponseMaterial(time_fit=fit, verification=verification)
    return LinearStudy(material, structure=fit.solution)


def along_flights(asked: Validate, model: StateSpaceModel, published: Vehicle | None) -> Verification:
    """A linear model along each flight's inputs, biases and shifts solved for, beside another one."""
    raw = asked.read(asked.flight)

    def followed(one: StateSpaceModel) -> Verification:
        flown = asked.uniform(asked.flight, raw, one.inputs, names=_names(asked), also=one.outputs)
        return verify_inside(one, flown, band=asked.band)

    if published is None:
        return followed(model)
    other = published.structure or model_of(linearize(published), name=f"{published.name}, linearised in hover")
    return replace(followed(model), other=followed(other))


def _only_input(responses: FrequencyResponse) -> str:
    """The input where nobody named one and there is no other.

    Raises:
        SwashError: naming those that there are.
    """
    if len(responses.inputs) > 1:
        raise SwashError(
            "is missing.",
            channel="--input",
            hint=f"The responses have --input {' or '.join(responses.inputs)}; --structure compose:body+flap fits a "
            "state-space model of all.",
        )
    return responses.inputs[0]


def _rate_of(input: str, responses: FrequencyResponse) -> tuple[str, ...] | None:
    """The rate that an autopilot's mixer moves by a command: what gains are for. None where it is not known."""
    rates = [rate for rate, command in ARDUPILOT.values() if command == input and rate in responses.outputs]
    return tuple(rates) or None


# ---- names, start values ---------------------------------------------------------------------------------------------
def _names(asked: LinearFit[Any] | Validate) -> Mapping[str, str]:
    return asked.rename or {}  # pyrefly: ignore[bad-return]


def _uniform(
    asked: LinearFit[Any],
    flights: Sequence[Flight],
    channels: Sequence[str],
    responses: FrequencyResponse | None = None,
) -> tuple[Flight, ...]:
    """Flights at one rate, with the log's channels behind the model's names as the responses remember them."""
    known = {} if responses is None else responses.settings.get("channels", {})
    return uniform_records(flights, channels, rate=asked.rate, cutoff=asked.cutoff, names={**known, **_names(asked)})


def _iterations(say: Say) -> Callable[[int, float], None]:
    return lambda i, cost: say("fitting", note=f"iteration {i}, cost {cost:.5g}")


def _own(model: StateSpaceModel, values: Mapping[str, float] | None) -> dict[str, float]:
    """Of given values those that a structure has; in a search not each has each."""
    return {name: value for name, value in (values or {}).items() if name in model.parameters}


def _check_names(given: Sequence[StateSpaceModel], names: set[str]) -> None:
    known = {name for one in given for name in one.parameters} or parameter_names()
    if unknown := sorted(names - known):
        raise CardError(
            "is no parameter of any structure of this search.", channel=unknown[0], hint=nearest(unknown[0], known)
        )


def with_given(
    model: StateSpaceModel, start: Mapping[str, float] | None, fixed: Mapping[str, float] | None
) -> StateSpaceModel:
    """The model with start values and, held, fixed ones.

    Raises:
        CardError: a name that the model does not have, or a value outside its bounds.
    """
    given = model.with_values(start or {}).with_values(fixed or {}, free=False)
    given.check_bounds((*(start or {}), *(fixed or {})))
    return given


def _started(model: StateSpaceModel, source: Any, responses: FrequencyResponse, *, seed: int) -> StateSpaceModel:
    """The model with start values from fitted transfer functions (files or their folders) or from a vehicle in hover.

    Texts may have several by commas.
    """
    if isinstance(source, Vehicle):
        return from_linear_model(model, linearize(source))
    listed = source if isinstance(source, list | tuple) else (source,)
    given = [part.strip() for one in listed for part in str(one).split(",") if part.strip()]
    places = [Path(name) / "model.toml" if Path(name).is_dir() else Path(name) for name in given]
    if places and all(is_state_space(str(place)) for place in places):
        return from_models(model, [structure(str(place)) for place in places], responses, seed=seed)
    return from_linear_model(model, linearize(find(",".join(given))))


def linear(model: Vehicle | StateSpaceModel | str | Path) -> StateSpaceModel:
    """What a linear model is made of, by its name or file too."""
    return structure(model) if isinstance(model, str | Path) else structure_of(model)
