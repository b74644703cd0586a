"""Parameters of any vehicle's nonlinear equations from records of whatever was measured.

Nothing is asked for but the equations: an aeroplane with its own states, vanes and accelerometers is a `Vehicle` like
any other. Inputs are straight lines between samples; delays must have been taken out. What is measured is a state, a
state's rate or the specific force, and what disturbs is white noise on every state's rate. The filter's gain is
constant, from the slopes where the record begins (filter error method for nonlinear systems: Jategaonkar 2015, sec.
5.5). Noise is gathered over a sample, where his Riccati equation is that of continuous time: there a constraint has to
keep the gain from passing one (his eq. 5.35), here it cannot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import CONSTANTS, SURROUNDINGS, equations_of
from swashplate.errors import IdentificationError
from swashplate.filtering.riccati import STEP, white_noise_gain
from swashplate.filtering.vehicle_filter import FORCES, Ran, VehicleFilter
from swashplate.flights.excitation import CONTROLLER, Excitation, excitations, of_inputs
from swashplate.flights.flight import Flight
from swashplate.identification.core.likelihood import (
    NOTHING,
    MovedErrors,
    OwnCovariance,
    factor_of,
    gain_entries,
    gust_entries,
)
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.parameters import Parameterization, parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.result import Estimate
from swashplate.identification.estimators import GAINS, Gain, Question
from swashplate.identification.time.feedback import mark_answers
from swashplate.identification.time.filter_error import parameter_entries
from swashplate.identification.time.record_fit import SOLVER, RecordEstimator, RecordProblem, check_biases
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment


def measurable(vehicle: Vehicle) -> tuple[str, ...]:
    """Names of the channels that a vehicle's equations predict: its states, their rates and the specific force."""
    return (*vehicle.state_names, *(f"{name}dot" for name in vehicle.state_names), *FORCES)


def check_predicted(vehicle: Vehicle, outputs: Sequence[str]) -> None:
    """That a vehicle's equations predict some channels.

    Raises:
        IdentificationError: naming those that they do not, and those that they do.
    """
    known = measurable(vehicle)
    strange = [name for name in outputs if name not in known]
    if strange:
        raise IdentificationError(
            f"'{vehicle.name}' does not predict it.",
            channel=", ".join(strange),
            hint=f"Its outputs may be {', '.join(known)}.",
        )


