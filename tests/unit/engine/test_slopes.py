"""Slopes of graphs: those of differences of plain floats, whatever kinks and roots the equations have."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.arrays import Array
from swashplate.engine.equations import equations_of, parameter_row, unpack_rows
from swashplate.engine.slopes import rates_and_slopes, slopes_of
from swashplate.errors import ExportError
from swashplate.physics.backend import FloatBackend
from swashplate.simulation import steady


@pytest.mark.parametrize(
    ("name", "options"),
    [("coax", {}), ("coaxial15", {}), ("raptor50", {"bar": True, "inflow": "pitt-peters"}), ("x8", {})],
)
def test_slopes_of_a_vehicle_are_those_of_differences(name: str, options: dict[str, Any]) -> None:
    made = sp.vehicle(name, **options)
    hover, equations = sp.trim(made), equations_of(made)
    random = np.random.default_rng(0)
    x = hover.state + random.normal(scale=1e-2, size=hover.state.size)
    w = np.array([*hover.inputs, 0.5, 0.0, -0.2, hover.environment.voltage])
    p = parameter_row(made, hover.environment)

    def rates(x: Array, w: Array) -> Array:
        return np.array(made.rates(x.tolist(), *unpack_rows(equations, w.tolist(), p.tolist()), FloatBackend()))

    values, by_x, by_w = rates_and_slopes(equations, x, w, p)
    np.testing.assert_allclose(values, rates(x, w), rtol=1e-9, atol=1e-9)
    for _ in range(6):
        along_x, along_w, h = random.standard_normal(x.size), random.standard_normal(w.size), 1e-6
        expected = (rates(x + h * along_x, w + h * along_w) - rates(x - h * along_x, w - h * along_w)) / (2.0 * h)
        found = by_x @ along_x + by_w @ along_w
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5 * np.max(np.abs(expected)))


def test_slopes_of_any_function() -> None:
    slopes = slopes_of(lambda x, w, p, xp: [x[0] * w[0], xp.sin(x[1]) + p[0]], (2, 1, 1), where="here")
    values, by_x, by_w = slopes(np.array([2.0, 0.0]), np.array([3.0]), np.array([5.0]))
    np.testing.assert_allclose(values, [6.0, 5.0])
    np.testing.assert_allclose(by_x, [[3.0, 0.0], [0.0, 1.0]])
    np.testing.assert_allclose(by_w, [[2.0], [0.0]])
    with pytest.raises(ExportError, match="here: CasADi cannot trace the equations"):
        slopes_of(lambda x, w, p, xp: [x[0].no_number()], (1, 1, 1), where="here")(*np.zeros((3, 1)))


def test_a_trim_asks_the_equations_once_for_each_step(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[float, ...]] = []
    inner = steady.rates_and_slopes
    monkeypatch.setattr(
        steady, "rates_and_slopes", lambda e, x, w, p: (asked.append((*x.tolist(), *w.tolist())), inner(e, x, w, p))[1]
    )
    sp.trim(sp.vehicle("raptor50"))
    assert len(asked) <= 8
    assert len(set(asked)) == len(asked)
