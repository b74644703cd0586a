"""State-space models fitted in time: maximum likelihood under measurement noise, or with gusts by innovations.

    dx/dt = A x + B u(t - tau) + shift (+ gusts),    y = C x + D u(t - tau) + bias + v

Output error takes all noise for measurement noise (Jategaonkar 2015, ch. 4; Klein and Morelli 2006, ch. 6). Prediction
error corrects the state by K times the last innovation and fits K too: the innovations form, which knows any stationary
gusts and measurement noise, also where both come in by an accelerometer (Ljung 1999, sec. 7.3). Filter error has K
from a Kalman filter with white gusts on every state's rate: fewer unknowns, if gusts come in so (Jategaonkar, ch. 5).
The covariance of the errors alternates with Fisher scoring; derivatives by complex steps are exact to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.expressions import Expression
from swashplate.identification.linear_filter import FilterErrors
from swashplate.identification.linear_likelihood import OutputErrors
from swashplate.identification.records import uniform_table
from swashplate.identification.state_space import StateSpaceModel
from swashplate.identification.time_fit import TimeFit, check_method, solve


@dataclass(frozen=True, repr=False)
class LinearTimeFit(TimeFit[StateSpaceModel]):
    """A state-space model fitted to records in time or over frequencies."""

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words as JSON types, with the eigenvalues."""
        return {
            **super().as_dict(),
            "eigenvalues": [[float(v.real), float(v.imag)] for v in self.model.eigenvalues()],
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
    check_method(method)
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
    units = [model.parameters[n].unit for n in model.free]
    solved = solve(likelihood, units, iterations=iterations, progress=progress)
    return LinearTimeFit(
        model=model.with_values({n: solved.numbers[n] for n in model.free}),
        parameters=solved.parameters,
        covariance=likelihood.covariance,
        constants=solved.constants,
        history=solved.optimum.history,
        converged=solved.optimum.converged,
        method=method,
        warnings=solved.warnings,
        sources=tuple(sources),
    )


def _delay_of(model: StateSpaceModel, outputs: Sequence[str], input: str) -> Expression | None:
    found = {e.text: e for o in outputs if (e := model.delays.get(f"{o}/{input}", model.delays.get(input))) is not None}
    if len(found) > 1:
        raise IdentificationError(
            f"has different delays to different outputs ({', '.join(found)}).",
            channel=input,
            hint="Give the input one delay; the fit in time delays inputs.",
        )
    return next(iter(found.values()), None)
