"""Betaflight's chirp from the debug fields of its log: told where they follow the header's law, and only there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.readers.blackbox import chirps
from swashplate.flights.readers.blackbox_header import Header

START, STOP, SECONDS, BEGIN = 0.2, 600.0, 20.0, 8.003
HEADER = {
    "chirp_frequency_start_deci_hz": "2",
    "chirp_frequency_end_deci_hz": "6000",
    "chirp_time_seconds": "20",
    "chirp_amplitude_roll": "230",
    "chirp_amplitude_pitch": "150",
}
TIME = 5.0 + np.arange(6000) / 250.0


def fields(*, axis: int = 0, until: float = BEGIN + SECONDS) -> dict[str, np.ndarray]:
    """The two debug fields as the firmware writes them: whole numbers."""
    on = (TIME >= BEGIN) & (until >= TIME)
    hertz = START * (STOP / START) ** ((TIME - BEGIN) / SECONDS)
    return {
        "debug[1]": np.where(on, axis, -1).astype(np.int64),
        "debug[2]": np.where(on, np.rint(10.0 * hertz), 0).astype(np.int64),
    }


def told(columns: dict[str, np.ndarray], **header: str) -> list[Any]:
    return chirps(Header(HEADER | header, {}, 0), columns, TIME)


@pytest.mark.parametrize(("axis", "name", "magnitude"), [(0, "roll", 230.0), (1, "pitch", -150.0), (2, "yaw", -1.0)])
def test_a_chirp_is_told_with_its_axis_its_times_and_its_law(axis: int, name: str, magnitude: float) -> None:
    (event,) = told(fields(axis=axis))
    assert event.kind == "sweep"
    assert event.text == f"{name} rate, 0.2-600 Hz in 20 s"
    assert event.details["start"] == pytest.approx(BEGIN, abs=0.02)
    assert event.details["stop"] == event.details["start"] + SECONDS
    assert event.details["seen"] == pytest.approx(BEGIN + SECONDS, abs=0.02)
    assert (event.details["magnitude"], event.details["channel"]) == (magnitude, f"mixer_{name}")
    law = Chirp(**{key: event.details[key] for key in Chirp.__dataclass_fields__})
    at = np.array([5.0, 15.0])
    np.testing.assert_allclose(law.frequency(at), START * (STOP / START) ** (at / SECONDS))


def test_one_that_was_stopped_says_how_long_it_was_flown() -> None:
    (event,) = told(fields(until=15.0))
    assert event.details["seen"] == pytest.approx(15.0, abs=0.01)
    assert event.details["stop"] == pytest.approx(BEGIN + SECONDS, abs=0.02)


def test_debug_fields_of_another_mode_tell_no_chirp() -> None:
    """The header has the chirp's settings although the pilot logged something else in the debug fields."""
    rng = np.random.default_rng(0)
    gyro = rng.integers(0, 6000, TIME.size)
    throttle = (1000 + 400 * np.sin(TIME)).astype(np.int64)
    ramp = np.where((TIME > BEGIN) & (TIME < BEGIN + SECONDS), (300.0 * (TIME - BEGIN)).astype(np.int64), 0)
    for field in (gyro, throttle, ramp, np.full(TIME.size, 700)):
        for axis in (np.zeros(TIME.size, np.int64), rng.integers(-1, 3, TIME.size)):
            assert told({"debug[1]": axis, "debug[2]": field}) == []
    assert told({"debug[2]": fields()["debug[2]"]}) == []
    assert told(fields(), chirp_time_seconds="8") == []  # a law, but not the header's
    assert chirps(Header({}, {}, 0), fields(), TIME) == []
