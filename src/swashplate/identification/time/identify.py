"""From flights to an identified helicopter, with everything that a reader needs to trust it or not."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance, mean_nuisance
from swashplate.flights.flight import Flight
from swashplate.identification.core import accuracy, stopping
from swashplate.identification.core.low_passed import (
    noise_too_small,
    refuse_lowpassed,
    smoothed_outputs,
)
from swashplate.identification.core.multi_step import TWICE, Horizon, MultiStepErrors, told_horizon
from swashplate.identification.core.parameters import FROM_CARD, Parameterization, parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.result import APART, Estimate, Fitted, Result, correlation_of
from swashplate.identification.core.scoring import Optimum, Solver, minimise, minimise_over_valleys
from swashplate.identification.core.sources import scale_words, sources_of
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time import feedback
from swashplate.identification.time.estimates import Found, constants, estimates_of, found_at
from swashplate.identification.time.feedback import FlightDetails, moving_air
from swashplate.identification.time.filter_error import SETTLING, FilterError, in_wind, unrelated
from swashplate.identification.time.following_error import FollowingError, searched
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.identification.time.linear_residual import (
    LinearResidual,
    begun,
    begun_where_it_ended,
    beside_physics,
    physics_shifts,
)
from swashplate.identification.time.output_error import OutputError
from swashplate.identification.time.record_fit import LAGS
from swashplate.identification.time.residual_fit import fit_residual
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.residual import PREFIX
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.record import monitored

ITERATIONS = 60
"""At most, where nothing is said."""

_FOLLOWING = 0.2
"""A gain in log-likelihood that is too small to go on for, where an iteration takes seconds."""

_BEGIN = 1.0
"""The same for a search that another goes on from."""

FlightLikelihood = FilterError | OutputError
L = TypeVar("L", bound=FlightLikelihood)


def identify_flight(
    vehicle: Vehicle, flights: Sequence[Flight], question: Question, *, by: FlightEstimator[L]
) -> Result[Vehicle, FlightDetails]:
    """Identify a helicopter whose pose was tracked.

    Args:
        vehicle: the equations and the card to start from.
        flights: conditioned; each unbroken piece is a record with its own delays, trims and lever arm.
        question: what is asked.
        by: the estimator.

    Raises:
        IdentificationError, FlightError: see `identify`.
    """
    horizon = _horizon(question)
    free = "full" if question.free is None else question.free
    flights = [monitored(flight, vehicle) for flight in flights]
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
    pieces = _without(pieces, question.leave_out) if question.leave_out else pieces
    axes = tuple(
        axis for piece in pieces for axis in feedback.excitation(vehicle, piece, measured_states(piece, Nuisance()))
    )
    notes = [] if axes else [feedback.UNJUDGED]
    if by.method == "filter-error" and not question.keep_unexcited:
        table, held = feedback.hold_unexcited(table, axes)
        notes += held
    likelihood = by.likelihood_of(table, pieces, question)
    where = ", ".join(piece.name for piece in pieces)
    likelihood.refresh(likelihood.row.starts())
    accuracy.refuse_unseen(likelihood.row, likelihood.constant.scores(likelihood.row.starts())[2], where=where)
    optimum = by.search(likelihood, _solver(question))
    best, row = by.conclude(table, likelihood, optimum, question)
    residual, began, k = None, vehicle, len(table.free)
    if isinstance(likelihood, FilterError) and question.residual and not estimates_of(best, vehicle)[1]:
        each = [Nuisance(*numbers) for numbers in np.array(likelihood.nuisances_of(row)).T.tolist()]
        physics, air = best.table.without(best.optimum.at_bound), likelihood.noise_of(row)
        residual = fit_residual(best.vehicle, pieces, each, air, horizon=horizon, axes=axes, physics=physics)
        if residual.kept and horizon is None:
            alone = best
            likelihood, best, row = _together(by, likelihood, row, residual, question)
            residual, began = residual.at(best.vehicle, physics_shifts(alone, best)), begun(vehicle, residual)
    optimum = best.optimum
    every, problems = estimates_of(best, began)
    parameters = tuple(estimate for estimate in every if not estimate.name.startswith(PREFIX))
    noise = likelihood.noise_of(row)
    problems += [*smoothed_outputs(pieces, flights), *noise_too_small(noise, flights)]
    if (
        isinstance(likelihood, FilterError) and noise is not None
    ):  # output error fits starts to its commands: others lose
        apart = unrelated(lambda others: likelihood.of(best.table, others).cost(row), pieces)
        problems += [apart] if apart else []
        notes += [told] if (told := moving_air(noise)) else []
    notes += [
        f"{e.name}: the flight is {e.disagreement:+.1f} sigmas from the prior card"
        for e in parameters
        if e.prior_source.startswith(FROM_CARD) and abs(e.disagreement) > APART
    ]
    nuisances = likelihood.nuisances_of(row)
    nuisance = mean_nuisance(nuisances)
    identified = _identified(best, noise, nuisance, began, every, pieces, by.method)
    identified = feedback.mark_unmoved(identified, [item.name for item in table.free], axes)
    done = "filter by" if isinstance(likelihood, FilterError) else "simulated by"
    settings: dict[str, Any] = {done: likelihood.compiled_by}
    if residual is not None:
        if residual.kept and horizon is not None:
            wanders = {"noise": {k: float(v) for k, v in residual.noise._asdict().items()}}
            entries = {**residual.vehicle.card.parameters, **identified.card.parameters}
            card = replace(identified.card, parameters=entries, observer={**identified.card.observer, **wanders})
            identified = residual.vehicle.with_card(card)
        settings["residual"] = residual.settings_entry
        notes.append(residual.summary_text)
    own, plain = constants(best), best.scaled(best.plain)[:k, :k]
    if vehicle.traits.balance is not None:
        trims = {name: [c.value for c in own if c.name == name] for name in {c.name for c in own}}
        notes += vehicle.traits.balance(
            vehicle, identified, {name: sum(values) / len(values) for name, values in trims.items()}
        )
    data = sources_of(flights)
    return Result(
        method=by.method,
        solution=identified,
        start=vehicle,
        estimates=parameters,
        constants=own,
        noise=noise,
        nuisance=nuisance,
        names=table.names,
        covariance=plain,
        covariance_corrected=best.scaled(best.corrected)[:k, :k],
        correlation=correlation_of(plain),
        directions=accuracy.blind_directions(
            table.names, accuracy.marginal_information(optimum.information, best.prior, best.places[:k])
        ),
        details=FlightDetails(axes),
        history=optimum.history,
        converged=optimum.converged,
        problems=(
            *problems,
            *scale_words(data),
            *notes,
            *(() if optimum.converged else (stopping.unfinished(),)),
        ),
        failed=bool(problems),
        comparisons=likelihood.comparisons(row),
        data=data,
        fitted=Fitted(likelihood, optimum.row) if horizon is None else None,
        seconds=time.perf_counter() - started,
        settings={
            "method": by.method,
            "choice": free if isinstance(free, str) else "given",
            "free": list(table.names),
            "ties": [f"{name} = {expression.text}" for name, expression in table.ties],
            "held at the prior card": list(table.held),
            **table.switches,
            **({"constants of every record": [f.name for f in table.of_records]} if table.of_records else {}),
            **({"noise of its own": list(table.noises)} if table.noises else {}),
            **told_horizon(horizon),
            **settings,
            "outputs": list(pieces[0].output_names),
            "wind": question.wind,
            **({"left out": [list(part) for part in question.leave_out]} if question.leave_out else {}),
            "rate": 1.0 / pieces[0].dt,
            "records": [piece.name for piece in pieces],
            "voltage": "logged" if all(piece.voltage_known for piece in pieces) else "not logged: card's nominal",
        },
    )


@dataclass(frozen=True)
class FlightEstimator(Generic[L]):
    """An estimator of helicopters whose pose was tracked.

    Attributes:
        method: its name.
        takes: names of the fields of a question that it answers.
        likelihood_of: makes the likelihood of records.
        search: finds its optimum.
        conclude: what the optimum says, and the likelihood's whole row there.
    """

    method: str
    takes: frozenset[str]
    likelihood_of: Callable[[Parameterization, Sequence[Record], Question], L]
    search: Callable[[L, Solver], Optimum]
    conclude: Callable[[Parameterization, L, Optimum, Question], tuple[Found, Array]]

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        if isinstance(data, FrequencyResponse):
            return "it fits records in time"
        if not isinstance(model, Vehicle):
            return "it fits vehicles"
        lacking = [name for name in PREDICTED if name not in model.state_names]
        lacking += [] if model.traits.axes or "lateral" in model.input_names else ["axes that its inputs drive"]
        return f"it fits helicopters, and the vehicle lacks {', '.join(lacking)}" if lacking else ""

    def estimate(self, model: Vehicle, data: Sequence[Flight], question: Question) -> Result[Vehicle, FlightDetails]:
        return identify_flight(model, data, question, by=self)


def _filter_error(table: Parameterization, pieces: Sequence[Record], question: Question) -> FilterError:
    return FollowingError(table, pieces, noise=in_wind(pieces)) if question.wind else FilterError(table, pieces)


def _output_error(table: Parameterization, pieces: Sequence[Record], question: Question) -> OutputError:
    del question
    return OutputError(table, pieces)


def _scoring(likelihood: FilterError, solver: Solver) -> Optimum:
    quick = likelihood.constant
    if not isinstance(likelihood, FollowingError):
        return minimise_over_valleys(likelihood, solver)
    first = minimise_over_valleys(quick, replace(solver, tolerance=_BEGIN))
    after = replace(solver, tolerance=_FOLLOWING).after(len(first.history) - 1)
    last = searched(likelihood, after, start=first.row)
    return replace(last, history=(*first.history, *last.history[1:]))


def _scoring_together(likelihood: OutputError, solver: Solver) -> Optimum:
    return minimise_over_valleys(likelihood, replace(solver, together=True))


def _together(
    by: FlightEstimator[L], alone: FilterError, row: Array, residual: LinearResidual, question: Question
) -> tuple[L, Found, Array]:
    """The search that goes on with physics and residual free."""
    table = beside_physics(alone.table, residual)
    likelihood = by.likelihood_of(table, alone.records, question)
    start = begun_where_it_ended(likelihood.row, alone.row, row, residual)
    likelihood.refresh(start)
    optimum = minimise(likelihood, _solver(question), start=start)
    return likelihood, *by.conclude(table, likelihood, optimum, question)


def _horizon(question: Question) -> Horizon | None:
    return None if question.horizon is None else Horizon.of(question.horizon)


def _solver(question: Question) -> Solver:
    most = ITERATIONS if question.iterations is None else question.iterations
    return Solver(iterations=most, progress=question.progress)


def _read_optimum(
    table: Parameterization, likelihood: FlightLikelihood, optimum: Optimum, question: Question
) -> tuple[Found, Array]:
    """What the search says."""
    del question
    lags = round(LAGS / likelihood.model.dt)
    return found_at(table, likelihood, optimum, logs=likelihood.logs, lags=lags), optimum.row


def _read_ahead(
    table: Parameterization, likelihood: FilterError, optimum: Optimum, question: Question
) -> tuple[Found, Array]:
    """What the search says, or the search for small errors ahead that follows it."""
    first, row = _read_optimum(table, likelihood, optimum, question)
    horizon = _horizon(question)
    if horizon is None:
        return first, row
    criterion = MultiStepErrors(
        likelihood, row, likelihood.records, horizon=horizon, settling=SETTLING, known=first.corrected
    )
    ahead = minimise(criterion, _solver(question), start=criterion.start)
    ahead = replace(ahead, converged=ahead.converged and optimum.converged)
    best = found_at(table, criterion, ahead, logs=likelihood.logs, lags=criterion.lags)
    return replace(best, corrected=TWICE * best.corrected), criterion.whole_row(ahead.row)


_TAKES = frozenset({"free", "ties", "fixed", "priors", "prior_card", "outputs", "iterations", "progress"})
FILTER_ERROR = FlightEstimator(
    "filter-error",
    _TAKES | {"keep_unexcited", "wind", "leave_out", "horizon", "residual"},
    _filter_error,
    _scoring,
    _read_ahead,
)
OUTPUT_ERROR = FlightEstimator(
    "output-error", _TAKES | {"keep_unexcited"}, _output_error, _scoring_together, _read_optimum
)

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


def _without(pieces: list[Record], left_out: Sequence[tuple[float, float]]) -> list[Record]:
    """The pieces with the stretches that lie in them left out."""
    for first, last in left_out:
        if not any(first < last and first < piece.time[-1] and last > piece.time[0] for piece in pieces):
            raise IdentificationError(
                f"{first:g} to {last:g} s lies in none of the records ({', '.join(piece.name for piece in pieces)}).",
                channel="leave_out",
                hint="Give the start and the stop [s] on the flight's own clock.",
            )
    pieces = [replace(piece, left_out=tuple(left_out)) for piece in pieces]
    kept = max(float(piece.counts.sum()) * piece.dt for piece in pieces)
    if kept < SHORTEST:
        raise IdentificationError(
            f"leaves {kept:.1f} s of the longest record, expected at least {SHORTEST:g} s.", channel="leave_out"
        )
    return pieces


def _identified(
    best: Found,
    noise: Noise | None,
    nuisance: Nuisance,
    vehicle: Vehicle,
    estimates: Sequence[Estimate],
    pieces: Sequence[Record],
    method: str,
) -> Vehicle:
    """The identified vehicle: the card with the new numbers, where they come from, and what the observer needs."""
    sources = ", ".join(piece.name for piece in pieces)
    card = best.table.vehicle.card
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
        and name not in best.table.held
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
    if best.table.of_records:
        observer["trims"] = {f.name: 0.05 if f.sigma is None else f.sigma for f in best.table.of_records}
    if noise is not None:
        observer["noise"] = {k: float(v) for k, v in noise._asdict().items()}
    card = replace(card, title=f"{vehicle.card.title}, identified from {sources}", observer=observer, path="")
    return best.table.vehicle.with_card(card)
