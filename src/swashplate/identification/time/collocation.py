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
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.low_passed import refuse_lowpassed
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Result
from swashplate.identification.core.sources import sources_of
from swashplate.identification.core.time_fit import Solved, TimeDetails, solve
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.collocation_equations import ForetellingStructure, ForetellingVehicle
from swashplate.identification.time.collocation_likelihood import CollocationErrors
from swashplate.identification.time.linear_time_fit import linear_records, linear_result
from swashplate.identification.time.prediction_error import parameter_entries
from swashplate.identification.time.vehicle_likelihood import check_foretold, driving_rows
from swashplate.identification.time.vehicle_time_fit import check_biases, outputs_of, vehicle_result
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.nesting import leaves
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
        if model.structure is not None and question.free is None:
            return _of_structure(model.structure, data, question)
        return _of_vehicle(model, data, question)


COLLOCATION = CollocationEstimator()
_METHOD = "collocation"


def _of_vehicle(vehicle: Vehicle, flights: Sequence[Flight], question: Question) -> Result[Vehicle, TimeDetails]:
    began = time.perf_counter()
    outputs = outputs_of(vehicle, flights, question)
    check_foretold(vehicle, outputs)
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
    environment = question.environment or Environment()
    likelihood = CollocationErrors(
        ForetellingVehicle(equations_of(table.vehicle), table.layout, outputs),
        parameter_entries(table),
        states=vehicle.state_names,
        outputs=outputs,
        records=pieces,
        given={
            "card": jnp.asarray(table.card_row),
            "constants": jnp.asarray([getattr(environment, name) for name in CONSTANTS], dtype=float),
        },
        driving=[driving_rows(piece, environment) for piece in pieces],
        rest=dict(zip(vehicle.state_names, map(float, leaves(vehicle.state)), strict=True)),
        shifts=bool(question.shifts),
        biases=question.biases,
    )
    return vehicle_result(
        vehicle,
        table,
        _solve(likelihood, question),
        method=_METHOD,
        data=sources_of(flights),
        settings={"outputs": list(outputs), "shifts": bool(question.shifts), "biases": list(question.biases)},
        seconds=time.perf_counter() - began,
    )


def _of_structure(
    model: StateSpaceModel, flights: Sequence[Flight], question: Question
) -> Result[StateSpaceModel, TimeDetails]:
    began = time.perf_counter()
    told = [n for n in ("free", "ties", "fixed", "priors", "prior_card", "environment") if n in question.asked]
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
        ForetellingStructure((elements, model.free, tuple(model.numbers().items())), model, outputs, delays),
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
    return linear_result(
        model,
        _solve(likelihood, question),
        method=_METHOD,
        data=sources_of(flights),
        settings={"outputs": list(outputs), "shifts": shifts, "biases": list(question.biases)},
        seconds=time.perf_counter() - began,
    )


def _solve(likelihood: CollocationErrors, question: Question) -> Solved:
    return solve(
        likelihood,
        start=likelihood.begin,
        iterations=80 if question.iterations is None else question.iterations,
        progress=question.progress,
    )
