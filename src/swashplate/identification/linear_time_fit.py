"""State-space models fitted in time: maximum likelihood under measurement noise, or with gusts by prediction errors.

    dx/dt = A x + B u(t - tau) + shift (+ gusts),    y = C x + D u(t - tau) + bias + v

Output error takes all noise for measurement noise (Jategaonkar 2015, ch. 4; Klein and Morelli 2006, ch. 6). Prediction
error corrects the state by K times the last innovation and fits K too: the innovations form, which knows any stationary
gusts and measurement noise, also where both come in by an accelerometer (Ljung 1999, sec. 7.3; Jategaonkar, ch. 5).
The covariance of the errors alternates with Fisher scoring; derivatives by complex steps are exact to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Array, Flight
from swashplate.identification.expressions import Expression
from swashplate.identification.records import uniform_table
from swashplate.identification.response_cost import ParameterAccuracy
from swashplate.identification.rows import Entry, Row
from swashplate.identification.scoring import Optimum, minimise
from swashplate.identification.state_space import StateSpaceModel

METHODS = ("output-error", "prediction-error")

VAGUE = 50.0
"""Percent of a value that a standard deviation may have before it is said."""

_STEP = 1e-30
_FIRST_GAIN = 0.3
_DIVERGED = 1e9
_EXACT = 1e-6


@dataclass(frozen=True)
class LinearTimeFit:
    """A model fitted to records in time.

    Attributes:
        model: identified. parameters: with standard deviations in `cramer_rao` (from the Fisher information).
        covariance: of the output errors (or innovations). method: "output-error" or "prediction-error".
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
        method: "output-error", or "prediction-error" for records with gusts or an unstable aircraft.
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
    gain = method == "prediction-error"
    likelihood = _OutputErrors(model, names, pieces, shifts, tuple(biases), delays=delays, gain=gain)
    optimum = minimise(likelihood, iterations=iterations, tolerance=0.02, progress=progress)
    numbers = optimum.row * likelihood.row.scale
    spread = np.sqrt(np.diag(np.linalg.pinv(optimum.information, hermitian=True))) * likelihood.row.scale
    named = dict(zip(likelihood.row.names, numbers, strict=True))
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
    if optimum.at_bound:
        words.append(f"ended on a bound: {', '.join(optimum.at_bound)}.")
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


