"""The verb `fit_ss`: a state-space model from frequency responses, verified in time on what the fit has not seen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from swashplate.api.gains import suggest_gains
from swashplate.api.linear_study import LinearStudy, marked
from swashplate.api.saying import Say, silent
from swashplate.errors import CardError, SwashError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.identification.core import stopping
from swashplate.identification.frequency.fitted_pairs import PairChoice
from swashplate.identification.frequency.response_names import under_names_of
from swashplate.identification.frequency.search_candidates import WIDEST, parameter_names
from swashplate.identification.frequency.start_values import at_flown_trim, from_linear_model, from_models
from swashplate.identification.frequency.state_space_fit import fit_state_space, unmoved_inputs
from swashplate.identification.frequency.structure_search import search_structures
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import is_state_space, structure
from swashplate.models.vehicle import Vehicle
from swashplate.registry import nearest
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.simulation.linearize import linearize
from swashplate.validation.structure_reduction import reduce as reduced
from swashplate.validation.verify import verify, verify_inside

Linear: TypeAlias = Vehicle | StateSpaceModel | str | Path
"""A linear model, or its name or file."""


def linear(model: Linear) -> StateSpaceModel:
    """What a linear model is made of, by its name or file too."""
    return structure(model) if isinstance(model, str | Path) else structure_of(model)


def fit_ss(
    model: Linear | Sequence[Linear] | None,
    responses: FrequencyResponse,
    *,
    search: bool = False,
    start: Mapping[str, float] | None = None,
    start_from: str | Path | Vehicle | Sequence[str | Path] | None = None,
    fixed: Mapping[str, float] | None = None,
    band: tuple[float, float] | None = None,
    bands: Mapping[str, tuple[float, float]] | None = None,
    without: Sequence[str] = (),
    least_coherence: float = 0.6,
    reduce: bool = False,
    starts: int = 4,
    seed: int = 0,
    gains: bool = False,
    hold_out: Flight | Iterable[Flight] = (),
    rate: float = 100.0,
    cutoff: float = 0.0,
    names: Mapping[str, str] | None = None,
    say: Say = silent,
) -> LinearStudy:
    """Fit a state-space model, with accuracy figures, and verify it in time on flights that the fit has not seen.

    Args:
        model: a ready structure's name, "compose:body+flap+...", a file, or a linear model; for a search several of
            them, or None for composed ones that the channels allow.
        responses: from `respond`.
        search: fit several structures, drop the hopeless early, and pick the one that is worth its parameters; with
            hold-outs, of those that the responses hardly tell apart the one that follows them best.
        start: start values by name.
        start_from: a vehicle, whose linearisation in hover gives start values, or folders or files of `fit_tf`.
        fixed: values of parameters that are held.
        band: limits [Hz] of all pairs. bands: of some, by "output/input", input or output.
        without: pairs that are not fitted, by the same names.
        least_coherence: from which a response is used.
        reduce: take out what the responses do not tell (Tischler and Remple 2012, ch. 13).
        starts: starting points that are followed. seed: of them.
        gains: also suggest ArduPilot rate-loop gains.
        hold_out: flights as logged, to verify on.
        rate, cutoff: how they are brought to one rate, see `uniform_records`.
        names: the channel of responses and flights by the model's name, where they call it otherwise; what the
            responses know already need not be given.
        say: told what is being done.

    Raises:
        CardError: a name that the model does not have, or a value outside its bounds.
        IdentificationError: channels that do not meet, no coherent response, parameters without a trace.
        FlightError: a hold-out flight without the model's channels.
        SwashError: several models, or none, without a search; a search that is to start from something.
    """
    if search and start_from is not None:
        raise SwashError("a search takes no start values from elsewhere.", channel="start_from")
    given = [linear(one) for one in _listed(model)]
    if not search and len(given) != 1:
        raise SwashError(
            "a fit takes one structure.",
            channel="structure",
            hint="Name one (compose:body+flap, see `swash vehicle structures`), or let --search find it.",
        )
    begun = given[0] if given else structure(WIDEST)
    responses, remarks = under_names_of(begun, responses, names)
    if start_from is not None:
        say("finding start values")
        begun = _started(begun, start_from, responses, seed=seed)
    wanted = (
        *(name for name in begun.inputs if not search or name in responses.inputs),
        *(name for name in begun.outputs if name in responses.outputs),
    )
    called = {**responses.settings.get("channels", {}), **(names or {})}
    flights = uniform_records(hold_out, wanted, rate=rate, cutoff=cutoff, names=called)
    choice = PairChoice(band, bands or {}, tuple(without), least_coherence)
    searched = None
    if search:
        _check_names(given, {*(start or {}), *(fixed or {})})
        searched = search_structures(
            responses,
            structures=given,
            choice=choice,
            prepare=lambda one: with_given(
                at_flown_trim(one, responses).with_unmoved(unmoved_inputs(responses)),
                *(_own(one, n) for n in (start, fixed)),
            ),
            judge=(lambda one: _held_out(one, flights, band)) if flights else None,
            seed=seed,
            say=lambda text: say("trying structures", note=text),
        )
        fit = searched.pick.fit
    else:
        begun = with_given(at_flown_trim(begun, responses), start, fixed)
        say("fitting")
        with stopping.kept():
            fit = fit_state_space(
                begun,
                responses,
                band=band,
                bands=bands,
                without=without,
                least_coherence=least_coherence,
                starts=starts,
                seed=seed,
                progress=lambda i, cost: say("fitting", note=f"iteration {i}, cost {cost:.5g}"),
            )
    fit, whole = stopping.told(fit), fit
    if reduce and fit is whole:  # there is nothing to take out of what was stopped
        fit = reduced(
            fit, hold_out=flights, progress=lambda i, cost: say("reducing", note=f"step {i}, J_ave {cost:.4g}")
        )
    verification = None
    if flights:
        say("flying the model along what the fit has not seen")
        verification = marked(verify_inside(fit.solution, flights, band=band), responses.sources)
    advice = suggest_gains(fit, responses, unseen=verification) if gains else ()
    material = ResponseMaterial(responses, fit=fit, search=searched, verification=verification, gains=advice)
    return LinearStudy(material, structure=fit.solution, remarks=remarks)


def _listed(model: Linear | Sequence[Linear] | None) -> Sequence[Linear]:
    if model is None:
        return ()
    return (model,) if isinstance(model, Vehicle | StateSpaceModel | str | Path) else tuple(model)


def _own(model: StateSpaceModel, values: Mapping[str, float] | None) -> dict[str, float]:
    """Of given values those that a structure has; in a search not each has each."""
    return {name: value for name, value in (values or {}).items() if name in model.parameters}


def _check_names(given: Sequence[StateSpaceModel], names: set[str]) -> None:
    known = {name for one in given for name in one.parameters} or parameter_names()
    if unknown := sorted(names - known):
        raise CardError(
            "is no parameter of any structure of this search.", channel=unknown[0], hint=nearest(unknown[0], known)
        )


def _held_out(model: StateSpaceModel, flights: Sequence[Flight], band: tuple[float, float] | None) -> float:
    """J_rms along what no fit has seen, within the band where there is one."""
    seen = verify(model, flights, band=band)
    return seen.cost


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


def _started(
    model: StateSpaceModel,
    source: str | Path | Vehicle | Sequence[str | Path],
    responses: FrequencyResponse,
    *,
    seed: int,
) -> StateSpaceModel:
    """The model with start values from fitted transfer functions (files or their folders) or from a vehicle."""
    if isinstance(source, Vehicle):
        return _from_hover(model, source)
    given = (source,) if isinstance(source, str | Path) else tuple(source)
    places = [Path(name) / "model.toml" if Path(name).is_dir() else Path(name) for name in given]
    if places and all(is_state_space(str(place)) for place in places):
        return from_models(model, [structure(str(place)) for place in places], responses, seed=seed)
    return _from_hover(model, vehicle(",".join(map(str, given))))


def _from_hover(model: StateSpaceModel, source: Vehicle) -> StateSpaceModel:
    """With the start values that a vehicle has, linearised in hover."""
    return from_linear_model(model, linearize(source))
