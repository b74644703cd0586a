"""What names of commands promise is what the package's own models do."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.flights.motion_signs import INTEGRATIONS, expected_sense, sign_of
from swashplate.models.linear.state_space_file import structure


def test_names_and_second_opinions() -> None:
    assert expected_sense("p", "mixer_roll") == expected_sense("p_imu", "lateral") == 1
    assert expected_sense("az_sid", "mixer_collective") == -1
    assert expected_sense("q", "servo_pitch") == -1
    assert expected_sense("p_demand", "mixer_roll") == 0, "a demand is no motion"
    assert expected_sense("q", "mixer_roll") == expected_sense("q", "stick_pitch") == 0
    assert set(INTEGRATIONS.values()) == {0, 1, 2}


def test_the_coaxes_inputs_move_it_as_their_names_promise() -> None:
    """Its equations, linearised in hover, at frequencies above its bar's."""
    vehicle = sp.vehicle("coax")
    omega, checked = np.geomspace(12.0, 120.0, 60), set()
    h = vehicle.response(omega)
    for o, output in enumerate(vehicle.state_names):
        for i, input in enumerate(vehicle.input_names):
            if sense := expected_sense(output, input):
                told = sign_of(omega, h[:, o, i], integrations=INTEGRATIONS[output])[0]
                assert told == sense, (output, input)
                checked.add(input)
    assert checked == {"servo_roll", "servo_pitch", "motor_lower", "motor_upper"}


@pytest.mark.parametrize(("name", "pairs"), [("rotor_body", 2), ("yaw", 1), ("heave", 1)])
def test_ready_structures_of_mixers_do_so_too(name: str, pairs: int) -> None:
    model, omega, checked = structure(name), np.geomspace(2.0, 60.0, 60), 0
    h = model.response(omega)
    for o, output in enumerate(model.outputs):
        for i, input in enumerate(model.inputs):
            if sense := expected_sense(output, input):
                assert sign_of(omega, h[:, o, i], integrations=INTEGRATIONS[output])[0] == sense, (output, input)
                checked += 1
    assert checked >= pairs
