"""State-space models fitted in time: maximum likelihood under measurement noise, or with gusts by innovations.

    dx/dt = A x + B u(t - tau) + shift (+ gusts),    y = C x + D u(t - tau) + bias + v

Output error takes all noise for measurement noise (Jategaonkar 2015, ch. 4; Klein and Morelli 2006, ch. 6). Prediction
error corrects the state by K times the last innovation and fits K too: the innovations form, which knows any stationary
gusts and measurement noise, also where both come in by an accelerometer (Ljung 1999, sec. 7.3). Filter error has K
from a Kalman filter with white gusts on every state's rate: fewer unknowns, if gusts come in so (Jategaonkar, ch. 5).
The covariance of the errors alternates with Fisher scoring; derivatives by complex steps are exact to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Array, Flight
from swashplate.identification.expressions import Expression
from swashplate.identification.linear_filter import FilterErrors
from swashplate.identification.linear_likelihood import OutputErrors
from swashplate.identification.records import uniform_table
from swashplate.identification.response_cost import ParameterAccuracy
from swashplate.identification.scoring import Optimum, minimise
from swashplate.identification.state_space import StateSpaceModel

METHODS = ("output-error", "filter-error", "prediction-error")

VAGUE = 50.0
"""Percent of a value that a standard deviation may have before it is said."""


@dataclass(frozen=True)
class LinearTimeFit:
    """A model fitted to records in time.

    Attributes:
        model: identified. parameters: with standard deviations in `cramer_rao` (from the Fisher information).
        covariance: of the output errors (or innovations). method: one of `METHODS`.
        constants: start states, shifts and biases that were solved for, by name and record.
        history: cost after each iteration. converged: False where the iterations ran out.
    """

    model: StateSpaceModel
    parameters: tuple[ParameterAccuracy, ...]
    covariance: Array
    constants: Mapping[str, float]
    history: tuple[float, ...]
    converged: bool
    method: str = "output-error"
    warnings: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> ParameterAccuracy:
        return next(p for p in self.parameters if p.name == name)

    def __repr__(self) -> str:
        rows = [f"  {p.name:<12}{p.value:>12.5g} +- {p.cramer_rao:.2g}  {p.unit}" for p in self.parameters]
        told = [f"! {text}" for text in self.warnings]
        return "\n".join([f"{self.model.name} fitted in time by {self.method}", *rows, *told])

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words as JSON types."""
        return {
            "kind": "time-fit",
            "model": self.model.name,
            "method": self.method,
            "parameters": [vars(p) for p in self.parameters],
            "constants": dict(self.constants),
            "covariance": self.covariance.tolist(),
            "eigenvalues": [[float(v.real), float(v.imag)] for v in self.model.eigenvalues()],
            "converged": self.converged,
            "warnings": list(self.warnings),
            "sources": list(self.sources),
        }


def fit_in_time(
    model: StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
    shifts: bool = True,
    biases: Sequence[str] = (),
    method: str = "output-error",
    iterations: int = 80,
    progress: Callable[[int, float], None] | None = None,
) -> LinearTimeFit:
    """Fit a model's free parameters to records in time.

    Args:
        model: structure and start values. A delay belongs to an input; free ones are fitted.
        flights: conditioned; each unbroken piece is a record with its own start state and constants.
        outputs: channels to fit; all of the model's where None.
        shifts: constants in the states' rates, per record.
        biases: outputs with a constant of their own, per record.
        method: "output-error"; for records with gusts or an unstable aircraft "filter-error" (the gain by the gusts'
            intensities) or "prediction-error" (any gain).
        iterations: at most this many.
        progress: called with the iteration and the cost.

    Raises:
        IdentificationError: delays that differ between outputs, a model that diverges at its start values, an unknown
            method, or no free parameter.
    """
    flights = (flights,) if isinstance(flights, Flight) else tuple(flights)
    names = tuple(outputs or model.outputs)
    if method not in METHODS:
        raise IdentificationError(f"'{method}' is no method; there are {', '.join(METHODS)}.", channel="method")
    if not model.free:
        raise IdentificationError("has no free parameter.", channel=model.name)
    unknown = [o for o in (*names, *biases) if o not in model.outputs]
    if unknown:
        raise IdentificationError(f"is no output of '{model.name}'.", channel=", ".join(unknown))
    delays = tuple(_delay_of(model, names, i) for i in model.inputs)
    pieces, sources = [], []
    for flight in flights:
        for piece in flight.split():
            time, table = uniform_table(piece, (*model.inputs, *names), who=f"'{model.name}'")
            pieces.append((float((time[-1] - time[0]) / (time.size - 1)), table))
            sources.append(f"{piece.provenance.source or 'flight'} {time[0]:.2f}-{time[-1]:.2f} s")
    kind = FilterErrors if method == "filter-error" else OutputErrors
    likelihood = kind(model, names, pieces, shifts, tuple(biases), delays=delays, gain=method != "output-error")
    optimum = minimise(likelihood, iterations=iterations, tolerance=0.02, progress=progress)
    numbers = optimum.row * likelihood.row.scale
    spread = np.sqrt(np.diag(np.linalg.pinv(optimum.information, hermitian=True))) * likelihood.row.scale
    logarithmic = likelihood.row.column("logarithmic") > 0.0
    named = dict(
        zip(
            likelihood.row.names,
            np.where(logarithmic, np.exp(np.where(logarithmic, numbers, 0.0)), numbers),
            strict=True,
        )
    )
    found = model.with_values({n: float(named[n]) for n in model.free})
    k = len(model.free)
    parameters = tuple(
        ParameterAccuracy(
            n,
            model.parameters[n].unit,
            model.parameters[n].value,
            float(named[n]),
            float(spread[i]),
            1.0 / float(np.sqrt(optimum.information[i, i])) * float(likelihood.row.scale[i]),
            at_bound=n in optimum.at_bound,
        )
        for i, n in enumerate(model.free)
    )
    kept = {n: float(v) for n, v in list(named.items())[k:]}
    return LinearTimeFit(
        found,
        parameters,
        likelihood.covariance,
        kept,
        optimum.history,
        optimum.converged,
        method,
        _words(parameters, optimum),
        tuple(sources),
    )


def _words(parameters: Sequence[ParameterAccuracy], optimum: Optimum) -> tuple[str, ...]:
    words = [] if optimum.converged else ["the iterations ran out."]
    vague = [p.name for p in parameters if not p.cramer_rao_percent <= VAGUE]
    if vague:
        words.append(f"standard deviation above {VAGUE:g} %: {', '.join(vague)}; the records hardly tell them.")
    stopped = [p.name for p in parameters if p.at_bound]
    if stopped:
        words.append(f"ended on a bound: {', '.join(stopped)}.")
    return tuple(words)


def _delay_of(model: StateSpaceModel, outputs: Sequence[str], input: str) -> Expression | None:
    found = {e.text: e for o in outputs if (e := model.delays.get(f"{o}/{input}", model.delays.get(input))) is not None}
    if len(found) > 1:
        raise IdentificationError(
            f"has different delays to different outputs ({', '.join(found)}).",
            channel=input,
            hint="Give the input one delay; the fit in time delays inputs.",
        )
    return next(iter(found.values()), None)
