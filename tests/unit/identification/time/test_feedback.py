"""Is a command a controller's answer? Loops made by hand whose answer is known, and real flights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, chirp, lfilter

from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.feedback import ANSWER
from swashplate.flights.readers.read import read
from swashplate.identification.core.records import POSE, Record, records
from swashplate.identification.time.feedback import EXPLAINED, UNMOVED, AxisExcitation, excitation, mark_unmoved
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.catalogue import vehicle

COAX = vehicle("coax")
RATE, SECONDS = 100.0, 30.0
N = round(RATE * SECONDS)


def _smooth(rng: np.random.Generator, *, corner: float = 3.0) -> np.ndarray:
    """Noise up to a corner [Hz], of unit scatter."""
    b, a = butter(2, corner, fs=RATE)
    noise = lfilter(b, a, rng.standard_normal(N + 500))[500:]
    return np.asarray(noise / noise.std())


def _double_integrator(push: np.ndarray, *, gain: float, rate_gain: float, added: np.ndarray) -> tuple[np.ndarray, ...]:
    """Angle, rate and command of an angle that gusts push and a controller with feedback of angle and rate holds."""
    angle, rate, command = np.zeros(N), np.zeros(N), np.zeros(N)
    for k in range(N):
        command[k] = -gain * angle[k] - rate_gain * rate[k] + added[k]
        if k + 1 < N:
            rate[k + 1] = rate[k] + (20.0 * command[k] + push[k]) / RATE
            angle[k + 1] = angle[k] + rate[k + 1] / RATE
    return angle, rate, command


def _judged(angle: np.ndarray, rate: np.ndarray, command: np.ndarray, *, axis: str = "roll") -> AxisExcitation:
    """The verdict on one axis of a record that moves in that axis only; the others get noise of their own."""
    rng = np.random.default_rng(99)
    states = np.stack([1e-3 * _smooth(rng) for _ in PREDICTED], axis=1)
    angle_name, rate_name, command_name = {
        "roll": ("phi", "p", "servo_roll"),
        "pitch": ("theta", "q", "servo_pitch"),
        "yaw": ("psi", "r", "motor_upper"),
        "heave": ("z", "w", "motor_upper"),
    }[axis]
    states[:, PREDICTED.index(angle_name)] = angle
    states[:, PREDICTED.index(rate_name)] = rate
    inputs = np.zeros((N, 4))
    inputs[:, COAX.input_names.index(command_name)] = command
    time = np.arange(N) / RATE
    record = Record("made", time, inputs, np.zeros((N, 6)), np.full(N, 12.0), POSE, True)
    return next(item for item in excitation(COAX, record, states) if item.axis == axis)


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw", "heave"])
def test_a_controllers_answer_is_not_an_excitation(axis: str) -> None:
    gusts = 3.0 * _smooth(np.random.default_rng(1))
    found = _judged(*_double_integrator(gusts, gain=1.5, rate_gain=0.4, added=np.zeros(N)), axis=axis)
    assert found.explained > 0.999
    assert not found.identifiable
    assert found.coherence > 0.99
    assert "cannot tell" in found.words
    assert f"multisine to the {axis} reference" in found.words


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw", "heave"])
def test_an_excitation_on_top_of_the_loop_is_seen(axis: str) -> None:
    rng = np.random.default_rng(2)
    gusts, added = 3.0 * _smooth(rng), 0.2 * _smooth(rng, corner=6.0)
    found = _judged(*_double_integrator(gusts, gain=1.5, rate_gain=0.4, added=added), axis=axis)
    assert found.identifiable
    assert found.explained < 0.9
    assert "moves the axis independently" in found.words


def test_an_open_loop_input_is_not_called_an_answer() -> None:
    """Without gusts a simulated motion tells the command wholly, the one that follows it best."""
    rng = np.random.default_rng(3)
    angle, rate, command = _double_integrator(np.zeros(N), gain=0.0, rate_gain=0.0, added=0.1 * rng.standard_normal(N))
    found = _judged(angle, rate, command)
    assert found.identifiable
    assert not found.answer


def test_a_slow_sweep_is_not_called_an_answer_though_it_can_be_predicted() -> None:
    time = np.arange(N) / RATE
    sweep = 0.1 * chirp(time, 0.5, SECONDS, 8.0, phi=-90)
    noise = np.random.default_rng(10).standard_normal((2, N))
    angle, rate, command = _double_integrator(np.zeros(N), gain=0.0, rate_gain=0.0, added=sweep)
    found = _judged(angle + 1e-4 * noise[0], rate + 1e-3 * noise[1], command)
    assert found.explained > ANSWER
    assert found.identifiable
    assert not found.answer
    assert found.words.endswith("the motion after it explains more: the motion follows the command.")


def test_independent_noise_has_nothing_to_do_with_the_motion() -> None:
    rng = np.random.default_rng(4)
    found = _judged(0.05 * _smooth(rng), 0.1 * _smooth(rng), 0.1 * _smooth(rng))
    assert found.identifiable
    assert found.explained < 0.5
    assert found.coherence < 0.8


def test_a_weak_excitation_is_called_weak() -> None:
    """A tenth of the command's scatter is its own: 1 % of its variance would be too little, this is between."""
    rng = np.random.default_rng(5)
    gusts = 3.0 * _smooth(rng)
    angle, rate, command = _double_integrator(gusts, gain=1.5, rate_gain=0.4, added=np.zeros(N))
    weak = command + 0.2 * command.std() * _smooth(rng, corner=6.0)
    found = _judged(angle, rate, weak)
    assert 0.9 < found.explained < EXPLAINED
    assert found.identifiable
    assert "weakly excited" in found.words


