"""A vehicle with a linear residual: the equations and what the card adds, in files, exports and refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from exported import compiled
from swashplate.compiler import compiler
from swashplate.errors import CardError
from swashplate.export.model_c import model_code
from swashplate.export.traced import trace_vehicle
from swashplate.models.nesting import rebuild
from swashplate.models.residual import ROWS, carrying, coefficients, facing, refuse_predictor, with_residual
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.simulation.dynamics import equations_of


def wider(name: str = "crazyflie", **changes: float) -> Vehicle:
    vehicle = sp.vehicle(name)
    made = with_residual(vehicle, dict.fromkeys(vehicle.input_names, 0.8))
    return made.with_values({f"residual_{key}": value for key, value in changes.items()})


def state(vehicle: Vehicle) -> list[float]:
    return [0.01 * (i + 1) if i < 12 else 1900.0 for i in range(len(vehicle.state_names))]


@pytest.mark.parametrize("name", ["crazyflie", "coax", "raptor50"])
def test_zero_coefficients_change_nothing(name: str) -> None:
    plain = sp.vehicle(name)
    made = wider(name)
    x, u = state(plain), [0.5 * (low + high) for low, high in plain.input_limits]
    assert made.rates(x, u, made.values()) == plain.rates(x, u, plain.values())


def test_coefficients_add_their_share_by_hand() -> None:
    made = wider(p_p=-3.0, p_motor_2=10.0, w_w=0.5, u_phi=2.0)
    plain = sp.vehicle("crazyflie")
    x, u = state(plain), [0.8, 0.9, 0.8, 0.8]
    moved = np.subtract(made.rates(x, u, made.values()), plain.rates(x, u, plain.values()))
    at = dict(zip(plain.state_names, x, strict=True))
    expected = {"p": -3.0 * at["p"] + 10.0 * 0.1, "w": 0.5 * at["w"], "u": 2.0 * at["phi"]}
    np.testing.assert_allclose(moved, [expected.get(name, 0.0) for name in plain.state_names], atol=1e-9)


def test_the_residuals_force_is_felt_by_an_accelerometer() -> None:
    made, plain = wider(w_w=0.5), sp.vehicle("crazyflie")
    x = state(plain)
    felt = []
    for vehicle in (made, plain):
        nested, told = rebuild(vehicle.state, x), vehicle.inputs(*(0.8,) * 4)
        felt.append(vehicle.specific_force(nested, told, vehicle.values(), environment_of(vehicle), FloatBackend()))
    assert felt[0].z - felt[1].z == pytest.approx(0.5 * x[5])


def test_it_comes_back_from_its_file_with_the_same_equations(tmp_path: Path) -> None:
    made = wider(q_theta=-4.0)
    made.save(tmp_path / "model.toml")
    again = sp.vehicle(tmp_path / "model.toml")
    assert again.card.values() == made.card.values()
    assert equations_of(again) == equations_of(made)  # so that compiled code is shared
    assert equations_of(again) != equations_of(sp.vehicle("crazyflie"))
    x, u = state(made), [0.8] * 4
    assert again.rates(x, u, again.values()) == made.rates(x, u, made.values())


def test_equations_with_a_residual_take_a_card_with_one_or_without() -> None:
    """As a fit's document is loaded beside the model that it made: its start has no residual, its end another one."""
    made, plain, other = wider(q_theta=-4.0), sp.vehicle("crazyflie"), wider(w_w=0.5)
    for card, like in ((plain.card, plain), (other.card, other), (made.card, made)):
        again = carrying(made, card)
        assert equations_of(again) == equations_of(like)
        x, u = state(plain), [0.8] * 4
        assert again.rates(x, u, again.values()) == like.rates(x, u, like.values())
        assert again.card.values() == like.card.values()


