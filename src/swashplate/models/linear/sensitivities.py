"""How the responses of a state-space model change with its parameters.

Exact: with T = (j omega M - F)^-1 an entry f of F changes H = C T G by C T (dF/df) T G, one outer product each; entries
change with parameters by complex steps, which are exact to rounding for a grammar of arithmetic (Squire and Trapp
1998).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex

if TYPE_CHECKING:
    from swashplate.models.linear.expressions import Expression
    from swashplate.models.linear.state_space import StateSpaceModel

_STEP = 1e-30

Entries = Mapping[str, tuple[NDArray[Any], NDArray[Any], Array]]
"""By matrix rows and columns (e,) of the entries that move, and their slopes (e, n_free)."""


def of_pairs(
    model: StateSpaceModel, free: tuple[str, ...], numbers: Array, pairs: Sequence[tuple[int, int, Array]]
) -> tuple[list[Complex], list[Complex]]:
    """`StateSpaceModel.sensitivities` of a model without delays of single entries."""
    changes = dict(zip(free, map(float, numbers), strict=True))
    values = model.numbers(changes)
    m = {name: np.eye(*s) if name == "M" else np.zeros(s) for name, s in model.shapes.items()}
    for e in model.elements:
        m[e.matrix][e.row, e.column] = e.expression(values)
    stepped = _Stepped(model, changes)
    sizes = [omega.size for _, _, omega in pairs]
    outputs, inputs = np.repeat([o for o, _, _ in pairs], sizes), np.repeat([i for _, i, _ in pairs], sizes)
    omega = np.concatenate([omega for _, _, omega in pairs])
    grid, at = np.unique(omega, return_inverse=True)
    s = 1j * grid[:, None, None]
    try:
        t = np.linalg.inv(s * m["M"] - m["F"])[at]
    except np.linalg.LinAlgError:
        t = np.full((omega.size, *m["F"].shape), np.nan + 0j)
    jw: Complex = np.asarray(1j * omega, dtype=np.complex128)
    # Every point belongs to one pair: one column of T G and one row of C T are all that it needs.
    x = np.einsum("fij,fj->fi", t, m["G"].T[inputs])
    left = np.einsum("fi,fij->fj", m["H0"][outputs] + jw[:, None] * m["H1"][outputs], t)
    h = np.einsum("fi,fi->f", left, m["G"].T[inputs]) + m["D"][outputs, inputs]
    slopes = _changes(_entry_slopes(model, free, stepped), outputs, inputs, x=x, left=left, jw=jw, free=len(free))
    answers, by = np.split(h, np.cumsum(sizes)[:-1]), np.split(slopes, np.cumsum(sizes)[:-1])
    for k, (o, i, frequencies) in enumerate(pairs):
        expression = model.delays.get(f"{model.outputs[o]}/{model.inputs[i]}", model.delays.get(model.inputs[i]))
        if expression is not None:
            lag = np.exp(-1j * frequencies * float(expression(values)))
            answers[k], by[k] = answers[k] * lag, by[k] * lag[:, None]
            by[k] -= np.outer(1j * frequencies * answers[k], _slopes(model, expression, free, stepped))
    return answers, by


class _Stepped(dict[str, Any]):
    """The numbers with one parameter stepped aside, by that parameter, made when they are first asked for."""

    def __init__(self, model: StateSpaceModel, values: Mapping[str, float]) -> None:
        super().__init__()
        self._model, self._values = model, values

    def __missing__(self, name: str) -> dict[str, Any]:
        self[name] = self._model.numbers({**self._values, name: self._values[name] + 1j * _STEP})
        return self[name]


def _slopes(
    model: StateSpaceModel, expression: Expression, free: Sequence[str], stepped: Mapping[str, Any]
) -> list[float]:
    """An expression's derivatives by the free parameters."""
    text = expression.text.replace(" ", "")
    alone = text.removeprefix("-")
    if alone in model.parameters and model.parameters[alone].tie is None:
        slope = -1.0 if text.startswith("-") else 1.0
        return [slope if name == alone else 0.0 for name in free]
    behind = frozenset().union(*(model.uses[used] for used in expression.names))
    return [float(np.imag(expression(stepped[name]))) / _STEP if name in behind else 0.0 for name in free]


def _entry_slopes(model: StateSpaceModel, free: Sequence[str], stepped: Mapping[str, Any]) -> Entries:
    moving: dict[str, list[tuple[int, int, list[float]]]] = {}
    for e in model.elements:
        if any(row := _slopes(model, e.expression, free, stepped)):
            moving.setdefault(e.matrix, []).append((e.row, e.column, row))
    arrays = {matrix: [np.array(column) for column in zip(*entries, strict=True)] for matrix, entries in moving.items()}
    return {matrix: (rows, columns, slopes) for matrix, (rows, columns, slopes) in arrays.items()}


def _changes(
    moving: Entries, outputs: NDArray[Any], inputs: NDArray[Any], *, x: Complex, left: Complex, jw: Complex, free: int
) -> Complex:
    """What a unit of each free parameter does to the response at each point (n,), which has its output and input."""
    total = np.zeros((jw.size, free), dtype=np.complex128)
    for matrix, (rows, columns, slopes) in moving.items():
        if matrix in "FM":
            factors = left[:, rows] * x[:, columns]
        elif matrix == "G":
            factors = left[:, rows] * (columns == inputs[:, None])
        elif matrix == "D":
            factors = (rows == outputs[:, None]) & (columns == inputs[:, None])
        else:
            factors = x[:, columns] * (rows == outputs[:, None])
        if matrix in ("M", "H1"):
            factors = factors * (jw if matrix == "H1" else -jw)[:, None]
        total += factors @ slopes
    return total