def test_a_command_that_stands_still_says_what_to_fly() -> None:
    rng = np.random.default_rng(6)
    found = _judged(0.05 * _smooth(rng), 0.1 * _smooth(rng), np.full(N, 0.25))
    assert not found.identifiable
    assert (found.power, found.coherence) == (pytest.approx(0.0, abs=1e-9), 0.0)
    assert np.isnan(found.explained)
    assert found.words == "roll: the command does not move. Fly a sweep or a multisine in roll."


def test_the_phase_is_that_of_motion_over_command() -> None:
    """A pure angle command of a rate: rate leads by what the controller's inverse says (here 180 degrees)."""
    rng = np.random.default_rng(7)
    rate = 0.3 * _smooth(rng)
    found = _judged(np.cumsum(rate) / RATE, rate, -0.4 * rate)
    assert abs(np.degrees(found.phase)) == pytest.approx(180.0, abs=1.0)
    assert not found.identifiable


def test_a_place_held_in_the_room_is_a_controllers_answer_whatever_the_heading() -> None:
    """Feedback of the distance to the right of the nose, while the nose turns: heading axes are looked at."""
    rng = np.random.default_rng(8)
    time = np.arange(N) / RATE
    states = np.stack([1e-3 * _smooth(rng) for _ in PREDICTED], axis=1)
    x, y, psi = _smooth(rng, corner=0.5), _smooth(rng, corner=0.5), 1.0 * time
    for name, values in (("x", x), ("y", y), ("psi", psi)):
        states[:, PREDICTED.index(name)] = values
    inputs = np.zeros((N, 4))
    inputs[:, COAX.input_names.index("servo_roll")] = -0.3 * (-np.sin(psi) * x + np.cos(psi) * y)
    record = Record("made", time, inputs, np.zeros((N, 6)), np.full(N, 12.0), POSE, True)
    found = {item.axis: item for item in excitation(COAX, record, states)}
    assert found["roll"].explained > 0.99
    assert not found["roll"].identifiable


def test_every_axis_is_judged_and_knows_its_command() -> None:
    rng = np.random.default_rng(9)
    inputs = 0.1 * np.stack([_smooth(rng) for _ in range(4)], axis=1)
    states = np.stack([_smooth(rng) for _ in PREDICTED], axis=1)
    record = Record("made", np.arange(N) / RATE, inputs, np.zeros((N, 6)), np.full(N, 12.0), POSE, True)
    found = excitation(COAX, record, states)
    assert [(item.axis, item.command) for item in found] == [
        ("roll", "servo_roll"),
        ("pitch", "servo_pitch"),
        ("yaw", "motor_upper - motor_lower"),
        ("heave", "motor_upper + motor_lower"),
    ]
    assert all(item.record == "made" and item.identifiable for item in found)
    for flown in (COAX, vehicle("raptor50")):
        assert [axis.name for axis in flown.traits.axes] == ["roll", "pitch", "yaw", "heave"]
        assert all(set(axis.parameters) <= set(flown.parameter_names) for axis in flown.traits.axes)
        assert all(set(axis.inputs) <= set(flown.input_names) for axis in flown.traits.axes)


def test_the_july_flight_shows_a_yaw_controller(flight_july: Path) -> None:
    """The controller's phase and a coherence of 0.99 between motor difference and yaw rate: nothing of the aircraft."""
    (record, *_) = records(read(flight_july).condition(rate=100.0, cutoff=0.0), COAX)
    found = {item.axis: item for item in excitation(COAX, record, measured_states(record, Nuisance()))}
    assert found["yaw"].coherence > 0.95
    assert found["yaw"].explained > 0.9
    assert abs(np.degrees(found["yaw"].phase)) > 90.0


def test_an_identified_card_names_the_axes_that_were_fitted_though_nothing_moved_them() -> None:
    own = {axis.name: axis.parameters for axis in COAX.traits.axes if axis.parameters}
    free = [names[0] for names in own.values()]
    assert "yaw" in own

    def judged(axis: str, *, moved: bool) -> AxisExcitation:
        return AxisExcitation("made", axis, "", 0.5, 0.5, 0.0, 1.0, moved, "", 0.5)

    def marked(*told: AxisExcitation) -> dict[str, float]:
        return dict(mark_unmoved(COAX, free, told).card.observer.get(UNMOVED, {}))

    others = [judged(name, moved=True) for name in own if name != "yaw"]
    assert marked(*others, judged("yaw", moved=False)) == {"yaw": 1.0}
    assert marked(*others, judged("yaw", moved=True)) == {}
    assert marked(*others, judged("yaw", moved=False), judged("yaw", moved=True)) == {}, (
        "one flight that moves it will do"
    )
    assert marked() == {}, "what was not judged is not called unmoved"
    held = mark_unmoved(COAX, [], (*others, judged("yaw", moved=False)))
    assert UNMOVED not in held.card.observer, "held, its numbers are the card's"
