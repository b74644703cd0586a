"""Likelihoods of a linear model's errors along records: output errors, and innovations with a free gain.

Derivatives are exact to rounding: by complex steps through matrix exponentials, then by the recursion of the slopes,
one filter for those of all numbers:

    x+ = phi x + g0 u + g1 (u+ - u) + push + gain e,    e = y - c x - d u - bias

The slopes of x run through phi - gain c, whatever number moves; what drives them is, for every number, a constant
matrix times the same few signals (states, inputs, their steps, errors). It is done for a block of samples at a time,
which stays in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.riccati import STEP
from swashplate.identification.core.likelihood import (
    NOTHING,
    Errors,
    MovedErrors,
    OwnCovariance,
    factor_of,
    gain_entries,
)
from swashplate.identification.core.missing_parts import MissingParts
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.records import Record
from swashplate.identification.time.first_gain import first_gain, kalman_gains
from swashplate.identification.time.linear_simulation import driven
from swashplate.identification.time.missing_answers import cross_controls, missing_answers
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import ModelParameter, StateSpaceModel
from swashplate.simulation.discretisation import first_order_hold

_BLOCK = 256
"""Samples."""


class Coefficients(NamedTuple):
    """What makes a record's errors, for a batch of models (first axis).

    Attributes:
        x: at the start. phi, c, gain, g0, g1, push, d, bias: as above.
        lag: of the inputs, in samples.
    """

    x: Any
    phi: Any
    c: Any
    gain: Any
    g0: Any
    g1: Any
    push: Any
    d: Any
    bias: Any
    lag: Any


def slopes_along(
    base: Coefficients, slope: Coefficients, inputs: Array, later: Array, errors: Array, states: Array
) -> Iterator[tuple[Array, Array]]:
    """Block by block the errors (n, n_outputs) and their slopes (n_entries, n, n_outputs).

    Args:
        base: of one model, without a batch.
        slope: their slopes by the entries; entries that move the gain alone stand last, and are missing in the others.
        inputs: later by their lags, (n_t, n_inputs). later: their slopes by the lag.
        errors, states: along the record, (n_t, n_outputs) and (n_t, n_states).
    """
    (n_t, k), n, few, many = errors.shape, base.phi.shape[0], len(slope.x), len(slope.gain)
    still = np.zeros((1, inputs.shape[1]))
    signals = [states, inputs, np.diff(inputs, axis=0, append=still), later, np.diff(later, axis=0, append=still)]
    signals += [np.ones((n_t, 1)), errors]
    lag = slope.lag[:, None, :]
    none = np.zeros_like(slope.d)
    outputs = -np.concatenate(
        [slope.c, slope.d, none, base.d * lag, none, slope.bias[:, :, None], np.zeros((few, k, k))], axis=2
    )
    driving = np.concatenate(
        [slope.phi, slope.g0, slope.g1, base.g0 * lag, base.g1 * lag, slope.push[:, :, None], slope.gain[:few]], axis=2
    )
    pushing = np.zeros((many, n, outputs.shape[2]))
    pushing[:few] = driving + base.gain @ outputs
    pushing[few:, :, -k:] = slope.gain[few:]
    by_signal, through = pushing.reshape(many * n, -1).T, outputs.reshape(few * k, -1).T
    table = np.hstack(signals)
    x = np.concatenate([slope.x, np.zeros((many - few, n))])
    loop = base.phi - base.gain @ base.c
    for at in range(0, n_t, _BLOCK):
        block = table[at : at + _BLOCK]
        count = len(block)
        ran, x = driven(x, loop, (block @ by_signal).reshape(count, many, n))
        slopes = (ran.reshape(-1, n) @ -base.c.T).reshape(count, many, k)
        slopes[:, :few] += (block @ through).reshape(count, few, k)
        yield errors[at : at + count], np.ascontiguousarray(np.moveaxis(slopes, 1, 0))


Batch = NDArray[np.float64] | NDArray[np.complex128]
"""Rows of numbers, complex where a step is in one of them."""

_FIRST_GUSTS = (0.3, 0.1, 0.03)
"""Shares of the states' sizes by which their rates are disturbed, in filters to begin with."""