class _OutputErrors:
    """The likelihood of output errors or innovations; `refresh` takes their covariance anew for gradient and metric."""

    def __init__(
        self,
        model: StateSpaceModel,
        outputs: tuple[str, ...],
        pieces: Sequence[tuple[float, Array]],
        shifts: bool,
        biases: tuple[str, ...],
        *,
        delays: tuple[Expression | None, ...],
        gain: bool,
    ) -> None:
        self.delays = delays
        self.model, self.outputs, self.pieces = model, outputs, pieces
        self.rows_of = [model.outputs.index(o) for o in outputs]
        m = len(model.inputs)
        spread = np.std(np.concatenate([table[:, m:] for _, table in pieces]), axis=0) + 1e-12
        self.floor = (_EXACT * spread) ** 2
        self.covariance = np.diag((0.1 * spread) ** 2)
        entries = [
            Entry(n, "parameter", p.value, abs(p.value) or 1.0, p.lower, p.upper)
            for n in model.free
            for p in (model.parameters[n],)
        ]
        size = {s: float(spread[outputs.index(s)]) if s in outputs else 1.0 for s in model.states}
        for number in range(len(pieces)):
            for s in model.states:
                first = pieces[number][1][0, m + outputs.index(s)] if s in outputs else 0.0
                entries.append(Entry(f"start {s}[{number}]", "initial", float(first), 0.3 * size[s]))
                if shifts:
                    entries.append(Entry(f"shift {s}[{number}]", "nuisance", 0.0, 0.1 * size[s]))
            for o in biases:
                entries.append(Entry(f"bias {o}[{number}]", "nuisance", 0.0, 0.1 * float(spread[outputs.index(o)])))
        for s in model.states if gain else ():
            for o in outputs:
                entries.append(
                    Entry(f"gain {s}/{o}", "noise", _FIRST_GAIN * (s == o), 0.1 * size[s] / spread[outputs.index(o)])
                )
        self._row = Row(tuple(entries))
        self._place = {name: i for i, name in enumerate(self._row.names)}

    @property
    def row(self) -> Row:
        return self._row

    def refresh(self, row: Array) -> None:
        errors = self._errors(np.asarray(row * self.row.scale)[None])[0].real
        if np.all(np.isfinite(errors)) and np.max(np.abs(errors)) < _DIVERGED:
            self.covariance = self._covariance(errors)

    def _covariance(self, errors: Array) -> Array:
        return np.asarray(errors.T @ errors / len(errors) + np.diag(self.floor))

    def cost(self, row: Array) -> float:
        """Negative log-likelihood at its own covariance, without constants: n/2 log det S."""
        with np.errstate(over="ignore", invalid="ignore"):
            errors = self._errors(np.asarray(row * self.row.scale)[None])[0].real
        if not np.all(np.isfinite(errors)) or np.max(np.abs(errors)) > _DIVERGED:
            return float("inf")
        return 0.5 * len(errors) * float(np.linalg.slogdet(self._covariance(errors))[1])

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        numbers = np.asarray(row * self.row.scale)
        batch = numbers + 1j * _STEP * np.vstack([np.zeros(numbers.size), np.eye(numbers.size)])
        errors = self._errors(batch)
        plain, slopes = errors[0].real, errors[1:].imag / _STEP * self.row.scale[:, None, None]
        metric = np.linalg.inv(self.covariance)
        weighted = slopes @ metric
        gradient = np.einsum("pti,ti->p", weighted, plain)
        information = np.einsum("pti,qti->pq", weighted, slopes, optimize=True)
        return 0.5 * len(plain) * float(np.linalg.slogdet(self._covariance(plain))[1]), gradient, information

    def _matrices(self, numbers: Any) -> tuple[Any, Any, Any, Any, Any]:
        """A, B, C, D and the effect of rate shifts on the outputs, complex where the numbers are."""
        values = self.model.numbers(dict(zip(self.model.free, numbers, strict=False)))
        n, m, k = len(self.model.states), len(self.model.inputs), len(self.model.outputs)
        shapes = {"M": (n, n), "F": (n, n), "G": (n, m), "H0": (k, n), "H1": (k, n), "D": (k, m)}
        found = {s: np.zeros(shape, dtype=np.complex128) for s, shape in shapes.items()}
        found["M"] += np.eye(n)
        for e in self.model.elements:
            found[e.matrix][e.row, e.column] = e.expression(values)
        a, b = np.linalg.solve(found["M"], found["F"]), np.linalg.solve(found["M"], found["G"])
        h1 = found["H1"][self.rows_of]
        return a, b, found["H0"][self.rows_of] + h1 @ a, found["D"][self.rows_of] + h1 @ b, h1

    def _errors(self, batch: Any) -> Any:
        """Output errors of every record, one after the other, for a batch of rows: (n_batch, n_t, n_outputs)."""
        n, m = len(self.model.states), len(self.model.inputs)
        systems = [self._matrices(numbers) for numbers in batch]
        a, b, c, d, h1 = (np.stack(part) for part in zip(*systems, strict=True))
        gain = self._gain(batch)
        parts = []
        for number, (dt, table) in enumerate(self.pieces):
            shift = self._column(batch, f"shift {{}}[{number}]", self.model.states)
            bias = self._column(batch, f"bias {{}}[{number}]", self.outputs) + np.einsum("poi,pi->po", h1, shift)
            x = self._column(batch, f"start {{}}[{number}]", self.model.states)
            held = np.concatenate([b, np.broadcast_to(np.eye(n), (len(batch), n, n))], axis=2)
            width = m + n
            block = np.zeros((len(batch), n + 2 * width, n + 2 * width), dtype=np.complex128)
            block[:, :n, :n], block[:, :n, n : n + width] = a, held
            block[:, n : n + width, n + width :] = np.eye(width) / dt
            step = expm(block * dt)
            phi, g0, g1 = step[:, :n, :n], step[:, :n, n : n + width], step[:, :n, n + width :]
            u = self._late(batch, table[:, :m], dt)
            drive = np.einsum("pij,tpj->tpi", g0[:, :, :m], u[:-1]) + np.einsum(
                "pij,tpj->tpi", g1[:, :, :m], np.diff(u, axis=0)
            )
            drive = drive + np.einsum("pij,pj->pi", g0[:, :, m:], shift)
            through = np.einsum("pij,tpj->tpi", d, u) + bias
            errors = np.empty((len(table), len(batch), len(self.outputs)), dtype=np.complex128)
            for k in range(len(table)):
                errors[k] = table[k, m:] - through[k] - np.einsum("pij,pj->pi", c, x)
                if k + 1 < len(table):
                    x = np.einsum("pij,pj->pi", phi, x) + drive[k]
                    if gain is not None:
                        x = x + np.einsum("pij,pj->pi", gain, errors[k])
            parts.append(errors.transpose(1, 0, 2))
        return np.concatenate(parts, axis=1)

    def _late(self, batch: Any, u: Array, dt: float) -> Any:
        """Inputs later by their delays, straight between samples, (n_t, n_batch, n_inputs)."""
        late = np.broadcast_to(u[:, None, :], (len(u), len(batch), u.shape[1]))
        if not any(self.delays):
            return late
        late = late.astype(np.complex128)
        count = np.arange(len(u))
        for p, numbers in enumerate(batch):
            values = self.model.numbers(dict(zip(self.model.free, numbers, strict=False)))
            for i, delay in enumerate(self.delays):
                if delay is not None:
                    lag = delay(values) / dt
                    whole = int(np.floor(np.real(lag)))
                    near, far = (u[np.clip(count - k, 0, len(u) - 1), i] for k in (whole, whole + 1))
                    late[:, p, i] = near + (lag - whole) * (far - near)
        return late

    def _gain(self, batch: Any) -> Any:
        """Gains from innovations to states, (n_batch, n_states, n_outputs); None for output error."""
        places = [self._place.get(f"gain {s}/{o}") for s in self.model.states for o in self.outputs]
        if not places or places[0] is None:
            return None
        shape = (len(batch), len(self.model.states), len(self.outputs))
        return batch[:, [p for p in places if p is not None]].reshape(shape)

    def _column(self, batch: Any, pattern: str, names: Sequence[str]) -> Any:
        found = np.zeros((len(batch), len(names)), dtype=np.complex128)
        for i, name in enumerate(names):
            place = self._place.get(pattern.format(name))
            if place is not None:
                found[:, i] = batch[:, place]
        return found
