"""The chain, its history and replay; ground and crash."""

import json
from dataclasses import replace

import numpy as np
import pytest

from conditioning_flights import Array, Motion, hover, sweep, tracked
from swashplate.errors import FlightError
from swashplate.flights.conditioning.condition import condition, replay
from swashplate.flights.conditioning.ground import GroundRule, flying_interval
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import ProcessingStep
from swashplate.reporting.words import step_words


def test_the_history_is_enough_to_do_it_again() -> None:
    raw = sweep(20.0, 1)
    out = raw.condition(rate=80.0, cutoff=12.0, max_gap=0.05)
    assert [step.operation for step in out.history] == [
        "remove_outliers",
        "trim_ground",
        "resample",
        "lowpass",
        "derive",
    ]
    stored = tuple(
        ProcessingStep(s["operation"], s["details"]) for s in json.loads(json.dumps([vars(s) for s in out.history]))
    )
    again = replay(raw, stored)
    assert again.history == out.history
    assert again.segments == out.segments
    for name in out.channels:
        np.testing.assert_array_equal(again.values(name), out.values(name))


def test_replay_refuses_what_it_does_not_know() -> None:
    raw = sweep(5.0, 1)
    with pytest.raises(FlightError, match="step 'paint'"):
        replay(raw, [ProcessingStep("paint", {})])
    with pytest.raises(FlightError, match="another flight"):
        replay(raw.done("read"), [ProcessingStep("resample", {"rate": 50.0})])


def test_switches_switch() -> None:
    raw = sweep(10.0, 2)
    out = condition(raw, cutoff=0.0, outliers=False, trim_ground=False, derive=False)
    assert [step.operation for step in out.history] == ["resample"]
    assert "u" not in out


def test_the_default_filter_reaches_the_inputs() -> None:
    raw = sweep(10.0, 2)
    quiet = condition(raw, cutoff=15.0).values("motor_lower")
    loud = condition(raw, cutoff=0.0).values("motor_lower")
    assert np.std(np.diff(quiet, 2)) < 0.5 * np.std(np.diff(loud, 2))


def test_nothing_to_condition_is_an_error() -> None:
    with pytest.raises(FlightError, match="no channels"):
        condition(Flight({}))
    with pytest.raises(FlightError, match=r"x: .*1 sample"):
        condition(Flight({"a": stream([0.0], {"x": [1.0]})}))
    backwards = stream([0.0, 1.0, 2.0], {"x": [1.0, 2.0, 3.0]}).assign_coords(time=[0.0, 2.0, 1.0])
    with pytest.raises(FlightError, match=r"time: .*do not increase at sample 2"):
        condition(Flight({"a": backwards}))


def crashing(duration: float, lost_at: float) -> Flight:
    """Hover that starts to spin at a time and rolls over a second later."""
    motion = hover(duration, 5, tilt=0.03)
    after = np.maximum(0.0, motion.time - lost_at)
    euler = motion.euler + np.stack([np.maximum(0, after - 1) * 6.0, 0 * after, 2.5 * after**2], axis=-1)
    return tracked(Motion(motion.time, euler, motion.position), 5)


def test_a_crash_is_cut_before_control_is_lost() -> None:
    found = flying_interval(crashing(22.0, 18.0))
    yaw_rate = np.gradient(hover(22.0, 5, tilt=0.03).euler[:, 2], 1e-3)
    seen_at = 18.0 + GroundRule().envelope * yaw_rate.std() / 5.0  # the spin grows by 5 rad/s^2
    assert found.start == pytest.approx(0.01, abs=0.02)
    assert 17.5 < found.stop < seen_at
    assert "crash" in found.reasons[0]


def test_a_healthy_flight_is_kept_whole() -> None:
    raw = tracked(hover(20.0, 6), 6)
    found = flying_interval(raw)
    assert (found.start, found.stop) == (raw.start, raw.stop)


def test_waiting_on_the_ground_is_cut_but_a_steady_hover_is_not() -> None:
    raw = tracked(hover(20.0, 7), 7, noise=0.1)
    motion = raw.streams["motion"].copy(deep=True)
    t = motion["time"].values
    still = t < 4.0
    for name in ("x", "y", "z", "qw", "qx", "qy", "qz"):
        motion[name].values[still] = motion[name].values[np.argmax(~still)]
    idle = np.where(still, 0.1, 0.55)
    ground = raw.with_streams({"motion": motion, "inputs": stream(t, {"motor_lower": idle, "motor_upper": idle})})
    assert 3.5 < flying_interval(ground).start < 4.3
    steady = np.full(t.size, 0.55)
    hovering = replace(ground, streams={**ground.streams, "inputs": stream(t, {"motor_lower": steady})})
    assert flying_interval(hovering).start == hovering.start


