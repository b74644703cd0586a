"""What the page draws of a log is of its kind, or the sentence beside it says that it is not."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.links.live.picture import picture
from swashplate.links.logs.shapes import generic_shape, shape_of
from swashplate.models.catalogue import vehicle as packaged


def log(vehicle: str, reader: str, channels: int) -> Flight:
    data = {"phi": np.zeros(3)} | {f"motor_{k}": np.zeros(3) for k in range(1, channels + 1)}
    return Flight({"a": stream([0.0, 1.0, 2.0], data)}, Provenance(vehicle=vehicle, reader=reader))


@pytest.mark.parametrize(
    ("vehicle", "reader", "motors", "drawn", "told"),
    [
        ("crazyflie", "nanobench", 4, "crazyflie", ""),
        ("raptor50", "simulate", 0, "raptor50", ""),
        ("My quad", "arrays", 4, "crazyflie", "is of a multirotor with 4 rotors (motor_1 to motor_4)"),
        ("My quad", "arrays", 8, "x8", "is of a multirotor with 8 rotors (motor_1 to motor_8)"),
        (
            "ArduCopter V4, QUAD/X",
            "ardupilot",
            0,
            "crazyflie",
            "is of a multirotor with 4 rotors (ArduCopter V4, QUAD/X)",
        ),
        ("ArduCopter V4, HELI", "ardupilot", 0, "raptor50", "is of a helicopter (ArduCopter V4, HELI)"),
        ("ArduCopter V4, COAX", "ardupilot", 0, "coax", "is of a coaxial helicopter (ArduCopter V4, COAX)"),
        ("Heli 600", "delimited", 0, "raptor50", "does not say what flew"),
    ],
)
def test_a_packaged_vehicle_of_the_kind_is_drawn(vehicle: str, reader: str, motors: int, drawn: str, told: str) -> None:
    shape, words = shape_of(log(vehicle, reader, motors))
    assert shape == picture(packaged(drawn))
    assert words == (f"The log {told}: the shape of {drawn} is drawn." if told else "")


KINDS = {"ArduPlane V4.5.7": "a plane", "ArduRover V4.5.7": "a rover", "ArduSub V4.5.7": "a submarine"}


@pytest.mark.parametrize(
    ("vehicle", "kind"),
    KINDS.items(),
)
def test_what_no_rotor_carries_has_a_form_of_its_own(vehicle: str, kind: str) -> None:
    shape, words = shape_of(log(vehicle, "ardupilot", 0))
    parts = shape.pop("parts")
    assert shape == generic_shape(0)
    assert (shape["rotors"], shape["tail"], shape["skids"]) == ([], None, None)
    assert words == f"The log is of {kind} ({vehicle}): a plain one is drawn."
    others = [shape_of(log(other, "ardupilot", 0))[0]["parts"] for other in KINDS if other != vehicle]
    assert parts not in others
    assert {form for form, *_ in parts} <= {"ball", "box", "wheel"}, "what the page can draw"


@pytest.mark.parametrize(
    ("vehicle", "rotors"), [("ArduCopter V4.5.7, HEXA/X", 6), ("ArduCopter V4.5.7, TRI", 3), ("Betaflight 4.5", 4)]
)
def test_other_multirotors_have_their_rotors_around_them(vehicle: str, rotors: int) -> None:
    shape, words = shape_of(log(vehicle, "blackbox" if "Beta" in vehicle else "ardupilot", 0))
    hubs = np.array([rotor["hub"] for rotor in shape["rotors"]])
    assert len(hubs) == rotors
    np.testing.assert_allclose(hubs.mean(axis=0), 0.0, atol=1e-12)
    apart = np.linalg.norm(hubs - np.roll(hubs, 1, axis=0), axis=1).min()
    assert apart > 2.0 * shape["rotors"][0]["radius"]
    assert words.endswith(": a plain one is drawn.")