class LinearErrors(OwnCovariance):
    """The likelihood of a linear model's output errors, or of its innovations.

    Args:
        model: structure and start values. outputs: channels to fit.
        records: measured inputs and outputs.
        shifts: constants in the states' rates, per record. biases: outputs with a constant per record.
        delays: of the inputs. gain: whether innovations correct the states, by a free gain.
    """

    def __init__(
        self,
        model: StateSpaceModel,
        outputs: tuple[str, ...],
        records: Sequence[Record],
        shifts: bool,
        biases: tuple[str, ...],
        *,
        delays: tuple[Expression | None, ...],
        gain: bool,
    ) -> None:
        self.delays = delays
        self.model, self._gained = model, gain
        self._states = (*model.states, *self._air())
        self.rows_of = [model.outputs.index(o) for o in outputs]
        entries = [
            Entry(n, "parameter", p.value, _size(p), p.lower, p.upper)
            for n in model.free
            for p in (model.parameters[n],)
        ]
        super().__init__(
            entries, states=model.states, outputs=outputs, records=records, rest={}, shifts=shifts, biases=biases
        )

    def _air(self) -> tuple[str, ...]:
        """States of the air that stand behind those of the model."""
        return ()

    def begun(self) -> Array:
        """A scaled row to begin with: the starts, with a free gain made better while all else is held."""
        row = self.row.starts()
        names = [f"gain {s}/{o}" for s in self.model.states for o in self.outputs]
        places = [self._place[name] for name in names if name in self._place]
        if not places:
            return row
        batch = self._stepped(row, NOTHING)
        model = self._coefficients(0, batch, self._systems(batch))
        phi, c = (np.ascontiguousarray(part[0].real) for part in (model.phi, model.c))

        def with_gain(gain: Array) -> Array:
            changed = row.copy()
            changed[places] = gain.ravel() / self.row.scale[places]
            return changed

        def run(gain: Array) -> tuple[float, list[Array]]:
            with np.errstate(over="ignore", invalid="ignore"):
                errors = self._errors_in_a_row(with_gain(gain))
            parts = [Errors(0, errors, factor_of(self.covariance))]
            return self.cost_of(parts), self._by_record(errors)

        sizes = 10.0 * np.sqrt(np.diag(self.covariance))
        size = np.array([dict(zip(self.outputs, sizes, strict=True)).get(s, 1.0) for s in self.model.states])
        gusts = [np.diag((share * size) ** 2 * self.records[0].dt) for share in _FIRST_GUSTS]
        given = (row * self.row.scale)[places].reshape(phi.shape[0], -1)
        cost, gain = first_gain(phi, c, [given, *kalman_gains(phi, c, gusts, self.covariance)], run)
        return with_gain(gain) if np.isfinite(cost) else row

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        return gain_entries(self.model.states, size, spread) if self._gained else []

    def _errors_in_a_row(self, row: Array) -> Array:
        loops = self._loops(self._stepped(row, NOTHING))
        return np.concatenate([_ran(*(np.real(part) for part in one))[0] for (one,) in loops])

    def moved_errors(self, row: Array) -> Iterator[MovedErrors]:
        factor = factor_of(self.covariance)
        for number in range(len(self.records)):
            places, noises = self._places_of_record(number)
            base, tangents = self._tangents(number, row, places, noises)
            shifted, later = self._later(number, base.lag)
            inputs = np.real(shifted)
            errors, states = _ran(*base[:4], *self._driven(number, base, inputs))
            every = np.concatenate([places, noises])
            for part, slopes in slopes_along(base, tangents, inputs, later, errors, states):
                yield MovedErrors(number, part, factor, every, slopes)

    def missing_parts(self, row: Array) -> MissingParts | None:
        batch, spread = self._stepped(row, NOTHING), np.std(np.concatenate([r.inputs for r in self.records]), axis=0)
        a, b, *_ = systems = self._systems(batch)
        delays = np.maximum(np.real(self._lags(batch[0])), 0.0)
        crossed = cross_controls(np.real(b[0]), spread)
        lagged = np.flatnonzero((delays > 0.0) & (spread > 0.0))
        if not crossed and not lagged.size:
            return None
        slopes, factor = [], factor_of(self.covariance)
        for number, record in enumerate(self.records):
            stepped = self._coefficients(number, batch, systems)
            base = Coefficients(*(np.ascontiguousarray(part[0].real) for part in stepped))
            inputs = np.real(self._later(number, base.lag)[0])
            answers = missing_answers(base, np.real(a[0]), inputs, record.dt, crossed, lagged, delays)
            slopes.append(-Errors(number, answers[0], factor).whitened(answers))
        if not all(np.isfinite(part).all() for part in slopes):  # a model that runs away from its records
            return None
        names = [f"{self.model.inputs[j]} acting on {self.model.states[k]}" for k, j, _ in crossed]
        names += [f"a lag in the delay of {self.model.inputs[j]}" for j in lagged]
        return MissingParts(tuple(names), tuple(slopes))

    def _places_of_record(self, number: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Places of the entries that move a record's errors: by more than the gain, and by the gain alone."""
        names, groups = self.row.names, [entry.group for entry in self.row.entries]
        ours = [i for i, n in enumerate(names) if n.endswith(f"[{number}]") or not n.endswith("]")]
        more, gain = [i for i in ours if groups[i] != "noise"], [i for i in ours if groups[i] == "noise"]
        return np.array(more, dtype=np.intp), np.array(gain, dtype=np.intp)

    def _tangents(
        self, number: int, row: Array, places: NDArray[np.intp], noises: NDArray[np.intp]
    ) -> tuple[Coefficients, Coefficients]:
        """What makes one record's errors, and its slopes by the scaled row at places and noises, those first."""
        batch = self._stepped(row, places)
        systems = self._systems(batch)
        stepped = self._coefficients(number, batch, systems)
        base = Coefficients(*(np.ascontiguousarray(part[0].real) for part in stepped))
        tangents = Coefficients(*(part[1:].imag / STEP for part in stepped))
        if not noises.size:
            return base, tangents
        noisy, still = self._stepped(row, noises), (systems[0], systems[2], stepped.phi)
        a, c, phi = (np.broadcast_to(part[:1], (len(noisy), *part.shape[1:])) for part in still)
        gain = self._gain(noisy, a, c, phi, self.records[number].dt)[1:].imag / STEP
        return base, tangents._replace(gain=np.concatenate([tangents.gain, gain]))

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """Per record errors ahead, and their slopes by some entries of the scaled row, (places, starts, ...)."""
        parts = self._ahead(self._stepped(row, places), ahead)
        return [part[0].real for part in parts], [part[1:].imag / STEP for part in parts]

    def _ahead(self, batch: Batch, ahead: Ahead) -> list[Any]:
        """Errors ahead of every record for a batch of rows, (n_batch, starts, horizons, outputs) each."""
        by_record = []
        for loops, starts in zip(self._loops(batch), ahead.starts, strict=True):
            after = np.stack([_ran(*loop)[1][np.array(starts, dtype=int) + 1] for loop in loops])
            _, phi, c, _, measured, drive = (np.stack(part) for part in zip(*loops, strict=True))
            errors = []
            for step in range(1, ahead.steps[-1] + 1):
                k = np.array(starts, dtype=int) + step
                if step in ahead.steps:
                    errors.append(measured[:, k] - after @ c.swapaxes(1, 2))
                after = after @ phi.swapaxes(1, 2) + drive[:, k]
            by_record.append(np.stack(errors, axis=2))
        return by_record

    def _stepped(self, row: Array, places: Places) -> Any:
        """A scaled row's numbers, and behind them with a complex step in some entries of the row."""
        steps = np.vstack([np.zeros(row.size), np.diag(self.row.scale)[places]])
        return row * self.row.scale + 1j * STEP * steps

    def _matrices(self, numbers: Batch) -> tuple[Any, Any, Any, Any, Any]:
        """A, B, C, D and the effect of rate shifts on the outputs, complex where the numbers are."""
        values = self.model.numbers(dict(zip(self.model.free, numbers, strict=False)))
        n, m, k = len(self.model.states), len(self.model.inputs), len(self.model.outputs)
        shapes = {"M": (n, n), "F": (n, n), "G": (n, m), "H0": (k, n), "H1": (k, n), "D": (k, m)}
        matrices = {s: np.zeros(shape, dtype=np.complex128) for s, shape in shapes.items()}
        matrices["M"] += np.eye(n)
        for e in self.model.elements:
            matrices[e.matrix][e.row, e.column] = e.expression(values)
        a, b = np.linalg.solve(matrices["M"], matrices["F"]), np.linalg.solve(matrices["M"], matrices["G"])
        h1 = matrices["H1"][self.rows_of]
        return a, b, matrices["H0"][self.rows_of] + h1 @ a, matrices["D"][self.rows_of] + h1 @ b, h1

    def _systems(self, batch: Batch) -> tuple[Any, ...]:
        return tuple(np.stack(part) for part in zip(*(self._matrices(numbers) for numbers in batch), strict=True))

    def _loops(self, batch: Batch) -> Iterator[list[tuple[Any, ...]]]:
        """Of every record and model of a batch, what `_ran` takes."""
        systems = self._systems(batch)
        for number in range(len(self.records)):
            models = [Coefficients(*one) for one in zip(*self._coefficients(number, batch, systems), strict=True)]
            yield [(*one[:4], *self._driven(number, one, self._later(number, one.lag)[0])) for one in models]

    def _coefficients(self, number: int, batch: Batch, systems: tuple[Any, ...]) -> Coefficients:
        """What makes one record's errors, for a batch of rows."""
        n, m = len(self._states), len(self.model.inputs)
        a, b, c, d, h1 = systems
        dt = self.records[number].dt
        shift = self._column(batch, f"shift {{}}[{number}]", self._states)
        held = np.concatenate([b, np.broadcast_to(np.eye(n), (len(batch), n, n))], axis=2)
        phi, g0, g1 = first_order_hold(a, held, dt)
        return Coefficients(
            x=self._column(batch, f"start {{}}[{number}]", self._states),
            phi=phi,
            c=c,
            gain=self._gain(batch, a, c, phi, dt),
            g0=g0[:, :, :m],
            g1=g1[:, :, :m],
            push=np.einsum("pij,pj->pi", g0[:, :, m:], shift),
            d=d,
            bias=self._column(batch, f"bias {{}}[{number}]", self.outputs) + np.einsum("poi,pi->po", h1, shift),
            lag=np.array([self._lags(numbers) for numbers in batch]) / dt,
        )

    def _lags(self, numbers: Batch) -> list[Any]:
        """Delay of every input [s]."""
        if not any(self.delays):
            return [0.0] * len(self.delays)
        values = self.model.numbers(dict(zip(self.model.free, numbers, strict=False)))
        return [0.0 if delay is None else delay(values) for delay in self.delays]

    def _driven(self, number: int, model: Coefficients, u: Batch) -> tuple[Any, Any]:
        """Of one model along one record: what is measured less what goes through, and what drives the states."""
        drive = u @ model.g0.T + model.push
        drive[:-1] += np.diff(u, axis=0) @ model.g1.T
        drive[-1] = 0.0
        return self.records[number].outputs - u @ model.d.T - model.bias, drive

    def _later(self, number: int, lags: Batch) -> tuple[Batch, Array]:
        """A record's inputs later by their lags [samples], straight between samples, and their slopes by the lags."""
        u = self.records[number].inputs
        full = np.floor(np.real(lags)).astype(int)
        at = np.arange(len(u))[:, None] - full
        near, far = (np.take_along_axis(u, np.clip(at - k, 0, len(u) - 1), axis=0) for k in (0, 1))
        return near + (lags - full) * (far - near), far - near

    def _gain(self, batch: Batch, a: Batch, c: Batch, phi: Batch, dt: float) -> Any:
        """Gains from innovations to the next states, (n_batch, n_states, n_outputs); zero for output error."""
        columns = [self._column(batch, f"gain {s}/{{}}", self.outputs) for s in self.model.states]
        return np.stack(columns, axis=1)

    def _column(self, batch: Batch, pattern: str, names: Sequence[str]) -> Any:
        columns = np.zeros((len(batch), len(names)), dtype=np.complex128)
        for i, name in enumerate(names):
            place = self._place.get(pattern.format(name))
            if place is not None:
                columns[:, i] = batch[:, place]
        return columns


def _size(p: ModelParameter) -> float:
    """By which a parameter may move: its value, or its bound where an earlier fit hardly told it."""
    return max(abs(p.value), p.cramer_rao if np.isfinite(p.cramer_rao) else 0.0) or 1.0


def _ran(x: Batch, phi: Batch, c: Batch, gain: Batch, measured: Batch, drive: Batch) -> tuple[Any, Any]:
    """Errors of one model along a record (n_t, n_outputs), and the states predicted for each sample (n_t, n_states).

    Args:
        x, phi, c, gain: states at the start, transition, outputs' and innovations' matrices.
        measured: less what goes through. drive: of the states to the next sample.
    """
    states = driven(x[None], phi - gain @ c, (drive + measured @ gain.T)[:, None])[0][:, 0]
    return measured - states @ c.T, states
