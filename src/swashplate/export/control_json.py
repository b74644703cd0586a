"""A linear model as JSON for python-control, and back: names, units, delays and trim come along, nothing is pickled.

{"kind": "state-space", "schema": 1, "name": ..., "origin": [...], "A": [[...]], "B": ..., "C": ..., "D": ..., "dt": 0,
 "states": [...], "inputs": [...], "outputs": [...], "units": {...}, "delays": {...}, "about": {...}}
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from swashplate import documents
from swashplate.arrays import Array
from swashplate.errors import ExportError
from swashplate.export.linear import Linear

SCHEMA = 1
KIND = "state-space"


def control_json(model: Linear, *, origin: Sequence[str] = ()) -> str:
    """The text of the file; numbers come back to the last bit. `origin`: what it was made from, a line each."""
    document = {
        "kind": KIND,
        "schema": SCHEMA,
        "name": model.name,
        "title": model.title,
        "trust": model.trust,
        "origin": list(origin),
        "dt": 0,
        **{name: getattr(model, name).tolist() for name in "ABCD"},
        "states": list(model.states),
        "inputs": list(model.inputs),
        "outputs": list(model.outputs),
        "units": dict(model.units),
        "delays": dict(model.delays),
        "about": dict(model.about),
    }
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def read_linear(path: str | Path) -> Linear:
    """The model of a file that `swash export --format control` wrote.

    Raises:
        ExportError: naming the file and the entry that is missing, of another shape or no number.
    """
    document = documents.read_document(path, form="json", error=ExportError)
    if document.get("kind") != KIND or document.get("schema") != SCHEMA:
        raise ExportError(
            f"is no linear model of kind '{KIND}' and schema {SCHEMA}.",
            where=path,
            hint="`swash export MODEL --format control` writes one.",
        )
    states, inputs, outputs = (_names(document, key, path) for key in ("states", "inputs", "outputs"))
    n, m, k = len(states), len(inputs), len(outputs)
    name, title, trust = (str(document.get(key, "")) for key in ("name", "title", "trust"))
    return Linear(
        name,
        title,
        trust,
        _matrix(document, "A", (n, n), path),
        _matrix(document, "B", (n, m), path),
        _matrix(document, "C", (k, n), path),
        _matrix(document, "D", (k, m), path),
        states,
        inputs,
        outputs,
        {name: str(unit) for name, unit in _table(document, "units", path).items()},
        {name: _number(value, f"delays.{name}", path) for name, value in _table(document, "delays", path).items()},
        {name: _number(value, f"about.{name}", path) for name, value in _table(document, "about", path).items()},
        tuple(str(line) for line in _lines(document, "origin", path)),
    )


def _lines(document: dict[str, Any], name: str, path: str | Path) -> list[Any]:
    lines = document.get(name) or []
    if not isinstance(lines, list):
        raise ExportError(f"is {str(lines)[:40]}, expected a list of texts.", where=path, channel=name)
    return lines


def read_control(path: str | Path, *, pade: int | None = None) -> Any:
    """The same as `control.StateSpace` with named signals; `pade` says what becomes of delays (`Linear.to_control`).

    Raises:
        ExportError: as `read_linear`.
    """
    return read_linear(path).to_control(pade=pade)


def _names(document: Mapping[str, Any], key: str, path: str | Path) -> tuple[str, ...]:
    names = document.get(key)
    if not isinstance(names, list) or not all(isinstance(n, str) for n in names) or len(set(names)) != len(names):
        raise ExportError("is missing or is no list of different names.", where=path, channel=key)
    return tuple(names)


def _matrix(document: Mapping[str, Any], key: str, shape: tuple[int, int], path: str | Path) -> Array:
    try:
        matrix = np.array(document.get(key), dtype=np.float64).reshape(shape if 0 in shape else (-1, shape[1]))
    except (TypeError, ValueError):
        matrix = np.full((1, 1), np.nan)
    if matrix.shape != shape or not np.all(np.isfinite(matrix)):
        raise ExportError(f"is no matrix of {shape[0]} by {shape[1]} numbers.", where=path, channel=key)
    return matrix


def _table(document: Mapping[str, Any], key: str, path: str | Path) -> Mapping[str, Any]:
    table = document.get(key, {})
    if not isinstance(table, dict):
        raise ExportError("is no table.", where=path, channel=key)
    return table


def _number(value: Any, key: str, path: str | Path) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise ExportError(f"is {value!r}, expected a number.", where=path, channel=key)
    return float(value)
