"""Likelihoods of a linear model's errors along records: output errors, and innovations with a free gain.

Every derivative is taken by complex steps through matrix exponentials and recursions, exact to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.linalg import expm

from swashplate.flights.flight import Array
from swashplate.identification.expressions import Expression
from swashplate.identification.rows import Entry
from swashplate.identification.state_space import StateSpaceModel
from swashplate.identification.time_likelihood import TimeErrors, gain_entries

STEP = 1e-30
"""Of the complex steps."""


class OutputErrors(TimeErrors):
    """The likelihood of a linear model's output errors, or of its innovations.

    Args:
        model: structure and start values. outputs: channels to fit.
        pieces: sample time [s] and table (inputs, then outputs) of every record.
        shifts: constants in the states' rates, per record. biases: outputs with a constant per record.
        delays: of the inputs. gain: whether innovations correct the states, by a free gain.
    """

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
        self.model, self._gained = model, gain
        self.rows_of = [model.outputs.index(o) for o in outputs]
        entries = [
            Entry(n, "parameter", p.value, abs(p.value) or 1.0, p.lower, p.upper)
            for n in model.free
            for p in (model.parameters[n],)
        ]
        super().__init__(
            entries, states=model.states, outputs=outputs, pieces=pieces, rest={}, shifts=shifts, biases=biases
        )

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        return gain_entries(self.model.states, size, spread) if self._gained else []

    def _plain(self, row: Array) -> Array:
        return np.asarray(self._errors(np.asarray(row * self.row.scale)[None])[0].real)

    def _with_slopes(self, row: Array) -> tuple[Array, Array]:
        errors = self._errors(self._stepped(row))
        return errors[0].real, errors[1:].imag / STEP * self.row.scale[:, None, None]

    def _stepped(self, row: Array) -> Any:
        """A row's numbers, plain and with a complex step in each."""
        numbers = np.asarray(row * self.row.scale)
        return numbers + 1j * STEP * np.vstack([np.zeros(numbers.size), np.eye(numbers.size)])

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

    def _systems(self, batch: Any) -> tuple[Any, ...]:
        return tuple(np.stack(part) for part in zip(*(self._matrices(numbers) for numbers in batch), strict=True))

    def _errors(self, batch: Any) -> Any:
        """Output errors of every record, one after the other, for a batch of rows: (n_batch, n_t, n_outputs)."""
        n, m = len(self.model.states), len(self.model.inputs)
        a, b, c, d, h1 = self._systems(batch)
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
            gain = self._gain(batch, a, c, phi, dt)
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

    def _gain(self, batch: Any, a: Any, c: Any, phi: Any, dt: float) -> Any:
        """Gains from innovations to the next states, (n_batch, n_states, n_outputs); None for output error."""
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
