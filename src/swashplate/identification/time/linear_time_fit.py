"""State-space models fitted in time: maximum likelihood under measurement noise, or with gusts by innovations.

    dx/dt = A x + B u(t - tau) + shift (+ gusts),    y = C x + D u(t - tau) + bias + v

Output error takes all noise for measurement noise (Jategaonkar 2015, ch. 4; Klein and Morelli 2006, ch. 6). Prediction
error corrects the state by K times the last innovation and fits K too: the innovations form, which knows any stationary
gusts and measurement noise, also where both come in by an accelerometer (Ljung 1999, sec. 7.3). Filter error has K
from a Kalman filter with white gusts on every state's rate: fewer unknowns, if gusts come in so (Jategaonkar, ch. 5).
The covariance of the errors alternates with Fisher scoring; derivatives by complex steps are exact to rounding.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.flights.excitation import CONTROLLER, excitations, of_inputs
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.low_passed import refuse_lowpassed
from swashplate.identification.core.records import Record, uniform_table
from swashplate.identification.core.result import Estimate, Result
from swashplate.identification.core.sources import DataSource, sources_of
from swashplate.identification.core.time_fit import Solved, TimeDetails, ahead_of, check_method, result_of, solve
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.linear_filter import FilterErrors, GustErrors
from swashplate.identification.time.linear_likelihood import OutputErrors
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

_TORN = 5.0
"""Standard deviations of the difference: an earlier fit's bounds are some times too narrow themselves."""


