"""A linear model as a .mat file: matrices, names, units, delays and trim, for MATLAB, Octave or scipy."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from swashplate.export.linear import Linear

_HEADER = 116  # bytes of free text that a level 5 file begins with


def matlab(model: Linear) -> bytes:
    """The file (MATLAB level 5), the same bytes for the same model.

    Variables: A B C D; state_names input_names output_names and state_units input_units output_units as cell arrays of
    text; io_delay [s], (outputs, inputs), for `ss(...).IODelay`; state_start and input_start, the flight that
    deviations count from; name, title, trust.
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
    }
    buffer = io.BytesIO()
    savemat(buffer, content, do_compression=False)
    written = bytearray(buffer.getvalue())
    written[:_HEADER] = b"MATLAB 5.0 MAT-file, linear model by swashplate".ljust(_HEADER)  # scipy puts the time here
    return bytes(written)


def _cells(texts: Iterable[str]) -> Any:
    """A column of text as a cell array."""
    listed = list(texts)
    made = np.empty((len(listed), 1), dtype=object)
    made[:, 0] = listed
    return made


def _column(numbers: Iterable[float]) -> Any:
    return np.array(list(numbers), dtype=np.float64)[:, None]
