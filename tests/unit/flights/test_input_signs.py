"""`inspect` shows which way each command moves the aircraft: right, turned, and what it does not tell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import chirp, lfilter

import swashplate as sp
from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream

RATE = 100.0
TIME = np.arange(0.0, 50.0, 1.0 / RATE)


def sweep(seed: int = 0) -> Array:
    edge = np.clip(np.minimum(TIME - 3.0, 47.0 - TIME), 0.0, 1.0)
    noise = np.random.default_rng(seed).standard_normal(TIME.size)
    return np.asarray(0.1 * edge * chirp(TIME - 3.0, 0.4, 44.0, 8.0, "logarithmic") + 1e-3 * noise)


def lagged(u: Array, gain: float, pole: float = 5.0) -> Array:
    """gain / (s + pole) behind 30 ms."""
    late = np.concatenate([np.zeros(3), u[:-3]])
    step = np.exp(-pole / RATE)
    return np.asarray(lfilter([0.0, gain * (1.0 - step) / pole], [1.0, -step], late))


def accelerated(u: Array, gain: float) -> Array:
    """What such a speed's change is."""
    return np.asarray(np.gradient(lagged(u, gain, 1.0), 1.0 / RATE))


def flown(**channels: Array) -> Flight:
    noise = np.random.default_rng(9)
    noisy = {n: v + 1e-3 * np.std(v) * noise.standard_normal(v.size) for n, v in channels.items()}
    return Flight({"log": stream(TIME, noisy)})


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(
    ("command", "motion", "gain"),
    [("mixer_roll", "p", 50.0), ("lateral", "p", 50.0), ("servo_pitch", "q", -40.0), ("pedal", "r", 30.0)],
)
def test_a_command_and_its_rate(command: str, motion: str, gain: float, sense: float) -> None:
    u = sweep()
    look = sp.inspect(flown(**{command: u, motion: lagged(u, sense * gain)}))
    (line,) = look.signs
    says = "positive" if sense * gain > 0.0 else "negative"
    assert line.startswith(f"{command} to {motion}: {says}, {'as' if sense > 0.0 else 'NOT as'} its name says")
    wrong = [text for text in look.problems if "has the wrong sign" in text]
    assert len(wrong) == (sense < 0.0)
    assert all(f"Give --unit {command}=-" in text for text in wrong)
    assert line in str(look)
    assert look.to_document()["signs"] == (line,) or look.to_document()["signs"] == [line]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_collective_and_the_acceleration_down(sense: float) -> None:
    u = sweep()
    look = sp.inspect(flown(collective=u, az=-9.81 + accelerated(u, -60.0 * sense)))
    assert ("collective to az: negative, as its name says" in look.signs[0]) == (sense > 0.0)
    assert any("wrong sign" in text for text in look.problems) == (sense < 0.0)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_each_motor_of_a_coaxial_turns_and_lifts(sense: float) -> None:
    """The other motor is held still: both move in each sweep, and each has two motions."""
    climb, turn = sweep(1), np.roll(sweep(2)[::-1], 7)
    lower, upper = 0.5 + climb - turn, 0.5 + climb + turn
    r = lagged(upper - lower, 30.0 * sense)
    look = sp.inspect(flown(motor_lower=lower, motor_upper=upper, r=r, az=accelerated(lower + upper, -40.0)))
    told = {line.partition(":")[0]: line for line in look.signs}
    assert "negative, as its name says" in told["motor_upper to az"]
    assert "negative, as its name says" in told["motor_lower to az"]
    for motor in ("motor_upper", "motor_lower"):
        assert "as its name says" in told[f"{motor} to r"]
        assert ("NOT" in told[f"{motor} to r"]) == (sense < 0.0)


def test_a_controllers_answer_has_none() -> None:
    """A loop in gusts: the command is minus the controller times the rate."""
    gust = np.random.default_rng(4).standard_normal(TIME.size)
    p, u = np.zeros(TIME.size), np.zeros(TIME.size)
    for k in range(1, TIME.size):
        u[k] = -0.1 * p[k - 1] - 0.05 * (p[k - 1] - p[max(k - 2, 0)])
        p[k] = p[k - 1] + (40.0 * u[k - 1] - 2.0 * p[k - 1] + 5.0 * gust[k]) / RATE
    look = sp.inspect(flown(mixer_roll=u, p=p))
    assert "mixer_roll to p: not told" in look.signs[0]
    assert not any("sign" in text for text in look.problems)


@pytest.mark.parametrize("n", [2, 3, 8, 31])
def test_a_record_of_a_few_samples_tells_none(n: int) -> None:
    flight = Flight({"log": stream(TIME[:n], {"mixer_roll": sweep()[:n], "p": sweep(3)[:n]})})
    assert sp.inspect(flight).signs == ("mixer_roll to p: not told, the record is too short",)


def test_a_log_without_commands_shows_nothing_of_it() -> None:
    assert "signs from commands" not in str(sp.inspect(flown(p=sweep())))


def test_a_stick_that_is_positive_to_the_left_is_seen_by_inspect(shared_data: Path) -> None:
    file = shared_data / "field" / "flug1_roll.csv"
    for factor in (1.0, -1.0):
        columns = {"p": {"column": "Rollrate"}, "mixer_roll": {"column": "Querruder", "factor": factor}}
        look = sp.inspect(sp.read(file, mapping={"channels": columns}))
        assert any("wrong sign" in text for text in look.problems) == (factor > 0.0)


def test_signs_of_real_firmware(shared_data: Path) -> None:
    look = sp.inspect(sp.read(shared_data / "ardupilot_firmware" / "raptor50_three_sweeps.BIN"))
    for pair in ("mixer_roll to p", "mixer_pitch to q", "mixer_yaw to r"):
        assert any(line.startswith(f"{pair}: positive, as its name says") for line in look.signs)
    assert any(line.startswith("mixer_collective to az: not told") for line in look.signs)
