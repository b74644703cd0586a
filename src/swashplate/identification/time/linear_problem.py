"""State-space models fitted in time: maximum likelihood under measurement noise, or with gusts by innovations.

    dx/dt = A x + B u(t - tau) + shift (+ gusts),    y = C x + D u(t - tau) + bias + v

Inputs run straight between samples. Where a computer held them, tau has half a sample of that hold in it (decision 2).

Output error takes all noise for measurement noise (Jategaonkar 2015, ch. 4; Klein and Morelli 2006, ch. 6). Prediction
error corrects the state by K times the last innovation and fits K too: the innovations form, which knows any stationary
gusts and measurement noise, also where both come in by an accelerometer (Ljung 1999, sec. 7.3). Filter error has K
from a Kalman filter with white gusts on every state's rate (Jategaonkar, ch. 5), or with gusts that last where the
velocity through the air is a state: fewer unknowns, if gusts come in so.
The covariance of the errors alternates with Fisher scoring; derivatives by complex steps are exact to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.flights.excitation import CONTROLLER, excitations, of_inputs
from swashplate.flights.flight import Flight
from swashplate.identification.core.records import Record, uniform_table
from swashplate.identification.core.result import Estimate
from swashplate.identification.estimators import GAINS, Question
from swashplate.identification.time.linear_filter import RATES, VELOCITIES, FilterErrors, GustErrors
from swashplate.identification.time.linear_likelihood import LinearErrors
from swashplate.identification.time.record_fit import SOLVER, RecordEstimator, RecordProblem
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

_TORN = 5.0
"""Standard deviations of the difference: an earlier fit's bounds are some times too narrow themselves."""


@dataclass(frozen=True)
class LinearKind:
    """State-space models."""

    takes = frozenset({"gusts", "shifts", "biases"})
    solver = SOLVER

    def unsuited(self, model: Vehicle | StateSpaceModel) -> str:
        return "" if isinstance(model, StateSpaceModel) else "it fits state-space models"

    def problem(
        self, model: StateSpaceModel, flights: Sequence[Flight], question: Question, *, method: str
    ) -> RecordProblem[StateSpaceModel]:
        names, shifts, gain = tuple(question.outputs or model.outputs), question.shifts is not False, GAINS[method]
        kind = _likelihood_of(model, method, question.gusts)
        pieces, delays = linear_records(model, flights, names, biases=question.biases)
        driven = of_inputs(excitations(flights, model.inputs, outputs=names))
        model = model.with_unmoved(name for name, one in driven.items() if one.kind == CONTROLLER)
        likelihood = kind(model, names, pieces, shifts, tuple(question.biases), delays=delays, gain=gain != "none")
        # Of a model that no fit has brought near, the errors would be taken for gusts and the gain led astray.
        many = gain == "free" or kind is GustErrors
        near = many and all(np.isfinite(model.parameters[n].cramer_rao) for n in model.free)

        def identified(estimates: Mapping[str, Estimate]) -> StateSpaceModel:
            bounds = {n: (estimates[n].best_sigma, estimates[n].insensitivity) for n in model.free}
            return model.with_values({n: estimates[n].value for n in model.free}).with_bounds(bounds)

        settings = {"shifts": shifts, "biases": list(question.biases)}
        return RecordProblem(
            likelihood,
            model,
            method,
            flights,
            identified,
            settings if question.gusts is None else {**settings, "gusts": question.gusts},
            warnings_of=lambda estimates: (*torn(estimates, model), *hold_remarks(model, delays, pieces)),
            begin=likelihood.begun() if near else None,
            around=near,
        )


def _likelihood_of(model: StateSpaceModel, method: str, gusts: str | None) -> type[LinearErrors]:
    """By the gain, and where it comes from the noise by the gusts."""
    if gusts is not None and method != "filter-error":
        raise IdentificationError(
            f"'{method}' assumes no gusts: its gain is not made of noise.",
            channel="gusts",
            hint="Choose method filter-error, or leave it away.",
        )
    if gusts not in (None, "white", "lasting"):
        raise IdentificationError(f"is '{gusts}', expected white or lasting.", channel="gusts")
    if gusts == "lasting" and not GustErrors.suits(model):
        raise IdentificationError(
            f"'{model.name}' has no velocity or rate ({', '.join((*VELOCITIES, *RATES))}) that lasting gusts act on.",
            channel="gusts",
            hint="Choose white gusts, or method prediction-error: its free gain knows any.",
        )
    if method != "filter-error":
        return LinearErrors
    return GustErrors if gusts == "lasting" else FilterErrors


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
    worst = sorted(apart, key=lambda pair: -apart[pair])
    return [
        f"{len(apart)} of the model's parameters are more than {_TORN:g} bounds away from the fit that it comes from "
        f"({'; '.join(worst[:3])}): both cannot be right. Gusts that last, in a loop, bias a fit in time whose noise "
        "is white; validate both models on another flight."
    ]


def hold_remarks(
    model: StateSpaceModel, delays: Sequence[Expression | None], records: Sequence[Record]
) -> tuple[str, ...]:
    """What fitted delays count of a hold that no log tells of (decision 2): nothing where none is free."""
    fitted = sorted({name for delay in delays if delay for name in delay.names & set(model.free)})
    if not fitted:
        return ()
    half = max(0.5 * float(np.median(np.diff(record.time))) for record in records)
    return (
        f"{', '.join(fitted)}: inputs were taken straight between samples. Where a computer held its commands, this "
        f"delay is half of that hold longer than the aircraft's ({1e3 * half:.3g} ms if each was held until the next "
        "sample), which its bound does not know; a simulation or a design that holds commands counts that half twice.",
    )


def _delay_of(model: StateSpaceModel, outputs: Sequence[str], input: str) -> Expression | None:
    lags = {e.text: e for o in outputs if (e := model.delays.get(f"{o}/{input}", model.delays.get(input))) is not None}
    if len(lags) > 1:
        raise IdentificationError(
            f"has different delays to different outputs ({', '.join(lags)}).",
            channel=input,
            hint="Give the input one delay; the fit in time delays inputs.",
        )
    return next(iter(lags.values()), None)


OUTPUT_ERROR, FILTER_ERROR, PREDICTION_ERROR = (RecordEstimator(method, LinearKind()) for method in GAINS)
