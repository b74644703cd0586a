"""Jumps that no motion explains are counted; steps, touch-downs, slow logs and wraps of angles are motion."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from swashplate.flights.flight import Flight, stream
from swashplate.flights.jumps import attitudes, jumps
from swashplate.flights.provenance import Event

N, RATE = 1000, 100.0
TIME = np.arange(N) / RATE
INERTIAL = ("p", "q", "r", "ax", "ay", "az")


def noise(seed: int, size: float = 0.01) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal(N)


def flight(**channels: np.ndarray) -> Flight:
    return Flight({"log": stream(TIME, channels)})


def shaken(*names: str, at: int = 500) -> dict[str, np.ndarray]:
    """Six inertial channels in noise, some of which have a spike of one sample."""
    made = {name: noise(k) for k, name in enumerate(INERTIAL)}
    for name in names:
        made[name][at] += 3.0
    return made


def test_a_spike_of_one_sensor_is_told_and_a_shock_that_several_feel_is_not() -> None:
    assert jumps(flight(**shaken())) == {}
    assert jumps(flight(**shaken("az"))) == {"az": 2}
    assert jumps(flight(**shaken("az", "ax"))) == {"ax": 2, "az": 2}
    assert jumps(flight(**shaken("az", "ax", "q"))) == {}
    apart = shaken("az") | {"q": shaken("q", at=300)["q"], "ax": shaken("ax", at=700)["ax"]}
    assert jumps(flight(**apart)) == {"q": 2, "ax": 2, "az": 2}


def test_what_two_sensors_feel_alike_is_true_and_a_second_message_of_one_is_no_witness() -> None:
    alone = shaken("az")
    assert jumps(flight(**alone, az_imu2=noise(9))) == {"az": 2}
    assert jumps(flight(**alone, az_imu2=noise(9) + alone["az"])) == {}
    assert jumps(flight(**alone, az_imu=noise(9) + alone["az"])) == {"az": 2, "az_imu": 2}


def test_a_command_may_step_and_kick_when_the_aircraft_does_and_not_alone() -> None:
    stepped, kicked = noise(11), noise(12)
    stepped[500:] += 0.5
    kicked[500] += 0.5
    assert jumps(flight(mixer_roll=stepped, p_demand=stepped)) == {}
    assert jumps(flight(mixer_roll=kicked)) == {"mixer_roll": 2}
    assert jumps(flight(mixer_roll=kicked, **shaken("p", "q", "r"))) == {}


@pytest.mark.parametrize("name", ["mixer_roll", "p_demand", "pid_f_roll"])
def test_a_slow_log_tells_the_kick_of_another_mode_s_loop_from_others(name: str) -> None:
    """At 10 Hz: ArduPilot's LOITER takes over with a demand of 0.27 rad/s, taken back 0.3 s later."""
    time, kicked = np.arange(600) / 10.0, 1e-3 * np.random.default_rng(3).standard_normal(600)
    kicked[300:302] += [0.045, 0.02]
    log = Flight({"rates": stream(time, {name: kicked})})
    assert jumps(log) == {name: 2}
    switched = replace(log.provenance, events=(Event(time[300] - 0.098, "mode", "LOITER"),))
    assert jumps(replace(log, provenance=switched)) == {}
    early = replace(log.provenance, events=(Event(time[300] - 0.5, "mode", "LOITER"),))
    assert jumps(replace(log, provenance=early)) == {name: 2}


@pytest.mark.parametrize("name", ["x", "z", "vx", "w"])
def test_a_place_and_a_velocity_cannot_step_but_what_is_not_known_may(name: str) -> None:
    stepped = np.sin(TIME) + noise(1, 1e-3)
    stepped[500:] += 5.0
    assert jumps(flight(**{name: stepped, "gauge": stepped})) == {name: 1}


def test_motion_through_a_gap_is_no_jump() -> None:
    time = np.concatenate([TIME[:500], TIME[500:] + 0.3])
    fast = 4.0 * time + noise(1, 1e-3)
    assert jumps(Flight({"log": stream(time, {"x": fast})})) == {}
    fast[500:] += 40.0
    assert jumps(Flight({"log": stream(time, {"x": fast})})) == {"x": 1}


def test_steps_in_a_slow_log_are_motion_in_every_channel() -> None:
    """Attitude steps of 8 degrees over 0.3 s at 10 Hz in an otherwise quiet hover."""
    slow = np.arange(1200) / 10.0
    rng = np.random.default_rng(3)
    phi = np.radians(4.0) * (np.tanh((slow - 60.0) / 0.12) - np.tanh((slow - 63.0) / 0.12))
    phi += 1e-4 * rng.standard_normal(slow.size)
    p = np.gradient(phi, slow)
    angles = {"phi": phi, "theta": 1e-4 * rng.standard_normal(slow.size), "psi": 0.0 * slow}
    assert jumps(Flight({"log": stream(slow, {**angles, "p": p, "mixer_roll": 0.3 * np.gradient(p, slow)})})) == {}


def test_an_attitude_is_judged_by_its_rotation() -> None:
    turning = np.remainder(0.5 * TIME + 2.9 + np.pi, 2.0 * np.pi) - np.pi
    angles = {"phi": noise(1, 1e-3), "theta": 1.5 + noise(2, 1e-3), "psi": turning}
    whole = flight(**angles)
    assert np.ptp(turning) > 6.0
    assert list(attitudes(whole)) == ["angles"]
    assert jumps(whole) == {}
    angles["phi"][500:] += 0.4
    assert jumps(flight(**angles)) == {"angles": 1}
    assert jumps(flight(psi=angles["psi"], phi=angles["phi"])) == {"phi": 1}


def test_what_a_slow_clock_holds_is_no_jump() -> None:
    sag = np.repeat(3.9 + np.where(np.arange(N // 10) > 30, -0.5, 0.0), 10) + np.repeat(noise(5, 2e-3)[: N // 10], 10)
    assert jumps(flight(voltage=sag)) == {}


def test_the_changes_of_one_channel_are_held_at_a_time() -> None:
    def peak(count: int) -> int:
        many = flight(**{f"rcin_{k}": np.sin(TIME + k) for k in range(1, count + 1)})
        tracemalloc.start()
        jumps(many)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(2)  # what is imported on the way
    assert peak(16) < 1.5 * peak(4), "a log of 1 GB has no room for the changes of all"
