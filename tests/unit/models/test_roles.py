"""What a state is stands in its declaration: nobody guesses it from its name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import motors
from swashplate.models.traits import Role

READINGS = ("x", "y", "z", "phi", "theta", "psi")


def test_a_fan_has_the_noise_floor_of_a_rotor() -> None:
    coax = sp.vehicle("coax")
    other = replace(coax, state_names=tuple("fan_speed" if n == "omega_upper" else n for n in coax.state_names))
    floors = [stochastic_model(each, READINGS, 0.01).unexcited for each in (coax, other)]
    np.testing.assert_array_equal(*floors)
    assert floors[1][other.index("fan_speed")] == floors[1][other.index("omega_lower")] == 1e-4
    assert other.rotor_speeds == ("omega_lower", "fan_speed")


def test_a_state_that_says_that_it_is_none_is_none() -> None:
    coax = sp.vehicle("coax")
    roles: dict[str, Role] = {**coax.traits.roles, "omega_upper": "other"}
    other = replace(coax, traits=replace(coax.traits, roles=roles))
    assert other.rotor_speeds == ("omega_lower",)
    assert stochastic_model(other, READINGS, 0.01).unexcited[other.index("omega_upper")] == 1e-10


@pytest.mark.parametrize(
    ("name", "speeds", "tilting", "driven"),
    [
        ("coax", 2, 2, ["motor_lower", "motor_upper"]),
        ("crazyflie", 4, 0, ["motor_1", "motor_2", "motor_3", "motor_4"]),
        ("raptor50", 0, 2, []),
        ("ingenuity", 0, 4, []),
        ("eleven_state", 0, 2, []),
    ],
)
def test_ready_vehicles_say_what_their_states_are(name: str, speeds: int, tilting: int, driven: list[str]) -> None:
    vehicle = sp.vehicle(name)
    assert len(vehicle.rotor_speeds) == speeds
    assert vehicle.roles.count("flapping") == tilting
    assert vehicle.roles[:8].count("body") == 8
    assert [n for n, motor in zip(vehicle.input_names, motors(vehicle), strict=True) if motor] == driven
    assert all(motor in vehicle.input_names for motor in vehicle.traits.motors)