def test_a_coefficient_that_is_missing_or_strange_is_named(tmp_path: Path) -> None:
    text = wider().card.to_toml()
    for found, put, channel in (
        ("residual_q_theta]", "residual_q_thetta]", "residual_q_theta"),
        ("residual_at_motor_3]", "residual_at_motor_9]", "residual_at_motor_3"),
    ):
        (tmp_path / "model.toml").write_text(text.replace(found, put), encoding="utf-8")
        with pytest.raises(CardError) as caught:
            sp.vehicle(tmp_path / "model.toml")
        assert caught.value.channel == channel


def test_only_a_rigid_body_without_one_can_have_one() -> None:
    with pytest.raises(CardError, match="has a residual already"):
        with_residual(wider(), {})
    with pytest.raises(CardError, match="cannot have a residual"):
        with_residual(sp.vehicle("thirteen_state"), {})


def test_every_row_has_the_inputs() -> None:
    names = coefficients(sp.vehicle("crazyflie"))
    assert len(names) == 4 * (6 + 4) + 2 * (2 + 4)
    assert {row for row, _ in names.values()} == set(ROWS)


def test_one_of_errors_ahead_serves_for_predictions_only() -> None:
    vehicle = sp.vehicle("crazyflie")
    ahead = with_residual(vehicle, dict.fromkeys(vehicle.input_names, 0.8), ahead=0.5)
    for asked in (lambda: sp.linearize(ahead), lambda: sp.export_model(ahead, "control")):
        with pytest.raises(CardError, match=r"0\.5 s ahead") as caught:
            asked()
        assert caught.value.hint is not None
        assert "--horizon" in caught.value.hint
    refuse_predictor(wider(), "anything")
    refuse_predictor(vehicle, "anything")


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_exported_c_carries_it(tmp_path: Path) -> None:
    pytest.importorskip("casadi", reason="the extra 'export' is not installed")
    made, trim = wider(p_p=-3.0, q_motor_1=20.0, v_phi=0.3), sp.trim(sp.vehicle("crazyflie"))
    model = trace_vehicle(made, trim, name="residual")
    run = compiled(model_code(model), tmp_path)
    s, p = (np.array([v.start for v in getattr(model, part)]) for part in ("surroundings", "parameters"))
    x, u = np.array(state(made)), np.full(4, 0.85)
    (found,) = run.call("rates", x, u, s, p, out=(x.size,))
    np.testing.assert_allclose(found, made.rates(x, u, made.values(), trim.environment), rtol=1e-11, atol=1e-9)


def test_a_residual_of_errors_ahead_holds_the_heading_it_began_with(tmp_path: Path) -> None:
    plain = sp.vehicle("crazyflie")
    made = with_residual(plain, dict.fromkeys(plain.input_names, 0.8), ahead=0.5).with_values({"residual_r_psi": -9.0})
    x, u = state(plain), [0.8] * 4
    began = facing(made, 2.0)
    turned = [2.1 if name == "psi" else value for name, value in zip(plain.state_names, x, strict=True)]
    added = (
        began.rates(turned, u, began.values())[plain.index("r")]
        - plain.rates(turned, u, plain.values())[plain.index("r")]
    )
    assert added == pytest.approx(-9.0 * 0.1)
    assert facing(plain, 2.0) is plain
    assert facing(wider(), 2.0).card == wider().card  # what is no autopilot's knows no heading
    assert equations_of(made) != equations_of(wider())
    made.save(tmp_path / "model.toml")
    assert sp.vehicle(tmp_path / "model.toml").card.values() == made.card.values()


def test_a_predictor_simulates_alike_wherever_the_nose_points() -> None:
    plain = sp.vehicle("crazyflie")
    made = with_residual(plain, dict.fromkeys(plain.input_names, 0.8), ahead=0.5).with_values({"residual_r_psi": -9.0})
    inputs = np.tile(sp.trim(plain).inputs, (20, 1))
    ends = [sp.simulate(made, inputs, start={"psi": psi, "r": 0.3}).values("r")[-1] for psi in (0.0, 2.0)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    assert ends[0] < 0.3
