"""Likelihoods of a linear model's errors along records: output errors, and innovations with a free gain.

Derivatives are exact to rounding: by complex steps through matrix exponentials, then by the recursion of the slopes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.filter_loop import filtered
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.records import Record
from swashplate.identification.core.time_likelihood import Moved, TimeErrors, gain_entries
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.simulation.discretisation import first_order_hold
from swashplate.simulation.dynamics import enable_double_precision

Batch = NDArray[np.float64] | NDArray[np.complex128]
"""Rows of numbers, complex where a step is in one of them."""

STEP = 1e-30
"""Of the complex steps."""

_BLOCK = 128
"""Samples that are turned over together."""


class OutputErrors(TimeErrors):
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
        self.rows_of = [model.outputs.index(o) for o in outputs]
        entries = [
            Entry(n, "parameter", p.value, abs(p.value) or 1.0, p.lower, p.upper)
            for n in model.free
            for p in (model.parameters[n],)
        ]
        super().__init__(
            entries, states=model.states, outputs=outputs, records=records, rest={}, shifts=shifts, biases=biases
        )

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        return gain_entries(self.model.states, size, spread) if self._gained else []

    def _plain(self, row: Array) -> Array:
        return np.asarray(self._errors(np.asarray(row * self.row.scale)[None])[0].real)

    def _moved(self, row: Array) -> Iterator[Moved]:
        """By a recursion of the slopes alone, which all entries share: x' = (Phi - K C) x + what an entry adds."""
        for number in range(len(self.records)):
            places, noises = self._own(number)
            base, added = self._tangents(number, row, places, noises)
            x, phi, c, gain, measured, drive = (part[None] for part in base)
            errors = np.asarray(_recursion()(x, phi, c, gain, measured[0][:, None], drive[0][:, None]))[0]
            after = np.asarray(_states()(x, phi, c, gain, measured[0][:, None], drive[0][:, None]))[0]
            slopes = _slopes(base, added, errors, np.concatenate([x, after[:-1]]))
            every = np.concatenate([places, noises])
            slopes *= self.row.scale[every][:, None, None]
            yield every, errors, slopes

    def _own(self, number: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Places of the entries that move a record's errors: by more than the gain, and by the gain alone."""
        names, groups = self.row.names, [entry.group for entry in self.row.entries]
        ours = [i for i, n in enumerate(names) if n.endswith(f"[{number}]") or not n.endswith("]")]
        more, gain = [i for i in ours if groups[i] != "noise"], [i for i in ours if groups[i] == "noise"]
        return np.array(more, dtype=np.intp), np.array(gain, dtype=np.intp)

    def _tangents(
        self, number: int, row: Array, places: NDArray[np.intp], noises: NDArray[np.intp]
    ) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """What `_recursion` takes for one record, and its slopes by the numbers at places and noises, those first."""
        batch = self._stepped(row, places)
        systems = self._systems(batch)
        loop = self._loop(number, batch, systems)
        base = tuple(np.ascontiguousarray(part[0].real) for part in loop[:4])
        base += tuple(np.ascontiguousarray(part[:, 0].real) for part in loop[4:])
        x, phi, c, gain = (part[1:].imag / STEP for part in loop[:4])
        measured, drive = (part[:, 1:].imag / STEP for part in loop[4:])
        if noises.size:
            noisy = self._stepped(row, noises)
            still = (systems[0], systems[2], loop[1])
            a0, c0, phi0 = (np.broadcast_to(part[:1], (len(noisy), *part.shape[1:])) for part in still)
            moved = self._gain(noisy, a0, c0, phi0, self.records[number].dt)[1:].imag / STEP
            gain = np.concatenate([gain, moved])
        return base, (x, phi, c, gain, measured, drive)

    def errors_ahead(self, row: Array, ahead: Ahead) -> list[Array]:
        """Per record, measured less predicted from the filter's states, (starts, horizons, outputs)."""
        return [part[0].real for part in self._ahead(np.asarray(row * self.row.scale)[None], ahead)]

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """The same, and the slopes by some entries of the scaled row, (places, starts, horizons, outputs)."""
        parts = self._ahead(self._stepped(row, places), ahead)
        scale = self.row.scale[places][:, None, None, None]
        return [part[0].real for part in parts], [part[1:].imag / STEP * scale for part in parts]

    def _ahead(self, batch: Batch, ahead: Ahead) -> list[Any]:
        """Errors ahead of every record for a batch of rows, (n_batch, starts, horizons, outputs) each."""
        steps = np.array(ahead.steps)
        found = []
        for (x, phi, c, gain, measured, drive), starts in zip(self._loops(batch), ahead.starts, strict=True):
            after = np.asarray(_states()(x, phi, c, gain, measured, drive))[:, np.array(starts, dtype=int)]
            told = []
            for step in range(1, steps[-1] + 1):
                k = np.array(starts, dtype=int) + step
                if step in ahead.steps:
                    told.append(measured[k].transpose(1, 0, 2) - np.einsum("pij,psj->psi", c, after))
                after = np.einsum("pij,psj->psi", phi, after) + drive[k].transpose(1, 0, 2)
            found.append(np.stack(told, axis=2))
        return found

    def _stepped(self, row: Array, places: Places | None = None) -> Any:
        """A row's numbers, plain and with a complex step in each, or in some."""
        numbers = np.asarray(row * self.row.scale)
        stepped = np.eye(numbers.size) if places is None else np.eye(numbers.size)[places]
        return numbers + 1j * STEP * np.vstack([np.zeros(numbers.size), stepped])

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

    def _systems(self, batch: Batch) -> tuple[Any, ...]:
        return tuple(np.stack(part) for part in zip(*(self._matrices(numbers) for numbers in batch), strict=True))

    def _errors(self, batch: Batch) -> Any:
        """Output errors of every record, one after the other, for a batch of rows: (n_batch, n_t, n_outputs)."""
        return np.concatenate([np.asarray(_recursion()(*loop)) for loop in self._loops(batch)], axis=1)

    def _loops(self, batch: Batch) -> Iterator[tuple[Any, ...]]:
        """Of every record, what `_recursion` takes."""
        systems = self._systems(batch)
        for number in range(len(self.records)):
            yield self._loop(number, batch, systems)

    def _loop(self, number: int, batch: Batch, systems: tuple[Any, ...]) -> tuple[Any, ...]:
        """The same of one record."""
        n, m = len(self.model.states), len(self.model.inputs)
        a, b, c, d, h1 = systems
        record = self.records[number]
        dt, measured = record.dt, record.outputs[:, None, :]
        shift = self._column(batch, f"shift {{}}[{number}]", self.model.states)
        bias = self._column(batch, f"bias {{}}[{number}]", self.outputs) + np.einsum("poi,pi->po", h1, shift)
        x = self._column(batch, f"start {{}}[{number}]", self.model.states)
        held = np.concatenate([b, np.broadcast_to(np.eye(n), (len(batch), n, n))], axis=2)
        phi, g0, g1 = first_order_hold(a, held, dt)
        gain = self._gain(batch, a, c, phi, dt)
        u = self._late(batch, record.inputs, dt)
        drive = _times(g0[:, :, :m], u[:-1]) + _times(g1[:, :, :m], np.diff(u, axis=0))
        drive = drive + np.einsum("pij,pj->pi", g0[:, :, m:], shift)
        through = _times(d, u) + bias
        drive = np.concatenate([drive, np.zeros_like(drive[:1])])
        return x, phi, c, gain, measured - through, drive

    def _late(self, batch: Batch, u: Array, dt: float) -> Any:
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

    def _gain(self, batch: Batch, a: Any, c: Any, phi: Any, dt: float) -> Any:
        """Gains from innovations to the next states, (n_batch, n_states, n_outputs); zero for output error."""
        columns = [self._column(batch, f"gain {s}/{{}}", self.outputs) for s in self.model.states]
        return np.stack(columns, axis=1)

    def _column(self, batch: Batch, pattern: str, names: Sequence[str]) -> Any:
        found = np.zeros((len(batch), len(names)), dtype=np.complex128)
        for i, name in enumerate(names):
            place = self._place.get(pattern.format(name))
            if place is not None:
                found[:, i] = batch[:, place]
        return found


def _slopes(base: Sequence[Array], added: Sequence[Array], errors: Array, states: Array) -> Array:
    """Of a record's errors, (n_entries, n_t, n_outputs).

    Args:
        base, added: what `_recursion` takes, and its slopes; those by the gain alone come last, and only in the gains.
        errors, states: along the record, (n_t, n_outputs) and (n_t, n_states).
    """
    _, phi, c, gain, _, _ = base
    dx, dphi, dc, dgain, dmeasured, ddrive = added
    (n_t, k), n, few, many = errors.shape, phi.shape[0], len(dx), len(dgain)
    direct = np.moveaxis(dmeasured, 1, 0) - states @ np.swapaxes(dc, 1, 2)
    pushed = (errors @ dgain.reshape(-1, k).T).reshape(n_t, many, n)
    pushed[:, :few] += ddrive + np.moveaxis(states @ np.swapaxes(dphi, 1, 2) + direct @ gain.T, 1, 0)
    begin = np.concatenate([dx, np.zeros((many - few, n))])
    moved = np.asarray(_linear()(begin, phi - gain @ c, pushed))
    slopes = np.empty((many, n_t, k))
    for at in range(0, n_t, _BLOCK):  # few samples at a time stay in the processor's cache
        some = moved[at : at + _BLOCK]
        slopes[:, at : at + _BLOCK] = np.moveaxis((some.reshape(-1, n) @ -c.T).reshape(len(some), many, k), 1, 0)
    slopes[:few] += direct
    return slopes


def _times(matrices: Batch, rows: Batch) -> Batch:
    """Matrices (n_batch, i, j) times rows (n_t, n_batch, j)."""
    return np.moveaxis(np.moveaxis(rows, 1, 0) @ np.swapaxes(matrices, 1, 2), 0, 1)


@cache
def _linear() -> Any:
    """x of every sample, (n_t, n_entries, n_states), where the next is x Phi' + push; compiled for its shapes."""
    enable_double_precision()

    def run(x: jax.Array, phi: jax.Array, pushed: jax.Array) -> jax.Array:
        return jax.lax.scan(lambda x, push: (x @ phi.T + push, x), x, pushed)[1]

    return jax.jit(run)


@cache
def _recursion() -> Any:
    """Errors of a batch of models along one record, (n_batch, n_t, n_outputs), compiled for its shapes.

    Arguments, by model first: states at the start, transitions, outputs' and innovations' matrices; by sample first:
    what is measured less what goes through, and what drives the states to the next sample.
    """
    return _compiled(lambda errors, states: errors)


@cache
def _states() -> Any:
    """The states predicted for the sample after each, (n_batch, n_t, n_states), compiled; arguments as before."""
    return _compiled(lambda errors, states: states)


def _compiled(chosen: Callable[[jax.Array, jax.Array], jax.Array]) -> Any:
    """The innovations' form along a record for a batch of models: what is chosen of errors and predicted states."""
    enable_double_precision()

    def one(x: Any, phi: Any, c: Any, gain: Any, measured: Any, drive: Any) -> Any:
        def correct(x: Any, y: Any, drive: Any) -> Any:
            error = y - c @ x
            return (x, drive + gain @ error), error

        def predict(state: tuple[Any, Any], _: Any) -> Any:
            x, pushed = state
            return phi @ x + pushed

        errors, states = filtered(x, measured, drive, correct=correct, predict=predict)
        return chosen(errors, states[0] @ phi.T + states[1])

    return jax.jit(jax.vmap(one, in_axes=(0, 0, 0, 0, 1, 1)))
