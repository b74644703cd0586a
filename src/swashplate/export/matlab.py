"""A linear model as a .mat file, and back: matrices, names, units, delays and trim, for MATLAB, Octave or scipy."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.errors import ExportError
from swashplate.export.linear import Linear
from swashplate.flights.readers import mat
from swashplate.flights.readers.source import open_source

_HEADER = 116  # bytes of free text that a level 5 file begins with


def matlab(model: Linear, *, origin: Sequence[str] = ()) -> bytes:
    """The file (MATLAB level 5), the same bytes for the same model.

    Variables: A B C D; state_names input_names output_names and state_units input_units output_units as cell arrays of
    text; io_delay [s], (outputs, inputs), for `ss(...).IODelay`; state_start and input_start, the flight that
    deviations count from; name, title, trust; origin, what it was made from, a line each.
    """
    from scipy.io import savemat

    def units(names: Iterable[str]) -> Any:
        return _cells(model.units.get(name, "") for name in names)

    content = {
        **{name: getattr(model, name) for name in "ABCD"},
        "state_names": _cells(model.states),
        "input_names": _cells(model.inputs),
        "output_names": _cells(model.outputs),
        "state_units": units(model.states),
        "input_units": units(model.inputs),
        "output_units": units(model.outputs),
        "io_delay": np.array([[model.delay(o, i) for i in model.inputs] for o in model.outputs]),
        "state_start": _column(model.about.get(name, 0.0) for name in model.states),
        "input_start": _column(model.about.get(name, 0.0) for name in model.inputs),
        "name": model.name,
        "title": model.title,
        "trust": model.trust,
        "origin": _cells(origin),
    }
    buffer = io.BytesIO()
    savemat(buffer, content, do_compression=False)
    written = bytearray(buffer.getvalue())
    written[:_HEADER] = b"MATLAB 5.0 MAT-file, linear model by swashplate".ljust(_HEADER)  # scipy puts the time here
    return bytes(written)


def read_matlab(path: str | Path) -> Linear:
    """The model of a file that `swash export --format matlab` wrote, saved again by MATLAB or not.

    Raises:
        FlightError: where it is no .mat file of level 5.
        ExportError: naming the variable that is missing, of another shape or no number.
    """
    variables = mat.load(open_source(path))
    states, inputs, outputs = (_texts(variables, f"{kind}_names", path) for kind in ("state", "input", "output"))
    n, m, k = len(states), len(inputs), len(outputs)
    delays = _numbers(variables, "io_delay", (k, m), path)
    starts = [
        *zip(states, _numbers(variables, "state_start", (n, 1), path)[:, 0], strict=True),
        *zip(inputs, _numbers(variables, "input_start", (m, 1), path)[:, 0], strict=True),
    ]
    units: dict[str, str] = {}
    for kind, names in (("state", states), ("input", inputs), ("output", outputs)):
        units |= dict(zip(names, _texts(variables, f"{kind}_units", path), strict=True))
    shapes = {"A": (n, n), "B": (n, m), "C": (k, n), "D": (k, m)}
    name, title, trust = (str(variables[key]) if isinstance(variables.get(key), str) else "" for key in _WORDS)
    A, B, C, D = (_numbers(variables, key, shape, path) for key, shape in shapes.items())
    return Linear(
        name,
        title,
        trust,
        A,
        B,
        C,
        D,
        states,
        inputs,
        outputs,
        units,
        {f"{o}/{i}": float(delays[a, b]) for a, o in enumerate(outputs) for b, i in enumerate(inputs) if delays[a, b]},
        {name: float(value) for name, value in starts} if any(value for _, value in starts) else {},
        _texts(variables, "origin", path) if "origin" in variables else (),
    )


_WORDS = ("name", "title", "trust")


def _texts(variables: Mapping[str, Any], key: str, path: str | Path) -> tuple[str, ...]:
    value = variables.get(key)
    listed = [value] if isinstance(value, str) else value
    if not isinstance(listed, list):
        raise ExportError(
            "is missing or is no cell array of text.",
            where=path,
            channel=key,
            hint="`swash export MODEL --format matlab` writes it.",
        )
    # MATLAB's empty text comes as an array without entries.
    return tuple(entry if isinstance(entry, str) else "" for entry in listed)


def _numbers(variables: Mapping[str, Any], key: str, shape: tuple[int, int], path: str | Path) -> Any:
    value = mat.numbers(variables.get(key))
    if value is None or value.size != shape[0] * shape[1] or not np.all(np.isfinite(value)):
        raise ExportError(f"is no matrix of {shape[0]} by {shape[1]} numbers.", where=path, channel=key)
    return value.reshape(shape)


def _cells(texts: Iterable[str]) -> Any:
    """A column of text as a cell array."""
    listed = list(texts)
    cells = np.empty((len(listed), 1), dtype=object)
    cells[:, 0] = listed
    return cells


def _column(numbers: Iterable[float]) -> Any:
    return np.array(list(numbers), dtype=np.float64)[:, None]
