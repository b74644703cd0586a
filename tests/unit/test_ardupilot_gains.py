"""Suggested rate-loop gains keep their margins on the model they were made for."""

from __future__ import annotations

import numpy as np

from swashplate.control.ardupilot_gains import GAIN_MARGIN, PHASE_MARGIN, loop_of, suggest_gains
from swashplate.identification.state_space_file import structure

SITL = {
    "Lb": 3588.6, "Ma": 617.5, "tau_f": 0.068232, "Ba": 1.2963, "Ab": -1.3402, "Blat": 0.24493, "Blon": -0.08487,
    "Alat": 0.07285, "Alon": 0.26962, "tau_roll": 0.0534, "tau_pitch": 0.0526,
}  # fmt: skip


def test_gains_of_the_simulated_helicopter() -> None:
    model = structure("rotor_body").with_values(SITL)
    roll, pitch = suggest_gains(model)
    # Feed-forward: one over the steady rate per command (true DC gains 3.5897 and 3.9515 rad/s per unit).
    assert abs(roll.parameters["ATC_RAT_RLL_FF"] * 3.5897 - 1.0) < 0.03
    assert abs(pitch.parameters["ATC_RAT_PIT_FF"] * 3.9515 - 1.0) < 0.03
    for found in (roll, pitch):
        read = found.margins
        assert not read.gain_margin.value < GAIN_MARGIN
        assert not read.phase_margin.value < PHASE_MARGIN
        assert found.peak < 2.0
        # The closed loop is stable: Nyquist's curve of this stable plant does not go round -1.
        omega = np.geomspace(0.01, 500.0, 20000)
        turns = np.unwrap(np.angle(1.0 + loop_of(model, found, omega)))
        assert abs(turns[-1] - turns[0]) < np.pi
    # The firmware's own hand-tuned P for this helicopter is 0.06 in roll.
    assert 0.03 < roll.parameters["ATC_RAT_RLL_P"] < 0.12


def test_an_axis_that_the_model_lacks_gets_none() -> None:
    assert suggest_gains(structure("heave")) == ()