class VehicleErrors(OwnCovariance):
    """The likelihood of a vehicle's output errors, or of its innovations.

    Args:
        table: free parameters and ties.
        records: with what `measurable` names as outputs.
        gain: "none", "from the noise" (of white noise on every state's rate; innovations count by their variances, as
            in Jategaonkar's program) or "free".
        environment: wind, density and gravity; the records have the voltage.
        shifts, biases: see `OwnCovariance`.

    Raises:
        IdentificationError: an output that the equations do not predict.
    """

    def __init__(
        self,
        table: Parameterization,
        records: Sequence[Record],
        *,
        gain: Gain,
        environment: Environment,
        shifts: bool,
        biases: Sequence[str],
    ) -> None:
        vehicle, outputs = table.vehicle, records[0].output_names
        check_predicted(vehicle, outputs)
        self.table, self.gain = table, gain
        super().__init__(
            parameter_entries(table),
            states=vehicle.state_names,
            outputs=outputs,
            records=records,
            rest=dict(zip(vehicle.state_names, map(float, leaves(vehicle.state)), strict=True)),
            shifts=shifts,
            biases=biases,
        )
        around, equations = environment_of(vehicle, environment), equations_of(vehicle)
        self._driving = [driving_rows(record, around) for record in records]
        self._constants = np.array([getattr(around, name) for name in CONSTANTS], dtype=np.float64)
        self._filters = [VehicleFilter(equations, outputs, round(record.dt, 9)) for record in records]

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        states = self.table.vehicle.state_names
        if self.gain == "from the noise":
            return gust_entries(states, size)
        return gain_entries(states, size, spread) if self.gain == "free" else []

    def _covariance(self, errors: Array) -> Array:
        matrix = super()._covariance(errors)
        return np.diag(np.diag(matrix)) if self.gain == "from the noise" else matrix

    def _errors_in_a_row(self, row: Array) -> Array:
        every = range(len(self.records))
        return np.concatenate([self._ran(number, row, NOTHING)[0].errors for number in every])

    def moved_errors(self, row: Array) -> Iterator[MovedErrors]:
        factor = factor_of(self.covariance)
        for number in range(len(self.records)):
            entries = [i for i, n in enumerate(self.row.names) if n.endswith(f"[{number}]") or not n.endswith("]")]
            ran, _ = self._ran(number, row, places := np.array(entries, dtype=np.intp))
            yield MovedErrors(number, ran.errors, factor, places, ran.errors_moved)

    def _ran(self, number: int, row: Array, places: Places) -> tuple[Ran, Array]:
        """The filter along a record, and its numbers with those of its directions behind."""
        start, numbers = self._given(number, row * self.row.scale, places)
        return self._filters[number].run(start, numbers, self._driving[number], self.records[number].outputs), numbers

    def _given(self, number: int, row: Array, places: Places) -> tuple[Array, Array]:
        """Where the filter begins and its numbers, and behind both how they move with some entries of the row."""
        directions = np.diag(self.row.scale)[places]
        every = np.concatenate([row[None], directions])

        def at(names: Sequence[str]) -> Array:
            places = [self._place.get(name) for name in names]
            return np.stack([np.zeros(len(every)) if i is None else every[:, i] for i in places], axis=1)

        states, layout, card = self.table.vehicle.state_names, self.table.layout, self.table.card_row
        free = len(layout.free)
        p = np.zeros((len(every), len(card) + len(CONSTANTS)))
        p[0] = *layout.values(card, row[:free]), *self._constants
        if free:
            p[1:, : len(card)] = directions[:, :free] @ layout.value_slopes(card, row[:free])
        start, shift = (at([f"{what} {s}[{number}]" for s in states]) for what in ("start", "shift"))
        bias = at([f"bias {o}[{number}]" for o in self.outputs])
        if self.gain == "from the noise":
            gain = self._kalman(number, start, p, at([f"gust {s}" for s in states]))
        else:  # zeros for output error
            gain = at([f"gain {s}/{o}" for s in states for o in self.outputs])
        return start, np.hstack([p, shift, bias, gain])

    def _kalman(self, number: int, start: Array, p: Array, gusts: Array) -> Array:
        """The steady gain where the record begins, row by row, and behind it how it moves."""
        filter, n = self._filters[number], start.shape[1]
        slopes, logs = (
            part[0] + 1j * STEP * np.concatenate([np.zeros_like(part[:1]), part[1:]])
            for part in (filter.linear(start, self._driving[number][0], p), gusts)
        )
        sensors = np.broadcast_to(self.covariance, (len(start), *self.covariance.shape))
        gain = white_noise_gain(slopes[:, :n], np.exp(2.0 * logs), slopes[:, n:], sensors, filter.dt)[0]
        return np.concatenate([gain[:1].real, gain[1:].imag / STEP]).reshape(len(start), -1)

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """Per record errors ahead, and their slopes by some entries of the scaled row, (places, starts, ...)."""
        parts = [self._ahead(number, row, ahead, places) for number in range(len(self.records))]
        return [errors for errors, _ in parts], [slopes for _, slopes in parts]

    def _ahead(self, number: int, row: Array, ahead: Ahead, places: Places) -> tuple[Array, Array]:
        """Of one record: the filter again from its corrected states, which nothing corrects any more."""
        ran, numbers = self._ran(number, row, places)
        numbers[:, -len(self.outputs) * ran.states.shape[1] :] = 0.0
        parts = []
        for first in ahead.starts[number]:
            begin = np.concatenate([ran.states[None, first], ran.states_moved[:, first]])
            tables = (
                table[first : first + ahead.steps[-1] + 1]
                for table in (self._driving[number], self.records[number].outputs)
            )
            parts.append(self._filters[number].run(begin, numbers, *tables))
        steps = list(ahead.steps)
        return np.stack([p.errors[steps] for p in parts]), np.stack([p.errors_moved[:, steps] for p in parts], axis=1)


def driving_rows(record: Record, environment: Environment) -> Array:
    """Inputs, wind and voltage of a record at every sample, (n, n_driving)."""
    wind = [np.full(record.time.size, float(getattr(environment, name))) for name in SURROUNDINGS[:-1]]
    return np.column_stack([record.inputs, *wind, record.voltage])


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
