"""Rotor lines: tracked with honest bounds where there is one, refused in noise, where folded and where two cross."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.series import parse
from swashplate.flights.provenance import Provenance
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
    halved = rotor_speed(_flight(_steady, amplitude=1.0, rate=400.0), per_turn=2.0)
    assert np.mean(halved.values("omega_rotor")) == pytest.approx(np.pi * 35.0, abs=0.3)


def test_a_log_without_such_signals_is_refused() -> None:
    flight = Flight({"a": stream(TIME, {"phi": TIME})})
    with pytest.raises(FlightError, match="lie across each other"):
        rotor_speed(flight)


HELICOPTER, QUADROTOR, SUBMARINE = "ArduCopter V4.5.7, HELI", "ArduCopter V4.5.7, QUAD/X", "ArduSub V4.5.7"


def _logged(
    hertz: Callable[[Array], Array],
    *,
    rate: float,
    vehicle: str = "",
    seconds: float = 9.0,
    seed: int = 0,
    channels: dict[str, Callable[[Array], Array]] | None = None,
) -> Flight:
    """Accelerometers that a rotor shakes, as an autopilot logs them, with slower channels at 10 Hz [rad/s, 1]."""
    fine = np.arange(round(seconds * 8000.0)) / 8000.0
    t, rng = np.arange(round(rate * seconds)) / rate, np.random.default_rng(seed)
    phase = np.interp(t, fine, 2.0 * np.pi * np.cumsum(hertz(fine)) / 8000.0)
    running = np.minimum(1.0, (hertz(t) / 20.0) ** 2)
    noise = rng.standard_normal((2, t.size))
    shaken = {"ax": running * np.cos(phase) + 0.5 * noise[0], "ay": running * np.sin(phase) + 0.5 * noise[1]}
    slow = np.arange(round(10.0 * seconds)) / 10.0
    streams = {"inertial": stream(t, shaken)}
    if channels:
        streams["slow"] = stream(slow, {name: of(slow) for name, of in channels.items()})
    reader = "ardupilot" if vehicle else "arrays"
    return Flight(streams, Provenance(source="log.bin", vehicle=vehicle, reader=reader))


def _fast(t: Array) -> Array:
    return np.full_like(t, 41.0)  # 257.6 rad/s


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("vehicle", [QUADROTOR, SUBMARINE, "ArduPlane V4.5.7", "ArduCopter V4.5.7, OCTA_QUAD/X"])
def test_an_aircraft_without_a_main_rotor_has_no_speed_of_one(vehicle: str, seed: int) -> None:
    esc = {"omega_motor_1": lambda t: 2.0 * np.pi * _fast(t)}
    flight = _logged(_fast, rate=25.0, vehicle=vehicle, seed=seed, channels=esc)
    with pytest.raises(FlightError, match=r"which has no main rotor\. .*omega_motor_1 257\.6 rad/s \(41 Hz\)"):
        rotor_speed(flight)
    fast = _logged(_fast, rate=400.0, vehicle=vehicle, seed=seed)
    with pytest.raises(FlightError, match="which has no main rotor"):
        rotor_speed(fast)
    measured = rotor_speed(fast, lines={"omega_1": (35.0, 45.0)})  # who says what it is has its speed
    assert measured.history[-1].details["lines"]["omega_1"]["mean"] == pytest.approx(257.6, abs=0.3)


@pytest.mark.parametrize(("rate", "true"), [(25.0, 41.0), (50.0, 41.0), (100.0, 25.0), (110.0, 35.0)])
def test_a_line_that_may_be_folded_is_refused_with_all_that_look_the_same(rate: float, true: float) -> None:
    for vehicle in (HELICOPTER, ""):
        flight = _logged(lambda t: np.full_like(t, true), rate=rate, vehicle=vehicle)
        with pytest.raises(FlightError, match="may be folded") as refused:
            rotor_speed(flight)
        text = str(refused.value)
        told = re.search(r"the line at (\S+) Hz may be folded: .* lines at (.*) Hz look the same", text)
        assert told is not None
        seen = true - rate * round(true / rate)
        others = [seen + k * rate for k in range(-9, 10) if k and 8.0 <= abs(seen + k * rate) <= 80.0]
        assert float(told[1]) == pytest.approx(seen, abs=0.15)
        assert sorted(map(float, told[2].split(", "))) == pytest.approx(sorted(others), abs=0.15)
        assert min(abs(other - true) for other in (seen, *others)) < 1e-9  # the true one is among them


@pytest.mark.parametrize(("rate", "true"), [(150.0, 41.0), (170.0, 72.0), (400.0, 25.0), (1000.0, 60.0)])
def test_fast_sampling_tells_the_main_rotor_from_every_other(rate: float, true: float) -> None:
    flight = rotor_speed(_logged(lambda t: np.full_like(t, true), rate=rate, vehicle=HELICOPTER))
    told = flight.history[-1].details["lines"]["omega_rotor"]
    assert abs(told["mean"] - 2.0 * np.pi * true) < 4.0 * told["sigma_of_mean"] < 0.5


def test_a_motor_that_shakes_more_is_no_main_rotor() -> None:
    with pytest.raises(FlightError, match="no line stands out"):
        rotor_speed(_logged(lambda t: np.full_like(t, 150.0), rate=400.0, vehicle=HELICOPTER))


def _sags(t: Array) -> Array:
    return 31.0 - 1.5 * np.sin(0.7 * t)


def _rises(t: Array) -> Array:
    return 0.5 + 0.2 * np.sin(0.7 * t)


def test_a_rotor_that_sags_under_load_is_no_image() -> None:
    throttle = {"motor_1": _rises}
    fast = rotor_speed(_logged(_sags, rate=2000.0, vehicle=HELICOPTER, channels=throttle))
    told = fast.history[-1].details["lines"]["omega_rotor"]
    assert told["mean"] == pytest.approx(2.0 * np.pi * np.mean(_sags(fast.time("omega_rotor"))), abs=0.2)
    assert told["remarks"] == []
    slow = _logged(_sags, rate=150.0, vehicle=HELICOPTER, channels=throttle)
    with pytest.raises(FlightError, match=r"the rotor sags under load, or it is the image of a line at 11[89]\.\d Hz"):
        rotor_speed(slow)
    given = rotor_speed(slow, lines={"omega_rotor": (25.0, 38.0)}).history[-1].details["lines"]["omega_rotor"]
    (words,) = given["remarks"]
    assert "the rotor sags under load" in words


@pytest.mark.parametrize("rate", [25.0, 2000.0])
def test_what_the_log_has_is_asked_first(rate: float) -> None:
    head = {"omega_rotor": lambda t: 2.0 * np.pi * _sags(t), "motor_1": _rises}
    head |= {"omega_motor_1": lambda t: np.full_like(t, 1900.0)}
    flight = _logged(_sags, rate=rate, vehicle=HELICOPTER, channels=head)
    told = rotor_speed(flight).history[-1].details["lines"]["omega_rotor"]
    assert told["logged"]
    assert told["mean"] == pytest.approx(2.0 * np.pi * np.mean(_sags(flight.time("omega_rotor"))), rel=1e-6)
    (words,) = told["remarks"]
    assert words.startswith(
        f"omega_motor_1, from the speed controller, is 1900 rad/s: {1900.0 / told['mean']:.3g} turns"
    )


def test_a_sensor_that_tells_nothing_is_not_asked() -> None:
    dead = {"omega_rotor": lambda t: 0.0 * t}
    asked = rotor_speed(_logged(_fast, rate=200.0, vehicle=HELICOPTER, channels=dead))
    assert asked.history[-1].details["lines"]["omega_rotor"]["mean"] == pytest.approx(257.6, abs=0.3)
    assert asked.stream_of("omega_rotor") == "rotor"


def test_a_sweep_is_no_rotor() -> None:
    """A program sweeps to 20 Hz for 20 of 40 s, and a rotor turns in half of such logs."""
    rate, seconds = 200.0, 40.0
    t, rng = np.arange(round(rate * seconds)) / rate, np.random.default_rng(2)
    swept = parse("sweep:roll,0.5-20Hz,20s,1").signals(t - 3.0)["roll"]
    noise = rng.standard_normal((2, t.size))
    for turning in (0.0, 1.0):
        line = turning * np.exp(2j * np.pi * 41.0 * t)
        p, q = 8.0 * swept + line.real + 0.5 * noise[0], 3.0 * swept + line.imag + 0.5 * noise[1]
        flight = Flight({"log": stream(t, {"p": p, "q": q, "mixer_roll": 0.1 * swept})})
        if turning:
            told = rotor_speed(flight).history[-1].details["lines"]["omega_rotor"]
            assert told["mean"] == pytest.approx(257.6, abs=0.3)
        else:
            with pytest.raises(FlightError, match="no line stands out"):
                rotor_speed(flight)


def test_a_line_that_wanders_is_no_rotor() -> None:
    """What a hand shakes: 9 to 23 Hz to and fro."""
    with pytest.raises(FlightError, match=r"wanders by (29|3\d) % about"):
        rotor_speed(_logged(lambda t: 16.0 + 7.0 * np.sin(0.9 * t), rate=200.0))


def _spools_up(t: Array) -> Array:
    return np.interp(t, [3.0, 8.0, 16.0, 20.0], [0.0, 25.0, 25.0, 0.0])


@pytest.mark.parametrize("logged", [True, False])
def test_spooling_up_and_down_is_left_out(logged: bool) -> None:
    channels = {"omega_rotor": lambda t: 2.0 * np.pi * _spools_up(t)} if logged else None
    flight = rotor_speed(_logged(_spools_up, rate=200.0, vehicle=HELICOPTER, seconds=22.0, channels=channels))
    told = flight.history[-1].details["lines"]["omega_rotor"]
    assert told["mean"] == pytest.approx(2.0 * np.pi * 25.0, rel=0.015)
    assert told["runs"] == pytest.approx([7.5, 16.4], abs=0.5)
    if not logged:
        assert flight.time("omega_rotor")[0] == told["runs"][0]
