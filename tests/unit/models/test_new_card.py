"""First cards from mass and radius: the right class, its statistics, and a hover."""

from __future__ import annotations

import math

import pytest

from swashplate.errors import CardError
from swashplate.models.card import Card, packaged_cards
from swashplate.models.catalogue import from_card
from swashplate.models.conventional.new_card import CLASSES, default_class, new_card
from swashplate.simulation.trim import trim

TYPICAL = {"micro": (0.3, 0.22), "600": (4.6, 0.68), "90": (8.2, 0.78), "rmax": (80.0, 1.55), "full-size": (7440, 8.18)}
"""Mass [kg] and rotor radius [m] of one of each class."""
DRAG_AREAS = {"micro": (0.002, 0.06), "600": (0.02, 0.15), "90": (0.04, 0.3), "rmax": (0.15, 0.8)}
"""Drag areas [m^2] that a fuselage of the class can have, wide: a card scaled from another class leaves them."""


def card_of(name: str) -> Card:
    mass, radius = TYPICAL[name]
    return new_card("Mine", mass=mass, radius=radius, size_class=name)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("lynx", "full-size"),
        ("rmax", "rmax"),
        ("r50", "rmax"),
        ("raptor50", "600"),
        ("xcell60", "90"),
        ("helion", "90"),
    ],
)
def test_packaged_helicopters_fall_into_their_class(name: str, expected: str) -> None:
    known = packaged_cards()[name].values()
    assert default_class(known["mass"], known["rotor_radius"]).name == expected


def test_where_mass_and_radius_disagree_the_mass_decides_and_it_is_said() -> None:
    """HeLion weighs as a 90 and has the rotor of a 600; a Raptor 50 is a 600 by both."""
    found = default_class(9.75, 0.705)
    assert found.name == "90"
    assert "usual in class 600: check both" in found.why
    assert "check both" not in default_class(4.763, 0.6725).why


@pytest.mark.parametrize("name", CLASSES)
def test_a_card_of_each_class_hovers_inside_its_limits(name: str) -> None:
    card = card_of(name)
    known, found = card.values(), trim(from_card(card))
    inputs = found.commands()
    assert found.residual < 1e-9
    assert known["collective_low"] < inputs["theta0"] < 0.75 * known["collective_high"]
    assert known["tail_low"] < inputs["theta0T"] < 0.75 * known["tail_high"]
    assert max(abs(inputs["A1"]), abs(inputs["B1"])) < 0.25 * known["cyclic_limit"]


@pytest.mark.parametrize("name", CLASSES)
def test_hub_blades_and_marks_of_each_class(name: str) -> None:
    card = card_of(name)
    known, radius = card.values(), card.values()["rotor_radius"]
    assert abs(known["hub_x"]) < 0.03 * radius
    assert known["hub_y"] == 0.0
    assert card.parameters["hub_y"].sigma == pytest.approx(0.01 * radius, rel=0.01)
    assert 0.15 * radius < known["hub_height"] < 0.5 * radius
    assert known["tail_blades"] == (4 if name == "full-size" else 2)
    for parameter, entry in card.parameters.items():
        given = parameter in ("mass", "rotor_radius")
        assert entry.status == ("measured" if given else "assumed")
        assert entry.source
        assert entry.lower is None or entry.lower <= entry.value
        assert entry.upper is None or entry.value <= entry.upper
    for parameter in ("fuselage_area_x", "rotor_speed", "tail_arm", "rotor_drag"):
        sigma = card.parameters[parameter].sigma
        assert sigma is not None
        assert 0.1 < sigma / known[parameter] < 0.6


@pytest.mark.parametrize("name", DRAG_AREAS)
def test_the_drag_area_of_small_classes(name: str) -> None:
    low, high = DRAG_AREAS[name]
    assert low < card_of(name).values()["fuselage_area_x"] < high


def test_a_full_size_card_is_no_large_model() -> None:
    """At the UH-60A's weight and radius the scaled Raptor has 8.9 m^2, 2 tail blades, hub_y 0.145 m and 15 deg."""
    asked = {"mass": 7440.0, "radius": 8.178}
    known, scaled = (new_card("Mine", **asked, **more).values() for more in ({}, {"like": "raptor50"}))
    assert scaled["fuselage_area_x"] == pytest.approx(8.87, abs=0.02)
    assert scaled["hub_y"] == pytest.approx(0.145, abs=1e-3)
    assert 0.0038 < known["fuselage_area_x"] / asked["mass"] ** (2.0 / 3.0) < 0.007  # Lynx and UH-1B
    entry = new_card("Mine", mass=7440.0, radius=8.178).parameters["fuselage_area_x"]
    assert "Prouty" in entry.source
    assert entry.sigma is not None
    assert abs(entry.value / 7440.0 ** (2.0 / 3.0) - 19.5 * 0.3048**2 / (9500 * 0.45359) ** (2.0 / 3.0)) < 2.0 * (
        entry.sigma / 7440.0 ** (2.0 / 3.0)
    )  # the UH-1B's 19.5 ft^2 at 9,500 lb
    assert known["hub_y"] == 0.0
    assert math.degrees(known["collective_high"]) == pytest.approx(25.0)
    assert new_card("Light", mass=1157.0, radius=4.0).values()["tail_blades"] == 2


REGRESSED = ("rotor_chord", "rotor_speed", "tail_radius", "tail_chord", "tail_gear", "tail_arm", "tailplane_area")


@pytest.mark.parametrize("name", REGRESSED)
def test_the_statistics_meet_the_lynx_within_two_sigmas(name: str) -> None:
    """Its published numbers chose nothing but the sign of the tip speeds' exponents."""
    lynx = packaged_cards()["lynx"].values()
    entry = new_card("Lynx", mass=lynx["mass"], radius=lynx["rotor_radius"]).parameters[name]
    assert entry.sigma is not None
    assert abs(entry.value - lynx[name]) < 2.0 * entry.sigma
    assert "Rand and Khromov" in entry.source


def test_unknown_classes_and_two_choices_are_refused() -> None:
    with pytest.raises(CardError, match="is no class of helicopters, expected one of micro, 600, 90, rmax, full-size"):
        new_card("Mine", mass=5.0, radius=0.7, size_class="airliner")
    with pytest.raises(CardError, match="not both"):
        new_card("Mine", mass=5.0, radius=0.7, size_class="600", like="lynx")
