"""Flights by compiled C and by the virtual machine: the numbers of plain floats, and wrong ones are found."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.compiler import compiler
from swashplate.engine import fly as engine_fly
from swashplate.engine.card import fly_on_card
from swashplate.engine.equations import Equations, equations_of, parameter_row, unpack_rows
from swashplate.engine.fly import FlightPlan, flight_code, fly
from swashplate.engine.trace import traced_rates
from swashplate.engine.virtual import fly_virtually
from swashplate.errors import ExportError, SwashError
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
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
        k1 = rates(x, before)
        k2 = rates(x + DT / 2 * k1, (before + end) / 2)
        k3 = rates(x + DT / 2 * k2, (before + end) / 2)
        k4 = rates(x + DT * k3, end)
        x = x + DT / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return x


def plan_of(x0: Array, rows: Array, p: Array, *, keep: int, held: bool = True) -> FlightPlan:
    return FlightPlan(x0, p, rows, DT, keep=keep, held=held)


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
    plan = plan_of(x0, rows, p, keep=4, held=held)
    found, _ = fly(made, plan)
    virtual, _ = fly_virtually(made, plan, "double", quaternion=False)
    np.testing.assert_allclose(virtual, found, rtol=1e-11, atol=1e-11)
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
    x0, rows, p = tables(made, engine_fly._PART + 21, 6, alike=True)
    lost = x0.copy()
    lost[made.index("p"), 3] = np.nan
    all_of_them = fly(made, plan_of(x0, rows, p, keep=6))[0][-1]
    beside = fly(made, plan_of(lost, rows, p, keep=6))[0][-1]
    assert not np.isfinite(beside[:, 3]).all()
    others = np.arange(x0.shape[1]) != 3
    np.testing.assert_array_equal(beside[:, others], all_of_them[:, others])
    few = [2, 40, -1]
    own = (np.repeat(table, len(few), axis=-1) for table in (rows, p))
    np.testing.assert_array_equal(fly(made, plan_of(x0[:, few], *own, keep=6))[0][-1], all_of_them[:, few])


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
    source = flight_code(equations_of(made), None, precision="double", lanes=16)
    assert source.count(right) > 0

    def flown(text: str) -> Array:
        engine_fly._open_program.cache_clear()
        monkeypatch.setattr(engine_fly, "flight_code", lambda *_, **__: text)
        return fly(made, plan_of(x0, rows, p, keep=8))[0][-1]

    exact = np.stack([by_floats(made, x0, rows, p, held=True, number=i) for i in range(3)], axis=1)
    assert apart(flown(source), exact) < 1e-11
    assert apart(flown(source.replace(right, wrong)), exact) > 1e-11
    engine_fly._open_program.cache_clear()


def test_without_a_compiler_the_virtual_machine_flies(monkeypatch: pytest.MonkeyPatch) -> None:
    made = vehicle("crazyflie")
    x0, rows, p = tables(made, 3, 40)
    plan = plan_of(x0, rows, p, keep=2)
    quick, _ = fly(made, plan)
    monkeypatch.setattr(engine_fly, "can_compile", lambda: False)
    slow, _ = fly(made, plan)
    np.testing.assert_allclose(quick, slow, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("name", ["coax", "raptor50"])
def test_a_vehicle_that_tumbles_is_flown_with_a_quaternion(name: str) -> None:
    """Through the vertical, where Euler angles have no rates: the pitch that is shown turns back at 90 degrees."""
    made = vehicle(name)
    hover = trim(made)
    rows = np.tile(np.array([*hover.inputs, 0.0, 0.0, 0.0, hover.environment.voltage])[:, None], (201, 1, 1))
    x0 = np.repeat(hover.state[:, None], 2, axis=1)
    x0[made.index("theta"), 1], x0[made.index("q"), 1] = 1.2, 9.0
    plan = plan_of(x0, rows, parameter_row(made, hover.environment)[:, None], keep=1)
    found, _ = fly(made, plan)
    virtual, _ = fly_virtually(made, plan, "double", quaternion=True)
    theta, psi = found[:, made.index("theta")], found[:, made.index("psi")]
    assert np.max(np.abs(theta[:, 0])) < 0.1
    assert np.max(np.abs(theta[:, 1])) > 1.4
    assert np.all(np.isfinite(found))
    assert np.all(np.abs(theta) <= np.pi / 2 + 1e-9)
    assert np.max(np.abs(np.diff(psi, axis=0))) < 3.2, "turns are counted on"
    np.testing.assert_allclose(found[..., 1], virtual[..., 1], rtol=1e-9, atol=1e-9)


def test_the_card_flies_the_same_graph() -> None:
    pytest.importorskip("jax", reason="the extra 'cuda' is not installed")
    made = vehicle("coax")
    x0, rows, p = tables(made, 5, 12)
    plan = plan_of(x0, rows, p, keep=4)
    found, _ = fly(made, plan)
    np.testing.assert_allclose(fly_on_card(made, plan, precision="double"), found, rtol=1e-11, atol=1e-11)
    single = fly_on_card(made, plan, precision="single")
    assert single.dtype == np.float32
    assert 1e-9 < apart(single, found) < 1e-3
    with pytest.raises(SwashError, match="held inputs only"):
        fly_on_card(made, plan_of(x0, rows, p, keep=4, held=False))


def test_equations_that_casadi_cannot_trace_are_told_of() -> None:
    class Strange:
        name, state_names, input_names, parameter_names = "strange", ("x",), ("u",), ()

        def parameters(self) -> tuple[()]:
            return ()

        def rates(self, x: Any, *_: object) -> list[float]:
            return [x[0].imaginary_part()]

    with pytest.raises(ExportError, match="strange: CasADi cannot trace the equations"):
        traced_rates(Equations("strange", Strange()))
