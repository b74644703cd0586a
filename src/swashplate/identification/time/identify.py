"""From flights to an identified helicopter, with everything that a reader needs to trust it or not."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight
from swashplate.identification.core import accuracy, stopping
from swashplate.identification.core.delay_restarts import minimise_over_valleys
from swashplate.identification.core.low_passed import noise_too_small, refuse_lowpassed, smoothed_outputs
from swashplate.identification.core.multi_step import TWICE, Horizon, MultiStepErrors, told_horizon
from swashplate.identification.core.parameters import FROM_CARD, Parameterization, parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.result import APART, Estimate, Fitted, Result, correlation_of
from swashplate.identification.core.scoring import Optimum, Progress, minimise
from swashplate.identification.core.sources import sources_of
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time import feedback, nelder_mead
from swashplate.identification.time.belonging import unrelated
from swashplate.identification.time.estimates import LAGS, Found, constants, estimates_of, found_at
from swashplate.identification.time.flight_details import AxisExcitation, FlightDetails
from swashplate.identification.time.following_error import FollowingError
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.identification.time.output_error import OutputError
from swashplate.identification.time.prediction_error import SETTLING, PredictionError, in_wind
from swashplate.identification.time.residual_fit import fit_residual
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.compilation import enable_compilation_cache
from swashplate.simulation.dynamics import enable_double_precision
from swashplate.simulation.record import monitored

ITERATIONS = 60
"""At most, where nothing is said."""

_FOLLOWING = 0.2
"""A gain in log-likelihood that is too small to go on for, where an iteration takes seconds."""

_BEGIN = 1.0
"""The same for a search that another goes on from."""

FlightLikelihood = PredictionError | OutputError
LikelihoodOf = Callable[[Parameterization, Sequence[Record], Question], FlightLikelihood]
Search = Callable[[FlightLikelihood, int, Progress | None], Optimum]


def identify_flight(
    vehicle: Vehicle,
    flights: Sequence[Flight],
    question: Question,
    *,
    method: str,
    likelihood_of: LikelihoodOf,
    search: Search,
) -> Result[Vehicle, FlightDetails]:
    """Identify a helicopter whose pose was tracked.

    Args:
        vehicle: the equations and the card to start from.
        flights: conditioned; each unbroken piece is a record with its own delays, trims and lever arm.
        question: what is asked.
        method: its name.
        likelihood_of: makes the likelihood of records.
        search: finds its optimum.

    Raises:
        IdentificationError, FlightError: see `identify`.
    """
    horizon = None if question.horizon is None else Horizon.of(question.horizon)
    free = "full" if question.free is None else question.free
    flights = [monitored(flight, vehicle) for flight in flights]
    enable_double_precision()
    enable_compilation_cache()
    started = time.perf_counter()
    refuse_lowpassed(flights)
    table = parameterize(
        vehicle,
        free,
        ties=question.ties,
        fixed=question.fixed,
        priors=question.priors,
        prior_card=question.prior_card,
    )
    pieces = _long_enough(records(flights, vehicle, outputs=question.outputs))
    axes = tuple(
        axis for piece in pieces for axis in feedback.excitation(vehicle, piece, measured_states(piece, Nuisance()))
    )
    notes = [] if axes else [_UNJUDGED]
    if method == "prediction-error" and not question.keep_unexcited:
        table, held = hold_unexcited(table, axes)
        notes += held
    likelihood = likelihood_of(table, pieces, question)
    where = ", ".join(piece.name for piece in pieces)
    likelihood.refresh(likelihood.row.starts())
    accuracy.refuse_unseen(likelihood.row, _quick(likelihood).scores(likelihood.row.starts())[2], where=where)
    most = ITERATIONS if question.iterations is None else question.iterations
    optimum = search(likelihood, most, question.progress)
    found, row = _found(table, likelihood, optimum, horizon, most, question.progress)
    optimum, parameters, problems = found.optimum, *estimates_of(found, vehicle)
    problems += [*smoothed_outputs(pieces, flights), *noise_too_small(likelihood.noise_of(row), flights)]
    if isinstance(likelihood, PredictionError):  # output error weighs residuals by their own size: nothing to compare
        apart = unrelated(lambda others: _quick(likelihood_of(table, others, question)).cost(row), pieces)
        problems += [apart] if apart else []
    notes += [
        f"{e.name}: the flight is {e.disagreement:+.1f} sigmas from the prior card"
        for e in parameters
        if e.prior_source.startswith(FROM_CARD) and abs(e.disagreement) > APART
    ]
    identified = _identified(
        found, likelihood.noise_of(row), likelihood.nuisance_of(row), vehicle, parameters, pieces, method
    )
    settings: dict[str, Any] = {}
    if question.residual and not problems:
        assert isinstance(likelihood, PredictionError)  # no other estimator takes a residual
        nuisances = [Nuisance(*numbers.nuisance.tolist()) for numbers in likelihood.numbers(row)]
        residual = fit_residual(identified, pieces, nuisances, likelihood.noise_of(row), horizon=horizon)
        wanders = {"noise": {k: float(v) for k, v in residual.noise._asdict().items()}}
        card = residual.vehicle.card
        identified = residual.vehicle.with_card(replace(card, observer={**card.observer, **wanders}))
        settings = {"residual": residual.told}
        notes.append(residual.words)
    told = constants(found)
    if vehicle.traits.balance is not None:
        trims = {name: [c.value for c in told if c.name == name] for name in {c.name for c in told}}
        notes += vehicle.traits.balance(
            vehicle, identified, {name: sum(values) / len(values) for name, values in trims.items()}
        )
    return Result(
        method=method,
        solution=identified,
        start=vehicle,
        estimates=parameters,
        constants=told,
        noise=likelihood.noise_of(row),
        nuisance=likelihood.nuisance_of(row),
        names=table.names,
        covariance=found.scaled(found.plain),
        covariance_corrected=found.scaled(found.corrected),
        correlation=correlation_of(found.scaled(found.plain)),
        directions=accuracy.blind_directions(
            table.names, accuracy.marginal_information(optimum.information, found.prior, found.places)
        ),
        details=FlightDetails(axes),
        history=optimum.history,
        converged=optimum.converged,
        problems=(*problems, *notes, *(() if optimum.converged else (stopping.unfinished(),))),
        failed=bool(problems),
        comparisons=likelihood.comparisons(row),
        data=sources_of(flights),
        fitted=Fitted(likelihood, optimum.row) if horizon is None else None,
        seconds=time.perf_counter() - started,
        settings={
            "method": method,
            "choice": free if isinstance(free, str) else "given",
            "free": list(table.names),
            "ties": [f"{name} = {expression.text}" for name, expression in table.ties],
            "held at the prior card": list(table.held),
            **({"constants of every record": [f.name for f in table.of_records]} if table.of_records else {}),
            **({"noise of its own": list(table.noises)} if table.noises else {}),
            **told_horizon(horizon),
            **settings,
            "outputs": list(pieces[0].output_names),
            "wind": question.wind,
            "rate": 1.0 / pieces[0].dt,
            "records": [piece.name for piece in pieces],
            "voltage": "logged" if all(piece.voltage_known for piece in pieces) else "not logged: card's nominal",
        },
    )


@dataclass(frozen=True)
class FlightEstimator:
    """An estimator of helicopters whose pose was tracked: a likelihood and a search."""

    method: str
    takes: frozenset[str]
    likelihood_of: LikelihoodOf
    search: Search

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        if isinstance(data, FrequencyResponse):
            return "it fits records in time"
        if not isinstance(model, Vehicle):
            return "it fits vehicles"
        lacking = [name for name in PREDICTED if name not in model.state_names]
        lacking += [] if model.traits.axes or "lateral" in model.input_names else ["axes that its inputs drive"]
        return f"it fits helicopters, and the vehicle lacks {', '.join(lacking)}" if lacking else ""

    def estimate(self, model: Vehicle, data: Sequence[Flight], question: Question) -> Result[Vehicle, FlightDetails]:
        return identify_flight(
            model, data, question, method=self.method, likelihood_of=self.likelihood_of, search=self.search
        )


def _prediction_error(table: Parameterization, pieces: Sequence[Record], question: Question) -> PredictionError:
    return FollowingError(table, pieces, noise=in_wind(pieces)) if question.wind else PredictionError(table, pieces)


def _output_error(table: Parameterization, pieces: Sequence[Record], question: Question) -> OutputError:
    del question
    return OutputError(table, pieces)


def _quick(likelihood: FlightLikelihood) -> FlightLikelihood:
    """What a search may begin with: the same row with less work."""
    return likelihood.constant if isinstance(likelihood, PredictionError) else likelihood


def _scoring(likelihood: FlightLikelihood, iterations: int, progress: Progress | None) -> Optimum:
    quick = _quick(likelihood)
    if quick is likelihood:
        return minimise_over_valleys(likelihood, iterations=iterations, progress=progress)
    first = minimise_over_valleys(quick, iterations=iterations, tolerance=_BEGIN, progress=progress)
    done = len(first.history) - 1
    last = minimise(
        likelihood, start=first.row, iterations=iterations, tolerance=_FOLLOWING, progress=_after(done, progress)
    )
    return replace(last, history=(*first.history, *last.history[1:]))


def _after(done: int, progress: Progress | None) -> Progress | None:
    return progress and (lambda iteration, cost: progress(done + iteration, cost))


def _scoring_together(likelihood: FlightLikelihood, iterations: int, progress: Progress | None) -> Optimum:
    return minimise_over_valleys(likelihood, iterations=iterations, together=True, progress=progress)


def _simplex(likelihood: FlightLikelihood, iterations: int, progress: Progress | None) -> Optimum:
    del iterations
    assert isinstance(likelihood, OutputError)
    return nelder_mead.minimise_squares(likelihood, progress=progress)


_TAKES = frozenset({"free", "ties", "fixed", "priors", "prior_card", "outputs", "iterations", "progress"})
PREDICTION_ERROR = FlightEstimator(
    "prediction-error", _TAKES | {"keep_unexcited", "wind", "horizon", "residual"}, _prediction_error, _scoring
)
OUTPUT_ERROR = FlightEstimator("output-error", _TAKES | {"keep_unexcited"}, _output_error, _scoring_together)
NELDER_MEAD = FlightEstimator("nelder-mead", _TAKES | {"keep_unexcited"}, _output_error, _simplex)

SHORTEST = 6.0
"""Seconds below which a piece is left out: the filter settles in a quarter of that."""


def _long_enough(pieces: list[Record]) -> list[Record]:
    kept = [piece for piece in pieces if piece.time[-1] - piece.time[0] >= SHORTEST]
    if not kept:
        longest = max(piece.time[-1] - piece.time[0] for piece in pieces)
        raise IdentificationError(
            f"the longest unbroken piece has {longest:.1f} s, expected at least {SHORTEST:g} s.",
            where=pieces[0].name,
            hint="Bridge longer gaps with a larger max_gap, or fly longer.",
        )
    return kept


_UNJUDGED = "the model names no axes: whether the flights move each by itself was not judged"


def hold_unexcited(table: Parameterization, axes: Sequence[AxisExcitation]) -> tuple[Parameterization, list[str]]:
    """Fix what only unexcited axes could tell, at its prior where it has one."""
    notes = []
    for axis in table.vehicle.traits.axes:
        judged = [item for item in axes if item.axis == axis.name]
        held = [item for item in table.free if item.name in axis.parameters]
        if not held or any(item.identifiable for item in judged):
            continue
        at = {item.name: item.start if item.mean is None else item.mean for item in held}
        table = replace(
            table.without(at), vehicle=table.vehicle.with_values({k: v for k, v in at.items() if v is not None})
        )
        notes.append(f"{', '.join(at)} held: {judged[0].words}")
    return table, notes


def _found(
    table: Parameterization,
    likelihood: FlightLikelihood,
    optimum: Optimum,
    horizon: Horizon | None,
    iterations: int,
    progress: Progress | None,
) -> tuple[Found, Array]:
    """What the search says, or the search for small errors ahead that follows it; and the likelihood's whole row."""
    lags = round(LAGS / likelihood.model.dt)
    first = found_at(table, likelihood, optimum, logs=likelihood.logs, lags=lags)
    if horizon is None:
        return first, optimum.row
    assert isinstance(likelihood, PredictionError)  # no other estimator takes a horizon
    criterion = MultiStepErrors(
        likelihood, optimum.row, likelihood.pieces, horizon=horizon, settling=SETTLING, known=first.corrected
    )
    ahead = minimise(criterion, start=criterion.start, iterations=iterations, progress=progress)
    ahead = replace(ahead, converged=ahead.converged and optimum.converged)
    found = found_at(table, criterion, ahead, logs=likelihood.logs, lags=criterion.lags)
    return replace(found, corrected=TWICE * found.corrected), criterion.whole(ahead.row)


