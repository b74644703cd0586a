"""State-space models fitted in time by output error: maximum likelihood under measurement noise.

    dx/dt = A x + B u + shift,    y = C x + D u + bias + v

The covariance of v alternates with Fisher scoring (Jategaonkar 2015, ch. 4; Klein and Morelli 2006, ch. 6); derivatives
by complex steps are exact to rounding. An unstable aircraft is fitted where its record is short against its growth;
gusts, which this method does not know, go into the noise and make its bounds too small.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Array, Flight
from swashplate.identification.records import uniform_table
from swashplate.identification.response_cost import ParameterAccuracy
from swashplate.identification.rows import Entry, Row
from swashplate.identification.scoring import minimise
from swashplate.identification.state_space import StateSpaceModel

_STEP = 1e-30


@dataclass(frozen=True)
class LinearTimeFit:
    """A model fitted to records in time.

    Attributes:
        model: identified. parameters: with standard deviations in `cramer_rao` (from the Fisher information).
        covariance: of the output errors.
        constants: start states, shifts and biases that were solved for, by name and record.
        history: cost after each iteration. converged: False where the iterations ran out.
    """

    model: StateSpaceModel
    parameters: tuple[ParameterAccuracy, ...]
    covariance: Array
    constants: Mapping[str, float]
    history: tuple[float, ...]
    converged: bool

    def __getitem__(self, name: str) -> ParameterAccuracy:
        return next(p for p in self.parameters if p.name == name)

    def __repr__(self) -> str:
        rows = [f"  {p.name:<12}{p.value:>12.5g} +- {p.cramer_rao:.2g}  {p.unit}" for p in self.parameters]
        return "\n".join([f"{self.model.name} fitted in time", *rows])


def fit_in_time(
    model: StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
    shifts: bool = True,
    biases: Sequence[str] = (),
    iterations: int = 80,
) -> LinearTimeFit:
    """Fit a model's free parameters to records in time.

    Args:
        model: structure and start values; its delays must be zero (shift the inputs beforehand).
        flights: conditioned; each unbroken piece is a record with its own start state and constants.
        outputs: channels to fit; all of the model's where None.
        shifts: constants in the states' rates, per record.
        biases: outputs with a constant of their own, per record.
        iterations: at most this many.

    Raises:
        IdentificationError: a model with delays, or one that diverges at its start values.
    """
    flights = (flights,) if isinstance(flights, Flight) else tuple(flights)
    names = tuple(outputs or model.outputs)
    if any(model.delay(o, i) for o in names for i in model.inputs):
        raise IdentificationError(
            "has delays, which the fit in time does not move.",
            channel=model.name,
            hint="Shift the inputs, fix them at 0.",
        )
    pieces = []
    for flight in flights:
        for piece in flight.split():
            time, table = uniform_table(piece, (*model.inputs, *names), who=f"'{model.name}'")
            pieces.append((float((time[-1] - time[0]) / (time.size - 1)), table))
    likelihood = _OutputErrors(model, names, pieces, shifts, tuple(biases))
    optimum = minimise(likelihood, iterations=iterations, tolerance=1e-3)
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
    return LinearTimeFit(found, parameters, likelihood.covariance, kept, optimum.history, optimum.converged)


class _OutputErrors:
    """Half the sum of squared output errors in the metric of their covariance, which `refresh` takes anew."""

    def __init__(
        self,
        model: StateSpaceModel,
        outputs: tuple[str, ...],
        pieces: Sequence[tuple[float, Array]],
        shifts: bool,
        biases: tuple[str, ...],
    ) -> None:
        self.model, self.outputs, self.pieces = model, outputs, pieces
        self.rows_of = [model.outputs.index(o) for o in outputs]
        m = len(model.inputs)
        spread = np.std(np.concatenate([table[:, m:] for _, table in pieces]), axis=0) + 1e-12
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
        self._row = Row(tuple(entries))
        self._place = {name: i for i, name in enumerate(self._row.names)}

    @property
    def row(self) -> Row:
        return self._row

    def refresh(self, row: Array) -> None:
        errors = self._errors(np.asarray(row * self.row.scale)[None])[0].real
        if np.all(np.isfinite(errors)) and np.max(np.abs(errors)) < 1e9:
            self.covariance = errors.T @ errors / len(errors) + 1e-12 * np.diag(np.diag(self.covariance))

    def cost(self, row: Array) -> float:
        with np.errstate(over="ignore", invalid="ignore"):
            errors = self._errors(np.asarray(row * self.row.scale)[None])[0].real
            value = 0.5 * float(np.einsum("ti,ij,tj->", errors, np.linalg.inv(self.covariance), errors))
        return value if np.isfinite(value) else float("inf")

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        numbers = np.asarray(row * self.row.scale)
        batch = numbers + 1j * _STEP * np.vstack([np.zeros(numbers.size), np.eye(numbers.size)])
        errors = self._errors(batch)
        plain, slopes = errors[0].real, errors[1:].imag / _STEP * self.row.scale[:, None, None]
        metric = np.linalg.inv(self.covariance)
        weighted = slopes @ metric
        gradient = np.einsum("pti,ti->p", weighted, plain)
        information = np.einsum("pti,qti->pq", weighted, slopes, optimize=True)
        return 0.5 * float(np.einsum("ti,ij,tj->", plain, metric, plain)), gradient, information

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
            u = table[:, :m]
            drive = np.einsum("pij,tj->tpi", g0[:, :, :m], u[:-1]) + np.einsum(
                "pij,tj->tpi", g1[:, :, :m], np.diff(u, axis=0)
            )
            drive = drive + np.einsum("pij,pj->pi", g0[:, :, m:], shift)
            through = np.einsum("pij,tj->tpi", d, u) + bias
            errors = np.empty((len(table), len(batch), len(self.outputs)), dtype=np.complex128)
            for k in range(len(table)):
                errors[k] = table[k, m:] - through[k] - np.einsum("pij,pj->pi", c, x)
                if k + 1 < len(table):
                    x = np.einsum("pij,pj->pi", phi, x) + drive[k]
            parts.append(errors.transpose(1, 0, 2))
        return np.concatenate(parts, axis=1)

    def _column(self, batch: Any, pattern: str, names: Sequence[str]) -> Any:
        found = np.zeros((len(batch), len(names)), dtype=np.complex128)
        for i, name in enumerate(names):
            place = self._place.get(pattern.format(name))
            if place is not None:
                found[:, i] = batch[:, place]
        return found
