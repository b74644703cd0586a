"""Aircraft that differ: tolerances, payload, delayed commands, and the step to a wanted speed."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.straightness import command_for_speed, step_run
from swashplate.control.draws.variations import draw_delays, draw_numbers, load_them, tolerances_of
from swashplate.control.laws.autopilot import autopilot
from swashplate.errors import ControllerError, SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.closed_loop_batch import simulate_closed_loops
from swashplate.simulation.trim import Trim


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return sp.vehicle("coax")


@pytest.fixture(scope="module")
def hover(coax: Vehicle) -> Trim:
    return sp.trim(coax)


def test_numbers_vary_as_asked_within_physics(coax: Vehicle) -> None:
    about = {"tau_f_upper": np.full(4000, 2.0)}
    drawn = draw_numbers(coax, {"mass": 0.01, "tau_f_upper": 0.1}, count=4000, seed=1, about=about)
    assert drawn["mass"].mean() == pytest.approx(coax.card.values()["mass"], abs=0.001)
    assert drawn["mass"].std() == pytest.approx(0.01, rel=0.05)
    assert drawn["tau_f_upper"].mean() == pytest.approx(2.0, abs=0.01)
    wild = draw_numbers(coax, {"mass": 5.0}, count=100, seed=1)["mass"]
    assert wild.min() >= (coax.card.parameters["mass"].lower or -np.inf)
    loaded = load_them(coax, drawn, most=0.05, count=4000, seed=2)
    extra = loaded["mass"] - drawn["mass"]
    assert extra.min() >= 0.0
    assert extra.max() == pytest.approx(0.05, rel=0.01)
    late = draw_delays(most=0.03, count=1000, seed=3)
    assert 0.0 <= late.min() < 0.001 < 0.029 < late.max() <= 0.03
    for wrong, said in (({"weight": 0.1}, "is not a number of the card"), ({"mass": -0.1}, "expected zero or more")):
        with pytest.raises(ControllerError, match=said):
            draw_numbers(coax, wrong, count=2, seed=0)
    assert all(sigma > 0.0 for sigma in tolerances_of(sp.vehicle("raptor50")).values())
    with pytest.raises(ControllerError, match=r"no number of the card has a sigma.*--vary"):
        tolerances_of(coax)


@pytest.mark.proof
def test_a_delay_of_whole_samples_is_a_command_of_so_many_samples_ago(coax: Vehicle, hover: Trim) -> None:
    """Entry 0 flies without a delay and agrees with a single flight; the others get what it commanded a while ago."""
    controller = autopilot(coax, hover)
    ask = {"duration": 3.0, "size": 3, "reference": {"x": 1.0, "psi": 0.3}, "start": hover}
    many = simulate_closed_loops(coax, controller, delay=[0.0, 0.01, 0.014], **ask)  # type: ignore[arg-type]
    single = simulate_closed_loop(
        coax, controller, duration=3.0, reference={"x": 1.0, "psi": 0.3}, start=hover, rate=500.0
    )
    np.testing.assert_allclose(many["psi"][:, 0], single.values("psi")[:-1:5], atol=1e-11)
    # Until the first late command arrives everything rests; then the record is that of the command a sample before.
    command = coax.input_names.index("motor_upper")
    np.testing.assert_allclose(many.rows[0, command, 1], hover.inputs[command], rtol=1e-12)
    assert many.rows[0, command, 0] != pytest.approx(hover.inputs[command], rel=1e-3)
    np.testing.assert_allclose(many.rows[1, command, 1], many.rows[0, command, 0], rtol=1e-9)
    # 14 ms lie between 10 and 20 ms, and all of them differ.
    between = simulate_closed_loops(coax, controller, delay=[0.01, 0.014, 0.02], **ask)["psi"][30]  # type: ignore[arg-type]
    assert between[0] > between[1] > between[2]
    with pytest.raises(SwashError, match="delay: is negative"):
        simulate_closed_loops(coax, controller, delay=-0.01, **ask)  # type: ignore[arg-type]


def test_the_step_that_reaches_a_speed(coax: Vehicle, hover: Trim) -> None:
    law = autopilot(coax, hover, mode="manual")
    command = command_for_speed(coax, law, hover, speed=1.8)
    run = step_run(coax, law, hover, command=command)
    assert run.path.speed[0] == pytest.approx(1.8, abs=0.002)
    assert run.flight.values("x")[-1] == pytest.approx(6.0, abs=0.1)
    assert run.drawn is None
    with pytest.raises(ControllerError, match="with the full stick"):
        command_for_speed(coax, law, hover, speed=30.0)
