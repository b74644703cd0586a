"""What a log says that flew: by firmware and frame, by parameters, by motors; nothing where it says nothing."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance


def log(
    vehicle: str = "", *, reader: str = "ardupilot", channels: tuple[str, ...] = ("p",), **parameters: float
) -> Flight:
    data = {name: np.zeros(3) for name in channels}
    return Flight(
        {"a": stream([0.0, 1.0, 2.0], data)}, Provenance(vehicle=vehicle, reader=reader, parameters=parameters)
    )


@pytest.mark.parametrize(
    ("vehicle", "words", "main", "rotors"),
    [
        ("ArduCopter V4.5.7 (00000000), HELI", "a helicopter", 1, 0),
        ("ArduCopter V4.5.7, HELI_DUAL", "a helicopter with 2 main rotors", 2, 0),
        ("ArduCopter V4.7.0-dev (66a7e16b), COAX", "a coaxial helicopter", 2, 0),
        ("ArduCopter V4.5.7, QUAD/X", "a multirotor with 4 rotors", 0, 4),
        ("APM:Copter V3.3, HEXA/PLUS", "a multirotor with 6 rotors", 0, 6),
        ("ArduCopter V4.5.7, OCTA_QUAD/X", "a multirotor with 8 rotors", 0, 8),
        ("ArduPlane V4.5.7 (00000000)", "a plane", 0, 0),
        ("ArduRover V4.5.7", "a rover", 0, 0),
        ("ArduSub V4.5.7", "a submarine", 0, 0),
        ("Blimp V4.5", None, 0, 0),
        ("ArduCopter V4.5.7", None, 0, 0),
        ("", None, 0, 0),
    ],
)
def test_ardupilot_names_its_firmware_and_its_frame(vehicle: str, words: str | None, main: int, rotors: int) -> None:
    told = aircraft_kind(log(vehicle))
    assert (told and told.noun) == words
    if told is not None:
        assert (told.main_rotors, told.rotors) == (main, rotors)
        assert told.source in vehicle
    assert aircraft_kind(log(vehicle, reader="delimited")) is None  # a name that a user gave says nothing


def test_parameters_say_it_where_names_do_not() -> None:
    for number, words in ((1.0, "a multirotor with 4 rotors"), (6.0, "a helicopter"), (9.0, "a coaxial helicopter")):
        told = aircraft_kind(log("ArduCopter V4.5.7", FRAME_CLASS=number))
        assert told is not None
        assert (told.noun, told.source) == (words, f"FRAME_CLASS {number:g}")
    for number, words in ((1.0, "a rover"), (2.0, "a boat")):
        told = aircraft_kind(log("ArduRover V4.5.7", FRAME_CLASS=number))
        assert told is not None
        assert told.noun == words
    told = aircraft_kind(log("ArduPlane V4.5.7", Q_ENABLE=1.0))
    assert told is not None
    assert told.noun == "a plane that takes off vertically"
    for parameters, words in (
        ({"MAV_TYPE": 1.0}, "a plane"),
        ({"MAV_TYPE": 4.0}, "a helicopter"),
        ({"MAV_TYPE": 2.0, "CA_AIRFRAME": 11.0}, "a helicopter"),
        ({"MAV_TYPE": 13.0, "CA_AIRFRAME": 0.0}, "a multirotor with 6 rotors"),
    ):
        told = aircraft_kind(log("PX4", reader="ulog", **parameters))
        assert told is not None
        assert told.noun == words
    assert aircraft_kind(log("PX4", reader="ulog")) is None
    assert aircraft_kind(log("a table", reader="delimited", MAV_TYPE=1.0)) is None


def test_firmwares_of_blackbox_logs_and_motors() -> None:
    four = ("motor_1", "motor_2", "motor_3", "motor_4")
    for vehicle, channels, words in (
        ("Goblin Rotorflight 4.4.0", ("motor_1", "motor_2"), "a helicopter"),
        ("TEST Betaflight 2025.12.1", ("p",), "a multirotor"),
        ("TEST Betaflight 2025.12.1", four, "a multirotor with 4 rotors"),
        ("INAV 7.1.2", four, "a multirotor with 4 rotors"),
        ("INAV 7.1.2", ("motor_1",), None),
    ):
        told = aircraft_kind(log(vehicle, reader="blackbox", channels=channels))
        assert (told and told.noun) == words
    for channels, words in (
        (four, "a multirotor with 4 rotors"),
        (("motor_lower", "motor_upper"), "a coaxial helicopter"),
        (("motor_1",), None),
        (("omega_rotor", "phi"), None),
    ):
        told = aircraft_kind(log("", reader="arrays", channels=channels))
        assert (told and told.noun) == words