def taken_off_and_landed(duration: float = 40.0) -> tuple[Motion, Array, Array]:
    """Rests until 6 s, its motors speeding up at 4 s; climbs 1 m in 3 s, hovers, lands the same way; motors by time."""
    motion = hover(duration, 9, tilt=0.03)
    t, end = motion.time, duration - 6.0
    up = np.clip((t - 6.0) / 3.0, 0.0, 1.0) * np.clip((end - t) / 3.0, 0.0, 1.0)
    flying = np.minimum(1.0, 20.0 * up)[:, None]
    position = motion.position * flying
    position[:, 2] -= up
    motors = np.where((t > 4.0) & (t < end + 1.0), 0.55, 0.1)
    return Motion(t, motion.euler * flying, position), t, motors


def with_motors(motion: Motion, t: Array, motors: Array) -> Flight:
    raw = tracked(motion, 9, noise=0.1)
    stamps = raw.time("x")
    inputs = stream(stamps, {"motor_lower": motors[np.searchsorted(t, stamps)]})
    return raw.with_streams({**raw.streams, "inputs": inputs})


def test_take_off_and_landing_are_cut_where_the_skids_are_free() -> None:
    found = flying_interval(with_motors(*taken_off_and_landed()))
    clear = 6.0 + 3.0 * GroundRule().clear  # it climbs at 1/3 m/s
    assert found.start == pytest.approx(clear, abs=0.15)
    assert found.stop == pytest.approx(40.0 - clear, abs=0.15)
    assert [text.split()[3] for text in found.reasons] == ["until", "from"]


def test_a_flight_that_stays_low_is_kept_from_the_end_of_its_rest() -> None:
    motion, t, motors = taken_off_and_landed()
    low = motion.position * [1.0, 1.0, 0.2]
    found = flying_interval(with_motors(Motion(t, motion.euler, low), t, motors))
    assert 5.8 < found.start < 6.5
    assert 33.5 < found.stop < 34.2


def test_carried_about_before_and_flown_twice_the_longest_flight_is_kept() -> None:
    motion, t, motors = taken_off_and_landed()
    euler = motion.euler.copy()
    euler[:, 0] += 1.2 * np.clip(3.0 - t, 0.0, 1.0)  # turned on its side by hand before it is set down
    again = motors.copy()
    again[(t > 14.0) & (t < 16.0)] = 0.1
    found = flying_interval(with_motors(Motion(t, euler, motion.position), t, again))
    assert 16.0 <= found.start < 16.2
    assert found.stop == pytest.approx(40.0 - 6.0 - 3.0 * GroundRule().clear, abs=0.15)


def test_a_hand_that_holds_it_is_seen() -> None:
    motion = hover(30.0, 8, tilt=0.03)
    held = motion.time > 22.0
    euler, position = motion.euler.copy(), motion.position.copy()
    euler[held] = 0.1 * euler[held] + [0.08, -0.1, 0.0]  # tilted for good, and yet it goes nowhere
    position[held] = position[held][0]
    found = flying_interval(tracked(Motion(motion.time, euler, position), 8))
    assert 20.5 < found.stop < 22.5
    assert "held" in found.reasons[-1]


def test_gravity_is_the_flights_own_and_said_where_it_is_assumed() -> None:
    """On Mars a rotorcraft that hovers feels 3.71 m/s^2; a log that does not say it was taken to be on Earth."""
    time = np.arange(300) / 100.0
    still = {name: np.zeros(300) for name in ("x", "y", "z", "phi", "theta", "psi")}
    log = Flight.from_arrays(time, still)
    mars = log.done("simulate", gravity=3.71)
    assert (log.gravity, mars.gravity) == (None, 3.71)
    for flight, felt, assumed in ((log, -9.80665, True), (mars, -3.71, False)):
        found = flight.condition(trim_ground=False)
        np.testing.assert_allclose(found.values("az"), felt, rtol=1e-9)
        (step,) = (each for each in found.history if each.operation == "derive")
        assert step.details["assumed"] is assumed
        assert found.gravity == -felt
        assert ("the log does not say it" in step_words(step)) is assumed
