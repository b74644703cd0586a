"""From flights to an identified helicopter, with everything that a reader needs to trust it or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance, mean_nuisance
from swashplate.flights.flight import Flight
from swashplate.identification.core import accuracy, stopping
from swashplate.identification.core.low_passed import noise_too_small, smoothed_outputs
from swashplate.identification.core.multi_step import Horizon
from swashplate.identification.core.parameters import FROM_CARD, Parameterization, parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.result import APART, Estimate
from swashplate.identification.core.scoring import Optimum, Solver, minimise, minimise_over_valleys
from swashplate.identification.estimators import Question
from swashplate.identification.time import feedback
from swashplate.identification.time.estimates import Solved, constants, estimates_of, solved_ahead, solved_at
from swashplate.identification.time.feedback import AxisExcitation, FlightDetails, moving_air
from swashplate.identification.time.filter_error import SETTLING, FilterError, in_wind, unrelated
from swashplate.identification.time.following_error import FollowingError, searched
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.identification.time.linear_residual import (
    begun,
    begun_where_it_ended,
    beside_physics,
    physics_shifts,
)
from swashplate.identification.time.output_error import OutputError
from swashplate.identification.time.record_fit import Interpreted, RecordEstimator
from swashplate.identification.time.residual_fit import fit_residual
from swashplate.models.doubts import monitored
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.residual import PREFIX
from swashplate.models.vehicle import Vehicle

_FOLLOWING = 0.2
"""A gain in log-likelihood that is too small to go on for, where an iteration takes seconds."""

_BEGIN = 1.0
"""The same for a search that another goes on from."""

FlightLikelihood = FilterError | OutputError


@dataclass(frozen=True)
class FlightProblem:
    """A helicopter whose pose was tracked, along its records.

    Attributes:
        method: name of the estimator. start: the vehicle before the fit. flights: the records' source.
        table: what is free. pieces: the records, each with its own delays, trims and lever arm.
        question: what was asked. axes: what each record moves.
        notes: to be read beside the result.
    """

    method: str
    start: Vehicle
    flights: Sequence[Flight]
    table: Parameterization
    pieces: Sequence[Record]
    question: Question
    axes: Sequence[AxisExcitation]
    notes: Sequence[str]

    def likelihood_of(self, table: Parameterization) -> FlightLikelihood:
        if self.method == "output-error":
            return OutputError(table, self.pieces)
        if self.question.wind:
            return FollowingError(table, self.pieces, noise=in_wind(self.pieces))
        return FilterError(table, self.pieces)

    def solve(self, solver: Solver, horizon: Horizon | None) -> Solved:
        likelihood = self.likelihood_of(self.table)
        where, start = ", ".join(piece.name for piece in self.pieces), likelihood.row.starts()
        likelihood.refresh(start)
        accuracy.refuse_unseen(likelihood.row, likelihood.constant.scores(start)[2], where=where)
        solved = self._read(likelihood, _searched(likelihood, solver), solver, horizon)
        if not (self.question.residual and isinstance(likelihood, FilterError)):
            return solved
        if estimates_of(solved, self.start, self.table)[1]:
            return solved
        each = [Nuisance(*numbers) for numbers in np.array(likelihood.nuisances_of(solved.full_row)).T.tolist()]
        physics, air = self.table.without(solved.optimum.at_bound), likelihood.noise_of(solved.full_row)
        vehicle = self.table.vehicle.with_values(solved.identified(self.table))
        fitted = fit_residual(vehicle, self.pieces, each, air, horizon=horizon, axes=self.axes, physics=physics)
        if not fitted.kept or horizon is not None:
            return replace(solved, residual=fitted)
        # The search goes on with physics and residual free.
        wider = self.likelihood_of(beside_physics(self.table, fitted))
        begin = begun_where_it_ended(wider.row, likelihood.row, solved.full_row, fitted)
        wider.refresh(begin)
        together = self._read(wider, minimise(wider, solver, start=begin), solver, horizon)
        vehicle = wider.table.vehicle.with_values(together.identified(wider.table))
        return replace(together, residual=fitted.at(vehicle, physics_shifts(solved, together)))

    def _read(self, likelihood: FlightLikelihood, optimum: Optimum, solver: Solver, horizon: Horizon | None) -> Solved:
        """What the search says, or the search for small errors ahead that follows it."""
        solved = solved_at(likelihood, optimum)
        return solved if horizon is None else solved_ahead(solved, horizon, solver, settling=SETTLING)

    def interpret(self, solved: Solved) -> Interpreted[Vehicle]:
        likelihood, residual, row = cast(FlightLikelihood, solved.likelihood), solved.residual, solved.full_row
        table, pieces, vehicle = likelihood.table, self.pieces, self.start
        began = begun(vehicle, residual) if residual is not None and table is not self.table else vehicle
        every, problems = estimates_of(solved, began, table)
        parameters = tuple(estimate for estimate in every if not estimate.name.startswith(PREFIX))
        noise, notes = likelihood.noise_of(row), list(self.notes)
        problems += [*smoothed_outputs(pieces, self.flights), *noise_too_small(noise, self.flights)]
        if isinstance(likelihood, FilterError):  # output error fits starts to its commands: others lose
            apart = unrelated(lambda commands: likelihood.constant.cost_under(commands, row), pieces)
            problems += [apart] if apart else []
            notes += [note] if (note := moving_air(likelihood.noise_of(row))) else []
        notes += [
            f"{e.name}: the flight is {e.disagreement:+.1f} sigmas from the prior card"
            for e in parameters
            if e.prior_source.startswith(FROM_CARD) and abs(e.disagreement) > APART
        ]
        nuisance = mean_nuisance(likelihood.nuisances_of(row))
        identified = _identified(table, noise, nuisance, began, every, pieces, self.method)
        identified = feedback.mark_unmoved(identified, [item.name for item in self.table.free], self.axes)
        done = "filter by" if isinstance(likelihood, FilterError) else "simulated by"
        settings: dict[str, Any] = {done: likelihood.compiled_by}
        if residual is not None:
            if residual.kept and table is self.table:
                wanders = {"noise": {k: float(v) for k, v in residual.noise._asdict().items()}}
                entries = {**residual.vehicle.card.parameters, **identified.card.parameters}
                card = replace(identified.card, parameters=entries, observer={**identified.card.observer, **wanders})
                identified = residual.vehicle.with_card(card)
            settings["residual"] = residual.settings_entry
            notes.append(residual.summary_text)
        of_records = constants(solved, likelihood.logs, ("nuisance",))
        if vehicle.traits.balance is not None:
            trims = {name: [c.value for c in of_records if c.name == name] for name in {c.name for c in of_records}}
            notes += vehicle.traits.balance(
                vehicle, identified, {name: sum(values) / len(values) for name, values in trims.items()}
            )
        free, left_out = "full" if self.question.free is None else self.question.free, self.question.leave_out
        return Interpreted(
            identified,
            parameters,
            of_records,
            FlightDetails(tuple(self.axes)),
            {
                "method": self.method,
                "choice": free if isinstance(free, str) else "given",
                "free": list(self.table.names),
                "ties": [f"{name} = {expression.text}" for name, expression in self.table.ties],
                "held at the prior card": list(self.table.held),
                **self.table.switches,
                **({"constants of every record": [f.name for f in table.of_records]} if table.of_records else {}),
                **({"noise of its own": list(table.noises)} if table.noises else {}),
                **settings,
                "outputs": list(pieces[0].output_names),
                "wind": self.question.wind,
                **({"left out": [list(part) for part in left_out]} if left_out else {}),
                "rate": 1.0 / pieces[0].dt,
                "records": [piece.name for piece in pieces],
                "voltage": "logged" if all(piece.voltage_known for piece in pieces) else "not logged: card's nominal",
            },
            problems,
            notes=[*notes, *(() if solved.optimum.converged else (stopping.unfinished(),))],
            noise=noise,
            nuisance=nuisance,
        )


def _searched(likelihood: FlightLikelihood, solver: Solver) -> Optimum:
    """The optimum over valleys of delays; of a gain that follows from that of a constant one."""
    if isinstance(likelihood, OutputError):
        return minimise_over_valleys(likelihood, replace(solver, together=True))
    if not isinstance(likelihood, FollowingError):
        return minimise_over_valleys(likelihood, solver)
    first = minimise_over_valleys(likelihood.constant, replace(solver, tolerance=_BEGIN))
    after = replace(solver, tolerance=_FOLLOWING).after(len(first.history) - 1)
    last = searched(likelihood, after, start=first.row)
    return replace(last, history=(*first.history, *last.history[1:]))


@dataclass(frozen=True)
class FlightKind:
    """Helicopters whose pose was tracked.

    Attributes:
        takes: see `RecordKind`.
    """

    takes: frozenset[str]
    solver = Solver(iterations=60)

    def unsuited(self, model: Vehicle | StateSpaceModel) -> str:
        if not isinstance(model, Vehicle):
            return "it fits vehicles"
        lacking = [name for name in PREDICTED if name not in model.state_names]
        lacking += [] if model.traits.axes or "lateral" in model.input_names else ["axes that its inputs drive"]
        return f"it fits helicopters, and the vehicle lacks {', '.join(lacking)}" if lacking else ""

    def problem(self, model: Vehicle, flights: Sequence[Flight], question: Question, *, method: str) -> FlightProblem:
        flights = [monitored(flight, model) for flight in flights]
        table = parameterize(
            model,
            "full" if question.free is None else question.free,
            ties=question.tie,
            fixed=question.fix,
            priors=question.prior,
            prior_card=question.prior_card,
        )
        pieces = _long_enough(records(flights, model, outputs=question.outputs))
        pieces = _without(pieces, question.leave_out) if question.leave_out else pieces
        axes = [a for piece in pieces for a in feedback.excitation(model, piece, measured_states(piece, Nuisance()))]
        notes = [] if axes else [feedback.UNJUDGED]
        if method == "filter-error" and not question.keep_unexcited:
            table, held = feedback.hold_unexcited(table, axes)
            notes += held
        return FlightProblem(method, model, flights, table, pieces, question, axes, notes)


_TAKES = frozenset({"free", "tie", "fix", "prior", "prior_card", "keep_unexcited"})
FILTER_ERROR = RecordEstimator("filter-error", FlightKind(_TAKES | {"wind", "leave_out", "residual"}))
OUTPUT_ERROR = RecordEstimator("output-error", FlightKind(_TAKES))

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
    table: Parameterization,
    noise: Noise | None,
    nuisance: Nuisance,
    vehicle: Vehicle,
    estimates: Sequence[Estimate],
    pieces: Sequence[Record],
    method: str,
) -> Vehicle:
    """The identified vehicle: the card with the new numbers, where they come from, and what the observer needs."""
    sources = ", ".join(piece.name for piece in pieces)
    card = table.vehicle.card
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
        and name not in table.held
        and parameter.value != vehicle.card.parameters[name].value
    }
    card = card.with_values(changed, status="assumed", source="held during the identification")
    started = vehicle.card.parameters
    adjusted = {name for name, entry in card.parameters.items() if entry.value != started[name].value}
    card = replace(
        card,
        parameters={
            name: replace(entry, before=started[name].value if name in adjusted else None)
            for name, entry in card.parameters.items()
        },
    )
    observer = {"nuisance": {k: float(v) for k, v in nuisance._asdict().items()}}
    if table.of_records:
        observer["trims"] = {f.name: 0.05 if f.sigma is None else f.sigma for f in table.of_records}
    if noise is not None:
        observer["noise"] = {k: float(v) for k, v in noise._asdict().items()}
    card = replace(card, title=f"{vehicle.card.title}, identified from {sources}", observer=observer, path="")
    return table.vehicle.with_card(card)