def _identified(
    found: Found,
    noise: Noise | None,
    nuisance: Nuisance,
    vehicle: Vehicle,
    estimates: Sequence[Estimate],
    pieces: Sequence[Record],
    method: str,
) -> Vehicle:
    """The identified vehicle: the card with the new numbers, where they come from, and what the observer needs."""
    sources = ", ".join(piece.name for piece in pieces)
    card = found.table.vehicle.card
    for estimate in estimates:
        card = card.with_values(
            {estimate.name: estimate.value},
            status="identified",
            sigma=estimate.sigma_corrected,
            source=f"identified by {method} from {sources}",
        )
    changed = {
        name: parameter.value
        for name, parameter in card.parameters.items()
        if parameter.status != "identified"
        and name not in found.table.held
        and parameter.value != vehicle.card.parameters[name].value
    }
    card = card.with_values(changed, status="assumed", source="held during the identification")
    started = vehicle.card.parameters
    moved = {name for name, entry in card.parameters.items() if entry.value != started[name].value}
    card = replace(
        card,
        parameters={
            name: replace(entry, before=started[name].value if name in moved else None)
            for name, entry in card.parameters.items()
        },
    )
    observer = {"nuisance": {k: float(v) for k, v in nuisance._asdict().items()}}
    if found.table.of_records:
        observer["trims"] = {f.name: 0.05 if f.sigma is None else f.sigma for f in found.table.of_records}
    if noise is not None:
        observer["noise"] = {k: float(v) for k, v in noise._asdict().items()}
    card = replace(card, title=f"{vehicle.card.title}, identified from {sources}", observer=observer, path="")
    return found.table.vehicle.with_card(card)