def fit_in_time(
    model: Vehicle | StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
    shifts: bool = True,
    biases: Sequence[str] = (),
    method: str = "output-error",
    iterations: int = 80,
    horizon: Sequence[float] | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> Result[StateSpaceModel, TimeDetails]:
    """Fit a model's free parameters to records in time.

    Args:
        model: structure and start values. A delay belongs to an input; free ones are fitted.
        flights: conditioned; each unbroken piece is a record with its own start state and constants.
        outputs: channels to fit; all of the model's where None.
        shifts: constants in the states' rates, per record.
        biases: outputs with a constant of their own, per record.
        method: "output-error"; for records with gusts or an unstable aircraft "filter-error" (the gain by the gusts'
            intensities) or "prediction-error" (gusts that last; any
            gain where no state is a velocity through the air).
        iterations: at most this many.
        horizon: (FIRST, LAST) seconds ahead of errors to make small after maximum likelihood, see `identify`.
        progress: called with the iteration and the cost.

    Raises:
        IdentificationError: delays that differ between outputs, a model that diverges at its start values, an unknown
            method, or no free parameter.
        FlightError: where a flight was low-passed.
    """
    began = time.perf_counter()
    flights, model = as_flights(flights), structure_of(model)
    names = tuple(outputs or model.outputs)
    check_method(method)
    ahead = ahead_of(horizon, method)
    refuse_lowpassed(flights)
    pieces, delays = linear_records(model, flights, names, biases=biases)
    moved = of_inputs(excitations(flights, model.inputs, outputs=names))
    model = model.with_unmoved(name for name, one in moved.items() if one.kind == CONTROLLER)
    kind: type[OutputErrors] = {"filter-error": FilterErrors}.get(method, OutputErrors)
    if method == "prediction-error" and GustErrors.suits(model):
        kind = GustErrors
    likelihood = kind(model, names, pieces, shifts, tuple(biases), delays=delays, gain=method != "output-error")
    # Of a model that no fit has brought near, the errors would be taken for gusts and the gain led astray.
    near = method == "prediction-error" and all(np.isfinite(model.parameters[n].cramer_rao) for n in model.free)
    return linear_result(
        model,
        solve(
            likelihood,
            iterations=iterations,
            progress=progress,
            start=likelihood.begun() if near else None,
            horizon=ahead,
            around=near,
        ),
        method=method,
        data=sources_of(flights),
        settings={"outputs": list(names), "shifts": shifts, "biases": list(biases)},
        seconds=time.perf_counter() - began,
    )


def linear_records(
    model: StateSpaceModel, flights: Sequence[Flight], outputs: Sequence[str], *, biases: Sequence[str]
) -> tuple[list[Record], tuple[Expression | None, ...]]:
    """The unbroken pieces of flights with a model's inputs and outputs, and the delays of the inputs.

    Raises:
        IdentificationError: no free parameter, names that are no outputs, delays that differ between outputs.
        CardError: delays of single entries.
    """
    if not model.free:
        raise IdentificationError("has no free parameter.", channel=model.name)
    unknown = [o for o in (*outputs, *biases) if o not in model.outputs]
    if unknown:
        raise IdentificationError(f"is no output of '{model.name}'.", channel=", ".join(unknown))
    model.refuse_entry_delays("a fit in time holds the delay of")
    delays = tuple(_delay_of(model, outputs, i) for i in model.inputs)
    pieces = []
    for flight in flights:
        source = flight.provenance.source or "flight"
        for piece in flight.split():
            stamps, table = uniform_table(piece, (*model.inputs, *outputs), who=f"'{model.name}'")
            pieces.append(
                Record(
                    name=f"{source} {stamps[0]:.2f}-{stamps[-1]:.2f} s",
                    time=stamps,
                    inputs=table[:, : len(model.inputs)],
                    outputs=table[:, len(model.inputs) :],
                    voltage=np.full(stamps.size, np.nan),
                    output_names=tuple(outputs),
                    voltage_known=False,
                    log=source,
                )
            )
    return pieces, delays


def linear_result(
    model: StateSpaceModel,
    solved: Solved,
    *,
    method: str,
    data: Sequence[DataSource],
    settings: Mapping[str, Any],
    seconds: float,
) -> Result[StateSpaceModel, TimeDetails]:
    """A solved likelihood of a model's records as a result; arguments as `vehicle_result` has them."""
    result = result_of(
        solved,
        model=lambda estimates: model.with_values({n: estimates[n].value for n in model.free}).with_bounds(
            {n: (estimates[n].best_sigma, estimates[n].insensitivity) for n in model.free}
        ),
        start=model,
        units=[model.parameters[n].unit for n in model.free],
        ties=[],
        method=method,
        data=data,
        settings={**settings, "records": [piece.name for piece in solved.likelihood.records]},
        seconds=seconds,
    )
    return replace(result, warnings=(*result.warnings, *torn(result.estimates, model)))


def torn(estimates: Sequence[Estimate], start: StateSpaceModel) -> list[str]:
    """Where the records say something else than the fit which the start comes from, by more than both allow."""
    apart = {}
    for e in estimates:
        known = start.parameters[e.name].cramer_rao
        spread = np.hypot(known, e.best_sigma)
        if not e.fixed and np.isfinite(spread) and abs(e.value - e.start) > _TORN * spread:
            apart[f"{e.name} {e.start:.3g} before, {e.value:.3g} now"] = abs(e.value - e.start) / spread
    if not apart:
        return []
    worst = sorted(apart, key=lambda words: -apart[words])
    return [
        f"{len(apart)} of the model's parameters are more than {_TORN:g} bounds away from the fit that it comes from "
        f"({'; '.join(worst[:3])}): both cannot be right. Gusts that last, in a loop, bias a fit in time whose noise "
        "is white; validate both models on another flight."
    ]


def _delay_of(model: StateSpaceModel, outputs: Sequence[str], input: str) -> Expression | None:
    late = {e.text: e for o in outputs if (e := model.delays.get(f"{o}/{input}", model.delays.get(input))) is not None}
    if len(late) > 1:
        raise IdentificationError(
            f"has different delays to different outputs ({', '.join(late)}).",
            channel=input,
            hint="Give the input one delay; the fit in time delays inputs.",
        )
    return next(iter(late.values()), None)


@dataclass(frozen=True)
class LinearEstimator:
    """`fit_in_time` by one of its methods, as an estimator."""

    method: str

    @property
    def takes(self) -> frozenset[str]:
        filtered = set() if self.method == "output-error" else {"horizon"}
        return frozenset({"outputs", "iterations", "shifts", "biases", "progress"} | filtered)

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        if isinstance(data, FrequencyResponse):
            return "it fits records in time"
        return "" if isinstance(model, StateSpaceModel) else "it fits state-space models"

    def estimate(
        self, model: StateSpaceModel, data: Sequence[Flight], question: Question
    ) -> Result[StateSpaceModel, TimeDetails]:
        return fit_in_time(
            model,
            data,
            outputs=question.outputs,
            shifts=question.shifts is not False,
            biases=question.biases,
            method=self.method,
            iterations=80 if question.iterations is None else question.iterations,
            horizon=question.horizon,
            progress=question.progress,
        )


FILTER_ERROR, PREDICTION_ERROR, OUTPUT_ERROR = (
    LinearEstimator(method) for method in ("filter-error", "prediction-error", "output-error")
)
