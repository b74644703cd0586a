"""A controller checked on another vehicle than its design's: the loop is the vehicle's, the difference is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.stability import margins_of, modes_of
from swashplate.control.laws.autopilot import autopilot
from swashplate.control.laws.autopilot_kind import KIND as LAW
from swashplate.control.lqg.analysis import analyse
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.design import design
from swashplate.control.lqg.kind import differences
from swashplate.control.lqg.steady_loop import observed_loop
from swashplate.errors import ControllerError
from swashplate.filtering.sensor_suite import suite
from swashplate.models.vehicle import Vehicle


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return sp.vehicle("coax")


@pytest.fixture(scope="module")
def made(coax: Vehicle) -> Lqg:
    return design(coax, sensors=suite("imu@100,mocap@100+10ms"))


def about(vehicle: Vehicle, **delays: float) -> Aircraft:
    return Aircraft(vehicle, sp.trim(vehicle, voltage=vehicle.card.values()["voltage_nominal"]), delays)


def test_on_its_own_model_nothing_differs(coax: Vehicle, made: Lqg) -> None:
    own = about(coax)
    assert differences(made, own, None) == ()
    assert LAW.differences(autopilot(coax, own.trim), own, None) == ()
    found = margins_of(observed_loop(made, on=own))
    assert found.together.alpha == pytest.approx(analyse(made).margins.together.alpha, rel=0.05)


def test_the_loop_is_that_of_the_vehicle_that_is_named(coax: Vehicle, made: Lqg) -> None:
    """Servos that tilt the rotor by half as much more: the margin upwards shrinks by that gain, exactly as on paper."""
    numbers = coax.card.values()
    strong = about(coax.with_values({"linkage_lower": 1.5 * numbers["linkage_lower"]}))
    before, after = ({a.name: a for a in margins_of(observed_loop(made, on=on)).axes} for on in (about(coax), strong))
    assert after["servo_roll"].crossover > 1.1 * before["servo_roll"].crossover
    assert after["servo_roll"].delay < 0.9 * before["servo_roll"].delay
    assert after["motor_lower"].gain_down == pytest.approx(before["motor_lower"].gain_down, rel=0.01)
    wild = about(coax.with_values({"linkage_lower": -numbers["linkage_lower"]}))
    assert modes_of(observed_loop(made, on=wild))[0].real > 0.5  # it must be able to say no
    with pytest.raises(ControllerError, match="growing mode"):
        margins_of(observed_loop(made, on=wild))


def test_what_differs_is_told_with_its_numbers(coax: Vehicle, made: Lqg) -> None:
    mass = coax.card.values()["mass"]
    heavy = coax.with_values({"mass": 1.2 * mass})
    heavy = heavy.with_card(replace(heavy.card, title="loaded"))
    head, numbers, answers = differences(made, about(heavy), None)
    assert "another model" in head
    assert "'loaded'" in head
    assert f"mass {mass:.4g} against {1.2 * mass:.4g}" in numbers
    assert "motor_lower" in answers
    late = differences(made, about(coax, servo_roll=0.03), None)
    assert any("servo_roll 0 against 30 ms" in words for words in late)
    assert any("servo_roll 15 %" in words for words in late)  # 2 sin(5 rad/s 30 ms / 2)
    bare = sp.vehicle("coax", bar=False)
    assert any("bar True against False" in words for words in differences(made, about(bare), None))
    assert np.all(np.isfinite(modes_of(observed_loop(made, on=about(bare)))))  # another number of states
    (told,) = LAW.differences(autopilot(coax, sp.trim(coax)), about(heavy), None)
    assert "flown on 'loaded'" in told
