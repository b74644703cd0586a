"""Many vehicles flown by their own C: the numbers of plain floats, whatever flies beside, and wrong ones are found."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from swashplate.api.simulate_batch import simulate_batch
from swashplate.arrays import Array
from swashplate.compiler import compiler
from swashplate.engine.equations import equations_of, parameter_row, unpack_rows
from swashplate.errors import ExportError
from swashplate.export import batch_c, c_lanes
from swashplate.export.batch_c import fly_in_c
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.simulation.runge_kutta import rk4_step
from swashplate.simulation.trim import trim

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

DT = 0.005


def tables(made: Vehicle, count: int, steps: int, *, alike: bool = False) -> tuple[Array, Array, Array]:
    """Starts, driving rows and card numbers that differ from vehicle to vehicle; driving and cards may be alike."""
    random, hover = np.random.default_rng(1), trim(made)
    x0 = hover.state[:, None] + 0.05 * random.standard_normal((len(hover.state), count)) * (hover.state[:, None] < 9.0)
    rows = np.zeros((steps + 1, len(made.input_names) + 4, 1 if alike else count))
    rows[:, : len(hover.inputs)] = hover.inputs[:, None]
    rows[:, :-1] += 0.01 * random.standard_normal(rows[:, :-1].shape)
    rows[:, -1] = hover.environment.voltage
    p = np.repeat(parameter_row(made, hover.environment)[:, None], rows.shape[2], axis=1)
    return x0, rows, p * (1.0 + 0.01 * random.standard_normal(p.shape))


def by_floats(made: Vehicle, x0: Array, rows: Array, p: Array, *, held: bool, number: int) -> Array:
    """The last state of one of them by plain floats, without a compiler."""
    equations, xp, numbers = equations_of(made), FloatBackend(), p[:, min(number, p.shape[1] - 1)].tolist()

    def rates(x: Array, w: Array) -> Array:
        return np.array(made.rates(x.tolist(), *unpack_rows(equations, w.tolist(), numbers), xp))

    x, driving = x0[:, number], rows[:, :, min(number, rows.shape[2] - 1)]
    for before, after in pairwise(driving):
        end = before if held else after
        x = rk4_step(rates, x, lambda at, a=before, b=end: a + at * (b - a), DT, looped=False)
    return x


def apart(found: Array, exact: Array) -> float:
    return float(np.max(np.abs(found - exact) / np.maximum(np.abs(exact), 1.0)))


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize(
    ("name", "options"), [("coax", {}), ("raptor50", {}), ("raptor50", {"bar": True, "inflow": "pitt-peters"})]
)
def test_it_flies_as_plain_floats_do(name: str, options: dict[str, Any], held: bool) -> None:
    """Every lane of a block that is not full: to 1e-11."""
    made = vehicle(name, **options)
    x0, rows, p = tables(made, 19, 8)
    found = fly_in_c(equations_of(made), x0, rows, p, DT, keep=4, held=held)
    assert found.shape == (3, *x0.shape)
    np.testing.assert_array_equal(found[0], x0)
    for number in (0, 15, 18):
        exact = by_floats(made, x0, rows, p, held=held, number=number)
        assert apart(exact, x0[:, number]) > 1e-3, "it does not move"
        assert apart(found[-1, :, number], exact) < 1e-11


@pytest.mark.parametrize("name", ["coax", "raptor50"])
def test_neighbours_do_not_matter(name: str) -> None:
    """To the last bit: other lanes, other blocks, cards and inputs of their own or shared, one that is lost beside."""
    made = vehicle(name)
    x0, rows, p = tables(made, batch_c._PART + 21, 6, alike=True)
    lost = x0.copy()
    lost[made.index("p"), 3] = np.nan
    equations = equations_of(made)
    all_of_them = fly_in_c(equations, x0, rows, p, DT, keep=6, held=True)[-1]
    beside = fly_in_c(equations, lost, rows, p, DT, keep=6, held=True)[-1]
    assert not np.isfinite(beside[:, 3]).all()
    others = np.arange(x0.shape[1]) != 3
    np.testing.assert_array_equal(beside[:, others], all_of_them[:, others])
    few = [2, 40, -1]
    own = (np.repeat(table, len(few), axis=-1) for table in (rows, p))
    np.testing.assert_array_equal(fly_in_c(equations, x0[:, few], *own, DT, keep=6, held=True)[-1], all_of_them[:, few])


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("coax", "sixth = dt / 6", "sixth = dt / (real)6.0000001"),
        ("coax", "turns * 1.5707963267341256", "turns * 1.5707963267"),
        ("coax", "-0.16666666666666632", "-0.1666666"),
        ("raptor50", "settled[l] |= (", "settled[l] |= 1 | ("),
    ],
)
def test_a_wrong_number_is_found(monkeypatch: pytest.MonkeyPatch, name: str, right: str, wrong: str) -> None:
    made = vehicle(name)
    x0, rows, p = tables(made, 3, 8)
    x0[made.index("phi")] += 1.0
    source = c_lanes.lane_code(equations_of(made), "double")
    assert source.count(right) > 0

    def flown(text: str) -> Array:
        batch_c._compiled.cache_clear()
        monkeypatch.setattr(batch_c, "lane_code", lambda *_: text)
        return fly_in_c(equations_of(made), x0, rows, p, DT, keep=8, held=True)[-1]

    exact = np.stack([by_floats(made, x0, rows, p, held=True, number=i) for i in range(3)], axis=1)
    assert apart(flown(source), exact) < 1e-11
    assert apart(flown(source.replace(right, wrong)), exact) > 1e-11
    batch_c._compiled.cache_clear()


def test_without_a_compiler_jax_flies_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []

    def refused(*_: object, **__: object) -> None:
        raise ExportError("there is no C compiler here (cc, gcc or clang).")

    small = vehicle("crazyflie")  # what XLA compiles soonest
    masses = {"mass": small.card.values()["mass"] * np.array([1.0, 1.02, 1.1])}
    hover = trim(small).commands()
    inputs = {**hover, "motor_1": hover["motor_1"] + np.linspace(0.0, 0.01, 201)}
    quick = simulate_batch(small, inputs, parameters=masses, notice=said.append)
    assert not said
    monkeypatch.setattr(batch_c, "loaded", refused)
    batch_c._compiled.cache_clear()
    slow = simulate_batch(small, inputs, parameters=masses, notice=said.append)
    assert said == [
        "The vehicles' C cannot be used here, JAX flies them five times slower: "
        "there is no C compiler here (cc, gcc or clang)."
    ]
    np.testing.assert_allclose(quick.states, slow.states, rtol=1e-11, atol=1e-11)
    with pytest.raises(ExportError):
        simulate_batch(small, inputs, parameters=masses, engine="c")


def test_equations_that_casadi_cannot_trace_are_told_of() -> None:
    class Strange:
        name, state_names, input_names, parameter_names = "strange", ("x",), ("u",), ()

        def parameters(self) -> tuple[()]:
            return ()

        def rates(self, x: Any, *_: object) -> list[float]:
            return [jnp.tanh(x[0])]

    with pytest.raises(ExportError, match="strange: CasADi cannot trace the equations"):
        c_lanes.lane_code(type("E", (), {"vehicle": Strange()})(), "double")
