"""Numbers that carry their slopes: against JAX, rule by rule and at kinks, and in a vehicle's equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import swashplate as sp
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.physics.backend import JaxBackend
from swashplate.simulation import dynamics
from swashplate.simulation.dual import CANNOT, DUAL, slopes_of
from swashplate.simulation.steady import unrest_at

RULES: dict[str, Callable[[Any, Any, Any], Any]] = {
    "sums": lambda a, b, xp: 2.0 + a - b - 1.0 + (3.0 - a) + (-b) + (+a),
    "products": lambda a, b, xp: a * b * 2.0 / (b + 3.0) + 4.0 / a / 2.0,
    "powers": lambda a, b, xp: a**2 + a**0.5 + b**3,
    "functions": lambda a, b, xp: xp.sin(a) + xp.cos(b) * xp.tan(a) + xp.sqrt(a) + xp.atan2(a, b) + xp.atan2(2.0, a),
    "choices": lambda a, b, xp: xp.where(a > b, a * b, a - b) + xp.where(a <= 1.0, b, a) + xp.abs(b - 1.0),
    "least and most": lambda a, b, xp: xp.minimum(a, b) * xp.maximum(a, 1.0) + xp.maximum(2.0, b),
    "hidden": lambda a, b, xp: xp.detached(a) * b,
}


@pytest.mark.parametrize("name", RULES)
@pytest.mark.parametrize("at", [(0.7, 0.4), (0.4, 0.4), (1.0, 2.0)], ids=["apart", "even", "at kinks"])
def test_every_rule_is_that_of_jax(name: str, at: tuple[float, float]) -> None:
    dynamics.enable_double_precision()
    xp, row = JaxBackend(), np.array(at)
    value, slopes = slopes_of(lambda x, w: [RULES[name](x[0], w[0], DUAL)], row[:1], row[1:])
    expected = jax.jacfwd(lambda row: RULES[name](row[0], row[1], xp))(jnp.asarray(row))
    assert value[0] == pytest.approx(float(RULES[name](*map(jnp.asarray, at), xp)), rel=1e-14)
    np.testing.assert_allclose(slopes[0], expected, rtol=1e-14, atol=1e-15)


def test_what_divides_by_zero_is_no_number_and_stops_nothing() -> None:
    value, slopes = slopes_of(lambda x, w: [x[0] / w[0], 1.0 / w[0], DUAL.sqrt(w[0])], np.ones(1), np.zeros(1))
    assert value.tolist() == [np.inf, np.inf, 0.0]
    assert not np.isfinite(slopes[:, 1]).any()


def test_slopes_of_a_vehicle_are_those_that_xla_compiles() -> None:
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    x = hover.state + np.random.default_rng(0).normal(scale=1e-2, size=hover.state.size)
    w = np.array([*hover.inputs, 0.5, 0.0, -0.2, hover.environment.voltage])
    rows = equations_of(coax), x, w, parameter_row(coax, hover.environment)
    for own, expected in zip(dynamics.rates_and_slopes(*rows), dynamics._compiled_slopes(*rows), strict=True):
        np.testing.assert_allclose(own, expected, rtol=1e-12, atol=1e-14 * np.max(np.abs(expected)))


def test_equations_with_sums_over_arrays_go_to_xla(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        raise TypeError("these numbers are no arrays")

    asked = []
    monkeypatch.setattr(dynamics, "slopes_of", refuse)
    monkeypatch.setattr(dynamics, "_compiled_slopes", lambda *rows: asked.append(rows) or (np.zeros(1),) * 3)
    coax = sp.vehicle("coax")
    row = np.zeros(3)
    assert len(dynamics.rates_and_slopes(equations_of(coax), row, row, row)) == 3
    assert len(asked) == 1
    assert TypeError in CANNOT


def test_equality_and_truth_are_those_of_the_value() -> None:
    """Equations may ask whether a number is zero; the one that is asked must not matter."""
    value, slopes = slopes_of(
        lambda x, w: [x[0] if x[0] != 0.0 else w[0], w[0] if x[0] else x[0]], np.zeros(1), np.ones(1)
    )
    assert value.tolist() == [1.0, 0.0]
    assert slopes.tolist() == [[0.0, 1.0], [1.0, 0.0]]


def test_a_trim_asks_the_equations_once_for_each_step(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def counted(equations: Any, z: Any, *rows: Any) -> Any:
        asked.append(tuple(z))
        return unrest_at(equations, z, *rows)

    monkeypatch.setattr("swashplate.simulation.trim.unrest_at", counted)
    sp.trim(sp.vehicle("raptor50"), speed=5.0)
    assert len(asked) == len(set(asked)) < 8
