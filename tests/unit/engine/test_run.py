"""A graph that runs: compiled or not, the same numbers of the same shapes."""

from __future__ import annotations

import casadi
import numpy as np
import pytest

from swashplate.engine import law
from swashplate.engine.law import runnable


@pytest.mark.parametrize("compiled", [True, False])
def test_a_graph_of_columns_and_matrices(compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not compiled:
        monkeypatch.setattr(law, "can_compile", lambda: False)
    A, x = casadi.MX.sym("A", 2, 3), casadi.MX.sym("x", 3)
    made = runnable(casadi.Function("product", [A, x], [A @ casadi.sin(x), casadi.densify(A.T)]))
    matrix, column = np.arange(6.0).reshape(2, 3), np.array([0.1, 0.2, 0.3])
    product, turned = made(matrix, column)
    np.testing.assert_allclose(product[:, 0], matrix @ np.sin(column), rtol=1e-15)
    np.testing.assert_array_equal(turned, matrix.T)
