"""What to fly next, in the autopilot's own parameters and within what the log shows."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from rate_loops import Loop, flight
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Provenance
from swashplate.flights.review.review import review


def flown(vehicle: str, reader: str = "ardupilot", **how: float) -> Flight:
    return replace(flight(Loop(), 2, **how), provenance=Provenance(reader=reader, vehicle=vehicle))


def test_a_helicopter_gets_the_parameters_of_system_id_mode() -> None:
    made = flown("ArduCopter V4.5.7, HELI", size=0.4)
    told = review(made, swept=())
    (sweep,) = told.next
    spread = np.std(made.values("mixer_roll"))
    assert sweep.parameters["SID_AXIS"] == 10.0
    assert sweep.parameters["SID_MAGNITUDE"] == pytest.approx(3.0 * spread, abs=1e-3)
    assert sweep.parameters["SID_F_STOP_HZ"] == pytest.approx(3.0 * told.loops[0].step.bandwidth.value, abs=0.1)
    assert sweep.rate >= np.deg2rad(60.0)
    assert "System ID mode" in told.about_next


def test_a_command_that_has_no_room_left_gets_no_sweep() -> None:
    made = flown("ArduCopter V4.5.7, HELI")
    full = made.with_channel("mixer_roll", np.sign(made.values("mixer_roll")), like="p")
    assert review(full, swept=()).next == ()


@pytest.mark.parametrize(
    ("vehicle", "reader", "words"),
    [
        ("ArduPlane V4.5.7", "ardupilot", "a plane has no sweep of its own"),
        ("Betaflight 4.5.0", "blackbox", "Betaflight has a chirp from 2025.12 on"),
        ("Rotorflight 4.3.0", "blackbox", "no sweep of its own that is known here"),
    ],
)
def test_who_has_no_sweep_is_told_what_to_do(vehicle: str, reader: str, words: str) -> None:
    told = review(flown(vehicle, reader), swept=())
    assert told.next == ()
    assert words in told.about_next


def test_betaflight_gets_its_chirp() -> None:
    (sweep,) = review(flown("Betaflight 2025.12.1", "blackbox"), swept=()).next
    assert sweep.parameters["chirp_frequency_end_deci_hz"] == 1600.0  # of 400 Hz
    assert 60.0 <= sweep.parameters["chirp_amplitude_roll"] <= 230.0


def test_a_review_prints_and_becomes_json() -> None:
    told = review(flown("ArduCopter V4.5.7, HELI"), swept=())
    document = json.loads(json.dumps(told.to_document(), allow_nan=False))
    assert document["loops"][0]["step"]["delay"]["value"] == pytest.approx(told.loops[0].step.delay.value)
    for heading in ("incidents", "rate loops", "noise", "what to fly next"):
        assert heading in str(told)
    assert told.figures == ("step responses", "gyro noise")
