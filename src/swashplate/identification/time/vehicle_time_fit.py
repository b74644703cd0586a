"""`fit_vehicle`: parameters of any vehicle's nonlinear equations from records of whatever was measured.

`identify` knows how small helicopters fly, are tracked and are blown about, and is the better choice for them. This one
asks for nothing but the equations: an aeroplane with its own states, vanes and accelerometers is a `Vehicle` like any
other.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from swashplate.errors import IdentificationError
from swashplate.flights.excitation import CONTROLLER, excitations, of_inputs
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.low_passed import refuse_lowpassed
from swashplate.identification.core.parameters import Free, Parameterization, parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Estimate, Result
from swashplate.identification.core.sources import DataSource, sources_of
from swashplate.identification.core.time_fit import Solved, TimeDetails, ahead_of, check_method, result_of, solve
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.feedback import mark_answers
from swashplate.identification.time.vehicle_likelihood import VehicleErrors, measurable
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment


def fit_vehicle(
    vehicle: Vehicle,
    flights: Flight | Sequence[Flight],
    *,
    free: Sequence[str | Free],
    outputs: Sequence[str],
    method: str = "filter-error",
    ties: Sequence[str] = (),
    priors: Mapping[str, tuple[float, float]] | None = None,
    environment: Environment | None = None,
    shifts: bool = False,
    biases: Sequence[str] = (),
    iterations: int = 80,
    horizon: Sequence[float] | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> Result[Vehicle, TimeDetails]:
    """Fit parameters of a vehicle's equations to records in time by maximum likelihood.

    Inputs are straight lines between samples; delays must have been taken out.

    Args:
        vehicle: the equations and the card to start from.
        flights: conditioned; each unbroken piece is a record with its own start state and constants.
        free: names of the parameters to move (a `Free` has a scale and a prior).
        outputs: channels to fit: states, their rates ("qdot") and the specific force ("ax", "ay", "az").
        method: "filter-error" (gusts: white noise on every state's rate), "prediction-error" (any stationary gust: a
            free gain, for long records) or "output-error" (no gusts).
        ties, priors: see `parameterize`.
        environment: wind, density and gravity (None: the usual ones).
        shifts: constants in the states' rates, per record.
        biases: outputs with a constant of their own, per record.
        iterations: at most this many.
        horizon: (FIRST, LAST) seconds ahead of errors to make small after maximum likelihood, see `identify`.
        progress: called with the iteration and the cost.

    Returns:
        The fit; `model` is the vehicle with the numbers found.

    Raises:
        IdentificationError: an unknown method, parameter or output, or a model that diverges at its start values.
        FlightError: where a flight lacks a channel, is not on a uniform grid, or was low-passed.
    """
    began = time.perf_counter()
    check_method(method)
    ahead = ahead_of(horizon, method)
    outputs = tuple(outputs)
    flights = as_flights(flights)
    refuse_lowpassed(flights)
    check_biases(biases, outputs)
    table = parameterize(vehicle, free, ties=ties, priors=priors)
    beside = [*(item.name for item in table.of_records), *table.noises]
    if beside and isinstance(free, str):  # a ready choice is also for methods that have them
        table, beside = replace(table, of_records=(), noises=()), []
    if beside:
        raise IdentificationError(
            f"'{method}' has no such constants of records and no such noise.",
            channel=", ".join(beside),
            hint="Free it with method 'prediction-error' of a helicopter whose pose was tracked, or shifts and biases.",
        )
    pieces = records(flights, vehicle, outputs=outputs)
    likelihood = VehicleErrors(
        table,
        pieces,
        method=method,
        environment=environment_of(vehicle, environment),
        shifts=shifts,
        biases=tuple(biases),
    )
    solved = solve(likelihood, iterations=iterations, progress=progress, horizon=ahead)
    moved = excitations(flights, vehicle.input_names, outputs=outputs)
    result = vehicle_result(
        vehicle,
        table,
        solved,
        method=method,
        data=sources_of(flights),
        settings={"outputs": list(outputs), "shifts": shifts, "biases": list(biases)},
        seconds=time.perf_counter() - began,
    )
    answers = tuple(f"{one.input}: {one.words}" for one in of_inputs(moved).values() if one.kind == CONTROLLER)
    return replace(result, solution=mark_answers(result.solution, moved), warnings=(*result.warnings, *answers))


def check_biases(biases: Sequence[str], outputs: Sequence[str]) -> None:
    """That only outputs have biases."""
    unknown = [name for name in biases if name not in outputs]
    if unknown:
        raise IdentificationError(f"is none of the outputs {', '.join(outputs)}.", channel=", ".join(unknown))


def vehicle_result(
    vehicle: Vehicle,
    table: Parameterization,
    solved: Solved,
    *,
    method: str,
    data: Sequence[DataSource],
    settings: Mapping[str, Any],
    seconds: float,
) -> Result[Vehicle, TimeDetails]:
    """A solved likelihood of a vehicle's records as a result, its model the vehicle with the numbers found.

    Args:
        vehicle: before the fit.
        table: what was free or tied.
        solved: of `solve`, its first entries the free parameters.
        method, data, settings, seconds: see `Result`; what was free, tied and flown is added to the settings.
    """
    sources = [piece.name for piece in solved.likelihood.records]
    values = table.identified([solved.numbers[n] for n in table.names])
    origin = f"identified by {method} from {', '.join(sources)}"

    def identified(estimates: Mapping[str, Estimate]) -> Vehicle:
        card = table.vehicle.card
        for name, value in values.items():
            sigma = estimates[name].sigma if name in table.names else None
            card = card.with_values({name: value}, status="identified", sigma=sigma, source=origin)
        title = f"{card.title}, {origin.replace(f' by {method}', '')}"
        return table.vehicle.with_card(replace(card, title=title, path=""))

    card = vehicle.card.parameters
    asked = {"free": list(table.names), "ties": [f"{name} = {tie.text}" for name, tie in table.ties]}
    return result_of(
        solved,
        model=identified,
        start=vehicle,
        units=[card[name].unit for name in table.names],
        ties=[Estimate(n, card[n].unit, card[n].value, values[n], tie=tie.text) for n, tie in table.ties],
        method=method,
        data=data,
        settings={**asked, **table.switches, **settings, "records": sources},
        seconds=seconds,
    )


def outputs_of(model: Vehicle, flights: Sequence[Flight], question: Question) -> tuple[str, ...]:
    """The channels that were asked for; where none were, all that the flights have and the equations predict.

    Raises:
        IdentificationError: where there are none.
    """
    shared = [n for n in measurable(model) if all(n in flight for flight in flights)]
    outputs = shared if question.outputs is None else question.outputs
    if not outputs:
        raise IdentificationError(
            f"the flights have nothing that '{model.name}' predicts: {', '.join(measurable(model))}.",
            channel="outputs",
        )
    return tuple(outputs)


@dataclass(frozen=True)
class VehicleEstimator:
    """`fit_vehicle` by one of its methods, as an estimator."""

    method: str

    @property
    def takes(self) -> frozenset[str]:
        filtered = set() if self.method == "output-error" else {"horizon"}
        usual = {"free", "ties", "priors", "outputs", "iterations", "environment", "shifts", "biases", "progress"}
        return frozenset(usual | filtered)

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        if isinstance(data, FrequencyResponse):
            return "it fits records in time"
        return "" if isinstance(model, Vehicle) else "it fits vehicles"

    def estimate(self, model: Vehicle, data: Sequence[Flight], question: Question) -> Result[Vehicle, TimeDetails]:
        if question.free is None or isinstance(question.free, str):
            raise IdentificationError(
                f"'{model.name}' has no ready choice of what may move.",
                channel="free",
                hint=f"Name parameters, e.g. free=['{next(iter(model.card.parameters))}'].",
            )
        outputs = outputs_of(model, data, question)
        return fit_vehicle(
            model,
            data,
            free=question.free,
            outputs=outputs,
            method=self.method,
            ties=question.ties,
            priors=question.priors,
            environment=question.environment,
            shifts=bool(question.shifts),
            biases=question.biases,
            iterations=80 if question.iterations is None else question.iterations,
            horizon=question.horizon,
            progress=question.progress,
        )


FILTER_ERROR, PREDICTION_ERROR, OUTPUT_ERROR = (
    VehicleEstimator(method) for method in ("filter-error", "prediction-error", "output-error")
)
