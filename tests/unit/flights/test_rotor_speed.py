"""Rotor lines: tracked with honest bounds where there is one, refused in noise, where folded and where two cross."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.rotor_speed import rotor_speed

RATE, SECONDS = 150.0, 8.0
TIME = np.arange(round(RATE * SECONDS)) / RATE


def _steady(t: Array) -> Array:
    return np.full_like(t, 35.0)


def _swaying(t: Array) -> Array:
    return 35.0 + 1.5 * np.sin(1.2 * t)


def _flight(
    *hertz: Callable[[Array], Array],
    amplitude: float = 0.5,
    sense: float = -1.0,
    seed: int = 0,
    rate: float = RATE,
    pair: tuple[str, str] = ("phi", "theta"),
    command: Callable[[Array], Array] | None = None,
) -> Flight:
    """Lines of an amplitude in noise of size one, on slow motion; one command that goes with the first line."""
    rng, t = np.random.default_rng(seed), np.arange(round(rate * SECONDS)) / rate
    z = rng.standard_normal(t.size) + 1j * rng.standard_normal(t.size) + 20.0 * np.sin(2.0 * t) + 15j * np.cos(3.0 * t)
    for line in hertz:
        z = z + amplitude * np.exp(2j * np.pi * sense * np.cumsum(line(t)) / rate)
    channels = {pair[0]: 1e-3 * z.real, pair[1]: 1e-3 * z.imag}
    if command is not None:
        channels["motor_upper"] = command(t)
    return Flight({"motion": stream(t, channels)})


@pytest.mark.parametrize(
    ("rate", "pair"),
    [
        (150.0, ("phi", "theta")),
        pytest.param(400.0, ("ax", "ay"), marks=pytest.mark.proof),
        pytest.param(400.0, ("p", "q"), marks=pytest.mark.proof),
    ],
)
def test_a_line_is_tracked_with_honest_bounds(rate: float, pair: tuple[str, str]) -> None:
    made = rotor_speed(_flight(_steady, rate=rate, pair=pair))
    told = made.history[-1].details["lines"]["omega_rotor"]
    away = (made.values("omega_rotor") - 2 * np.pi * 35.0) / made.values("omega_rotor_sigma")
    assert told["hertz"] == pytest.approx(-35.0, abs=0.05)  # counter-clockwise
    assert 0.6 < np.sqrt(np.mean(away**2)) < 1.4
    assert abs(told["mean"] - 2 * np.pi * 35.0) < 4.0 * told["sigma_of_mean"]
    assert told["folded_from_hertz"] == pytest.approx([told["hertz"] - rate, told["hertz"] + rate])
    assert made["omega_rotor"].attrs["units"] == "rad/s"


def test_a_speed_that_sways_is_followed() -> None:
    made = rotor_speed(_flight(_swaying, amplitude=1.0), lines={"omega_upper": (-40.0, -30.0)})
    t = made.time("omega_upper")
    error = made.values("omega_upper") - 2 * np.pi * _swaying(t)
    assert np.sqrt(np.mean(error**2)) < 1.0  # of 9.4 rad/s


@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_is_refused(seed: int) -> None:
    with pytest.raises(FlightError, match="no line stands out"):
        rotor_speed(_flight(seed=seed))


def test_a_line_of_the_other_sense_is_not_the_rotor() -> None:
    with pytest.raises(FlightError, match="no line stands out"):
        rotor_speed(_flight(_steady), lines={"omega_lower": (30.0, 40.0)})


def _beyond(t: Array) -> Array:
    return 150.0 - _swaying(t)  # seen as -(150 - f): at 35 Hz of the other sense


def test_a_folded_line_falls_where_the_command_rises_and_is_refused() -> None:
    def command(t: Array) -> Array:
        return 0.5 + 0.02 * (_beyond(t) - 115.0)

    with pytest.raises(FlightError, match=r"image of a line at 11[45]\.\d Hz"):
        rotor_speed(_flight(_beyond, amplitude=1.0, sense=1.0, command=command))
    rotor_speed(_flight(_swaying, amplitude=1.0, command=lambda t: 0.5 + 0.02 * (_swaying(t) - 35.0)))


def test_a_band_that_the_sampling_does_not_show_is_refused() -> None:
    for band in ((80.0, 120.0), (40.0, 30.0), (35.0, 36.0)):
        with pytest.raises(FlightError, match="sampling shows up to 70"):
            rotor_speed(_flight(_steady), lines={"omega_rotor": band})


def test_lines_that_cross_are_refused_and_lines_that_stay_apart_are_not() -> None:
    def rising(t: Array) -> Array:
        return 30.0 + 10.0 * t / SECONDS

    def falling(t: Array) -> Array:
        return 40.0 - 10.0 * t / SECONDS

    with pytest.raises(FlightError, match="two lines cross"):
        rotor_speed(_flight(rising, falling, amplitude=1.0))
    apart = rotor_speed(_flight(_steady, lambda t: _steady(t) + 12.0, amplitude=1.0), lines={"omega_1": (-40.0, -30.0)})
    assert apart.history[-1].details["lines"]["omega_1"]["hertz"] == pytest.approx(-35.0, abs=0.05)


def test_two_rotors_have_a_channel_each_and_names_are_not_used_twice() -> None:
    flight = _flight(_steady, amplitude=1.0)
    both = flight.with_channel("phi", flight.values("phi") + 1e-3 * np.cos(2 * np.pi * 38.0 * TIME), like="phi")
    both = both.with_channel("theta", both.values("theta") + 1e-3 * np.sin(2 * np.pi * 38.0 * TIME), like="theta")
    made = rotor_speed(both, lines={"omega_upper": (-40.0, -30.0), "omega_lower": (33.0, 43.0)})
    assert np.mean(made.values("omega_lower")) == pytest.approx(2 * np.pi * 38.0, abs=0.5)
    assert np.mean(made.values("omega_upper")) == pytest.approx(2 * np.pi * 35.0, abs=0.5)
    with pytest.raises(FlightError, match="is there already"):
        rotor_speed(made, lines={"omega_upper": (-40.0, -30.0)})
    halved = rotor_speed(flight, per_turn=2.0)
    assert np.mean(halved.values("omega_rotor")) == pytest.approx(np.pi * 35.0, abs=0.3)


def test_a_log_without_such_signals_is_refused() -> None:
    flight = Flight({"a": stream(TIME, {"phi": TIME})})
    with pytest.raises(FlightError, match="lie across each other"):
        rotor_speed(flight)
