"""Printed tangents against differences: every operation, on both sides of its kink and at it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swashplate.compiled import NATIVE, loaded
from swashplate.compiler import compiler
from swashplate.engine.emit import Tangents, fill_template
from swashplate.engine.statements import Statement

pytestmark = pytest.mark.skipif(compiler() is None, reason="there is no C compiler")

_OPERATIONS: dict[str, Callable[..., Any]] = {
    "ADD": lambda a, b: a + b,
    "SUB": lambda a, b: a - b,
    "MUL": lambda a, b: a * b,
    "DIV": lambda a, b: a / b,
    "ATAN2": np.arctan2,
    "FMIN": np.minimum,
    "FMAX": np.maximum,
    "IF_ELSE_ZERO": lambda a, b: np.where(a != 0, b, 0.0),
    "LT": lambda a, b: np.where(a < b, 1.0, 0.0),
    "NEG": lambda a: -a,
    "SQ": lambda a: a * a,
    "TWICE": lambda a: a + a,
    "INV": lambda a: 1 / a,
    "SQRT": np.sqrt,
    "SIN": np.sin,
    "COS": np.cos,
    "TAN": np.tan,
    "FABS": np.abs,
    "SIGN": np.sign,
    "ASSIGN": lambda a: a,
}
_OF_ONE = ("NEG", "SQ", "TWICE", "INV", "SQRT", "SIN", "COS", "TAN", "FABS", "SIGN", "ASSIGN")
_STEP = 1e-5
_PLACES = np.array([[0.7, 1.3], [1.3, 0.7], [0.8, 0.8], [2.0, 0.4]])


def test_every_operation_moves_as_differences_do() -> None:
    """Where two numbers are equal the slope is the mean of both sides, as a central difference has it."""
    body, stores = [], []
    for number, name in enumerate(_OPERATIONS):
        reads = ("x[0]",) if name in _OF_ONE else ("x[0]", "x[1]")
        tangents = Tangents({"x": ("dx", None)})
        body += tangents.body([Statement(f"t{number}", name, reads)])
        moved = tangents.of(f"t{number}")
        stores += [f"out[{2 * number}] = t{number}; out[{2 * number + 1}] = {f'{moved}[0]' if moved else '0'};"]
    text = "\n  ".join(["const vec dx[2] = {{1.1}, {-0.3}};", *body, *stores])
    head = "void moved(const double *x, double *out);\n"
    vectors = fill_template("vectors.h", {})
    source = f"#include <math.h>\n{vectors}{head}void moved(const double *x, double *out) {{\n  {text}\n}}\n"
    run = loaded(source, options=("-O1", NATIVE, "-Wno-psabi")).moved
    for place in _PLACES:
        out = np.zeros(2 * len(_OPERATIONS))
        run(*(ctypes.c_void_p(row.ctypes.data) for row in (place, out)))
        for (name, function), found in zip(_OPERATIONS.items(), out.reshape(-1, 2), strict=True):
            one = name in _OF_ONE
            at, to = (place[:1], [1.1]) if one else (place, [1.1, -0.3])
            value, ends = function(*at), [function(*(at + side * _STEP * np.array(to))) for side in (1.0, -1.0)]
            assert found[0] == pytest.approx(float(value), rel=1e-13, abs=1e-15), name
            if name != "LT" or at[0] != at[1]:  # which jumps there
                assert found[1] == pytest.approx(float(ends[0] - ends[1]) / (2.0 * _STEP), rel=1e-8, abs=1e-8), name


def test_what_does_not_move_has_no_tangent() -> None:
    tangents = Tangents({"w": ("dw", frozenset({0}))})
    lines = tangents.body([Statement("a", "MUL", ("w[1]", "2.0")), Statement("b", "MUL", ("w[0]", "a"))])
    assert tangents.of("a") is None
    assert tangents.of("w[1]") is None
    assert lines == ["const double a = w[1] * 2.0;", "const double b = w[0] * a;", "const vec d_b = dw[0] * a;"]
