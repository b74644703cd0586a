"""Parameters of any vehicle's nonlinear equations from records of whatever was measured.

Nothing is asked for but the equations: an aeroplane with its own states, vanes and accelerometers is a `Vehicle` like
any other. Inputs are straight lines between samples; delays must have been taken out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from swashplate.errors import IdentificationError
from swashplate.flights.excitation import CONTROLLER, Excitation, excitations, of_inputs
from swashplate.flights.flight import Flight
from swashplate.identification.core.parameters import Parameterization, parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Estimate
from swashplate.identification.estimators import GAINS, Question
from swashplate.identification.time.feedback import mark_answers
from swashplate.identification.time.record_fit import SOLVER, RecordEstimator, RecordProblem, check_biases
from swashplate.identification.time.vehicle_likelihood import VehicleErrors, measurable
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle


@dataclass(frozen=True)
class VehicleKind:
    """Any vehicle."""

    takes = frozenset({"free", "tie", "prior", "environment", "shifts", "biases"})
    solver = SOLVER

    def unsuited(self, model: Vehicle | StateSpaceModel) -> str:
        return "" if isinstance(model, Vehicle) else "it fits vehicles"

    def problem(
        self, model: Vehicle, flights: Sequence[Flight], question: Question, *, method: str
    ) -> RecordProblem[Vehicle]:
        if question.free is None:
            raise IdentificationError(
                f"'{model.name}' has no ready choice of what may move.",
                channel="free",
                hint=f"Name parameters, e.g. free=['{next(iter(model.card.parameters))}'].",
            )
        outputs = _outputs(model, flights, question)
        check_biases(question.biases, outputs)
        table = parameterize(model, question.free, ties=question.tie, priors=question.prior)
        if isinstance(question.free, str):  # a ready choice is also for methods that have them
            table = replace(table, of_records=(), noises=())
        beside = [*(item.name for item in table.of_records), *table.noises]
        if beside:
            raise IdentificationError(
                f"'{method}' has no such constants of records and no such noise for this model.",
                channel=", ".join(beside),
                hint="Free it with method 'filter-error' of a helicopter whose pose was tracked, or shifts and biases.",
            )
        likelihood = VehicleErrors(
            table,
            records(flights, model, outputs=outputs),
            gain=GAINS[method],
            environment=environment_of(model, question.environment),
            shifts=bool(question.shifts),
            biases=question.biases,
        )
        driven = excitations(flights, model.input_names, outputs=outputs)
        answers = tuple(f"{one.input}: {one.why}" for one in of_inputs(driven).values() if one.kind == CONTROLLER)
        sources = ", ".join(piece.name for piece in likelihood.records)
        return RecordProblem(
            likelihood,
            model,
            method,
            flights,
            _Identified(table, method, sources, driven).vehicle,
            {
                "free": list(table.names),
                "ties": [f"{name} = {tie.text}" for name, tie in table.ties],
                **table.switches,
                "shifts": bool(question.shifts),
                "biases": list(question.biases),
            },
            table=table,
            warnings_of=lambda _: answers,
        )


@dataclass(frozen=True)
class _Identified:
    """How the numbers found become the vehicle: its card tells where they come from, and what moved each input."""

    table: Parameterization
    method: str
    sources: str
    excited: Sequence[Excitation]

    def vehicle(self, estimates: Mapping[str, Estimate]) -> Vehicle:
        table, origin = self.table, f"identified by {self.method} from {self.sources}"
        card = table.vehicle.card
        for name, value in table.identified([estimates[n].value for n in table.names]).items():
            sigma = estimates[name].sigma if name in table.names else None
            card = card.with_values({name: value}, status="identified", sigma=sigma, source=origin)
        title = f"{card.title}, identified from {self.sources}"
        return mark_answers(table.vehicle.with_card(replace(card, title=title, path="")), self.excited)


def _outputs(model: Vehicle, flights: Sequence[Flight], question: Question) -> tuple[str, ...]:
    """The channels that were asked for; where none were, all that the flights have and the equations predict."""
    shared = [n for n in measurable(model) if all(n in flight for flight in flights)]
    outputs = shared if question.outputs is None else question.outputs
    if not outputs:
        raise IdentificationError(
            f"the flights have nothing that '{model.name}' predicts: {', '.join(measurable(model))}.",
            channel="outputs",
        )
    return tuple(outputs)


OUTPUT_ERROR, FILTER_ERROR, PREDICTION_ERROR = (RecordEstimator(method, VehicleKind()) for method in GAINS)
