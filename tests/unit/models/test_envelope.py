"""The monitor of every flight: where it leaves what the vehicle holds for is said, and nothing where it does not."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import CardError
from swashplate.flights.flight import Flight, stream
from swashplate.models.card import card_from
from swashplate.models.doubts import envelope, monitored

TIME = np.arange(0.0, 4.0, 0.01)


def _log(**columns: np.ndarray | float) -> Flight:
    return Flight({"log": stream(TIME, {name: np.zeros(TIME.size) + value for name, value in columns.items()})})


def _flown(servo_pitch: float = 0.0, **wind: float) -> Flight:
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    inputs = {name: np.full(60, value) for name, value in hover.commands().items()} | {"servo_pitch": np.zeros(60)}
    inputs["servo_pitch"][30:33] = servo_pitch
    inputs |= {name: np.full(60, value) for name, value in wind.items()}
    return sp.simulate(coax, inputs, rate=100.0, start=hover)


def test_a_hover_says_nothing() -> None:
    assert _flown().provenance.notes == ()


def test_wind_beyond_the_cards_speed_and_inputs_beyond_their_limits_stand_in_the_flights_notes() -> None:
    (words,) = _flown(wind_north=-5.0).provenance.notes
    assert "its air speed is 5.0 m/s: the card may be trusted up to 2 m/s" in words
    notes = _flown(servo_pitch=1.5).provenance.notes
    assert any("At 0.3 s servo_pitch is told 1.5, beyond its limits -1 to 1" in words for words in notes)


def test_notes_are_told_once() -> None:
    flight = _flown(wind_north=-5.0)
    assert monitored(flight, sp.vehicle("coax")) is flight


@pytest.mark.parametrize(
    ("log", "said"),
    [
        ({"voltage": 12.0, "u": 0.5, "v": 0.0, "w": 0.0}, ""),
        ({"voltage": 7.0}, "Its battery gave 7 V in the mean"),
        ({"u": 3.0, "v": 0.0, "w": 0.0}, "it moves faster than 2 m/s"),
        ({"x": 3.0 * TIME, "y": 0.0, "z": 0.0}, "it moves faster than 2 m/s"),
        ({"x": 1.0 * TIME, "y": 0.0, "z": 0.0}, ""),
        ({"motor_lower": 1.2}, "motor_lower is told 1.2, beyond its limits 0 to 1"),
        ({"motor_lower": 1.0}, ""),
    ],
)
def test_a_log_is_judged_by_what_it_has(log: dict[str, np.ndarray | float], said: str) -> None:
    words = envelope(sp.vehicle("coax"), _log(**log))
    assert len(words) == bool(said)
    assert said in " ".join(words)


@pytest.mark.parametrize("fastest", ["x", True, -1.0, 0])
def test_a_cards_fastest_is_a_speed(fastest: object) -> None:
    document = sp.vehicle("coax").card.to_document()
    assert card_from(document).fastest == document["fastest"] == 2.0
    with pytest.raises(CardError, match=r"fastest: is .* expected a speed"):
        card_from({**document, "fastest": fastest})
