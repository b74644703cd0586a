"""Estimation by collocation: states of every sample beside the parameters, in process and measurement noise.

    x(k+1) - x(k) - dt/6 (f(k) + 4 f(k+1/2) + f(k+1)) = w(k),  w ~ N(0, dt q^2);      y(k) - h(k) = v(k),  v ~ N(0, r^2)

Nothing is simulated, so that nothing diverges: unstable models and start values of zero are no obstacle (Dutra 2019,
"Collocation-based output-error method for aircraft system identification"; Dutra 2025, "Variational system
identification of aircraft", arXiv 2510.26496). First states and parameters are sought together, with given noise, by
sparse Gauss-Newton; then parameters and noise by the likelihood of the data, states integrated out. Noise levels cannot
be had from states and data together: that density has no maximum in them.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.low_passed import refuse_lowpassed
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.parameters import Parameterization, parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.result import Result
from swashplate.identification.core.sources import sources_of
from swashplate.identification.core.time_fit import Solved, TimeDetails, solve
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.collocation_equations import StructurePredictor, VehiclePredictor
from swashplate.identification.time.collocation_likelihood import CollocationErrors
from swashplate.identification.time.linear_time_fit import linear_records, linear_result
from swashplate.identification.time.prediction_error import parameter_entries
from swashplate.identification.time.vehicle_likelihood import check_predicted, driving_rows
from swashplate.identification.time.vehicle_time_fit import check_biases, outputs_of, vehicle_result
from swashplate.jax_on_demand import jnp
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import enable_compilation_cache
from swashplate.simulation.dynamics import (
    CONSTANTS,
    enable_double_precision,
    equations_of,
)


@dataclass(frozen=True)
class CollocationEstimator:
    """Parameters of any vehicle or state-space model from records in time, by collocation."""

    takes: frozenset[str] = frozenset(
        {"free", "ties", "fixed", "priors", "prior_card", "outputs", "iterations", "environment", "shifts", "biases"}
        | {"progress"}
    )

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        return "it fits records in time" if isinstance(data, FrequencyResponse) else ""

    def estimate(
        self, model: Vehicle | StateSpaceModel, data: Sequence[Flight], question: Question
    ) -> Result[Any, TimeDetails]:
        enable_double_precision()
        enable_compilation_cache()
        refuse_lowpassed(data)
        if isinstance(model, StateSpaceModel):
            return _of_structure(model, data, question)
        if model.structure is not None and question.free in (None, "full"):
            return _of_structure(model.structure, data, question)
        return _of_vehicle(model, data, question)


COARSE = 0.02
"""Share of a mode by which a step may be wrong: about 1.7 / dt [1/s]."""

COLLOCATION = CollocationEstimator()
_METHOD = "collocation"


def _of_vehicle(vehicle: Vehicle, flights: Sequence[Flight], question: Question) -> Result[Vehicle, TimeDetails]:
    began = time.perf_counter()
    outputs = outputs_of(vehicle, flights, question)
    check_predicted(vehicle, outputs)
    check_biases(question.biases, outputs)
    table = parameterize(
        vehicle,
        "full" if question.free is None else question.free,
        ties=question.ties,
        fixed=question.fixed,
        priors=question.priors,
        prior_card=question.prior_card,
    )
    pieces = records(flights, vehicle, outputs=outputs)
    likelihood = vehicle_errors(
        table,
        pieces,
        question.environment or Environment(),
        shifts=bool(question.shifts),
        biases=question.biases,
    )
    solved = _solve(likelihood, question)
    result = vehicle_result(
        vehicle,
        table,
        solved,
        method=_METHOD,
        data=sources_of(flights),
        settings={"outputs": list(outputs), "shifts": bool(question.shifts), "biases": list(question.biases)},
        seconds=time.perf_counter() - began,
    )
    return _warned(result, likelihood, solved)


def vehicle_errors(
    table: Parameterization,
    pieces: Sequence[Record],
    environment: Environment,
    *,
    shifts: bool,
    biases: Sequence[str],
) -> CollocationErrors:
    """The likelihood of a vehicle's records.

    Args:
        table: free parameters and ties. pieces: with what `measurable` names as outputs.
        environment: wind, density and gravity; the records have the voltage.
        shifts, biases: see `CollocationErrors`, which tells its errors.
    """
    vehicle, outputs = table.vehicle, pieces[0].output_names
    around = environment_of(vehicle, environment)
    constants = [getattr(around, name) for name in CONSTANTS]
    return CollocationErrors(
        VehiclePredictor(equations_of(vehicle), table.layout, outputs),
        parameter_entries(table),
        states=vehicle.state_names,
        outputs=outputs,
        records=pieces,
        given={"card": jnp.asarray(table.card_row), "constants": jnp.asarray(constants, dtype=float)},
        driving=[driving_rows(piece, around) for piece in pieces],
        rest=dict(zip(vehicle.state_names, map(float, leaves(vehicle.state)), strict=True)),
        shifts=shifts,
        biases=biases,
    )


def _of_structure(
    model: StateSpaceModel, flights: Sequence[Flight], question: Question
) -> Result[StateSpaceModel, TimeDetails]:
    began = time.perf_counter()
    held: Sequence[str] = ("ties", "fixed", "priors", "prior_card", "environment")
    told = [*([] if question.free in (None, "full") else ["free"]), *(name for name in held if name in question.asked)]
    if told:
        raise IdentificationError(
            f"'{model.name}' says itself what is free, tied and held.",
            channel=", ".join(told),
            hint="Change its file, or `model.with_values(..., free=False)`.",
        )
    outputs, shifts = tuple(question.outputs or model.outputs), question.shifts is not False
    pieces, delays = linear_records(model, flights, outputs, biases=question.biases)
    parameters = [(n, model.parameters[n]) for n in model.free]
    elements = tuple((e.matrix, e.row, e.column, e.expression) for e in model.elements)
    likelihood = CollocationErrors(
        StructurePredictor((elements, model.free, tuple(model.numbers().items())), model, outputs, delays),
        [Entry(n, "parameter", p.value, abs(p.value) or 1.0, p.lower, p.upper) for n, p in parameters],
        states=model.states,
        outputs=outputs,
        records=pieces,
        given={},
        driving=[piece.inputs for piece in pieces],
        rest={},
        shifts=shifts,
        biases=question.biases,
    )
    solved = _solve(likelihood, question)
    result = linear_result(
        model,
        solved,
        method=_METHOD,
        data=sources_of(flights),
        settings={"outputs": list(outputs), "shifts": shifts, "biases": list(question.biases)},
        seconds=time.perf_counter() - began,
    )
    return _warned(result, likelihood, solved)


def _solve(likelihood: CollocationErrors, question: Question) -> Solved:
    return solve(
        likelihood,
        start=likelihood.begin,
        iterations=80 if question.iterations is None else question.iterations,
        progress=question.progress,
    )


_Model = TypeVar("_Model")


def _warned(
    result: Result[_Model, TimeDetails], likelihood: CollocationErrors, solved: Solved
) -> Result[_Model, TimeDetails]:
    """The result with what is said of steps that are too long for the model."""
    fast, error = likelihood.fastest(solved.optimum.row)
    if error <= COARSE:
        return result
    step = likelihood.records[0].dt
    words = (
        f"a mode at {abs(fast):.3g} 1/s is too fast for samples every {step:.3g} s: a step of collocation is wrong by "
        f"{100.0 * error:.2g} % of it. Condition the flight to a higher rate, or use a method that integrates."
    )
    return replace(result, warnings=(*result.warnings, words))
