"""Several sweeps in one log and one input named: whose they are, what is held still, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights.channel_names import with_names
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.ardupilot_chirp import MOVED, Chirp
from swashplate.flights.provenance import Event, Provenance
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.responses.respond import respond

RATE = 50.0
AXES = ("roll", "pitch", "yaw")
RATES = ("p", "q", "r")
EFFECT = np.array([[2.0, 0.9, 0.2], [-0.8, 3.0, -0.3], [0.1, -0.2, 2.5]])
DAMPING = np.array([2.0, 1.5, 1.0])
GAINS = np.array([[1.0, 0.3, 0.0], [-0.2, 0.8, 0.0], [0.1, 0.0, 0.7]])
LENGTH = 40.0  # s, of a sweep; they begin every 45 s
HIGH = 4.0  # Hz: end of the sweeps and of what is asked
BAND = (0.25, HIGH)


def chirp(axis: int, *, high: float = HIGH) -> Chirp:
    return Chirp(axis, 0.1, 0.2, high, LENGTH, 4.0, 2.0, 8.0)


def flown(sweeps: Mapping[int, Chirp], *, gust: float = 0.02, seed: int = 1, told: bool = True) -> Flight:
    """Three axes that mix, y' = -a y + B u, under a loop that mixes them too, u = r - K y; r at each axis in turn.

    Args:
        sweeps: by the place of the axis, one after the other. told: whether the log says so.
    """
    time = np.arange(round((45.0 * len(sweeps) + 4.0) * RATE)) / RATE
    r = np.zeros((time.size, 3))
    events = []
    for k, (axis, one) in enumerate(sweeps.items()):
        start = 2.0 + 45.0 * k
        r[:, axis] += one.signal(time - start)
        details = {**one.as_details(), "start": start, "stop": start + LENGTH, "seen": start + LENGTH}
        name = one.axis_name
        events.append(Event(start, "sweep", f"{name}, {one.start_hz:g} Hz", {**details, "channel": MOVED[one.axis]}))
    disturbance = gust * np.random.default_rng(seed).standard_normal((time.size, 3))
    keep, push = np.exp(-DAMPING / RATE), (1.0 - np.exp(-DAMPING / RATE)) / DAMPING
    y, u = np.zeros((time.size, 3)), np.zeros((time.size, 3))
    for k in range(time.size):
        if k:
            y[k] = keep * y[k - 1] + push * (EFFECT @ u[k - 1] + disturbance[k - 1])
        u[k] = r[k] - GAINS @ y[k]
    columns = {f"mixer_{name}": u[:, k] for k, name in enumerate(AXES)}
    columns |= {f"pid_{name}": (u - r)[:, k] for k, name in enumerate(AXES)}
    columns |= {name: y[:, k] for k, name in enumerate(RATES)}
    columns["sid_target"] = r.sum(axis=1)
    units = dict.fromkeys([*(f"mixer_{name}" for name in AXES), "sid_target"], "1")
    return Flight(
        {"uniform": stream(time, columns, units)}, Provenance(source="log", events=tuple(events) if told else ())
    )


def truth(omega: np.ndarray) -> np.ndarray:
    """Of the rates to the commands, shape (n, 3, 3)."""
    keep, push = np.exp(-DAMPING / RATE), (1.0 - np.exp(-DAMPING / RATE)) / DAMPING
    z = np.exp(1j * omega / RATE)
    return np.asarray(push[None, :, None] * EFFECT / (z[:, None, None] - keep[None, :, None]))


def asked(log: Flight | list[Flight], axis: str, output: str, **how: Any) -> FrequencyResponse:
    return respond(log, inputs=[f"mixer_{axis}"], outputs=[output], band=BAND, lines=30, **how)


def is_right(found: FrequencyResponse, axis: str, output: str, *, share: float = 0.98) -> bool:
    """Nearly everywhere within three errors (of each part), or 0.2 dB and 1.3 degrees, of the aircraft's response."""
    h, coherence, error = found.pair(output, f"mixer_{axis}")
    used = np.isfinite(h) & (coherence >= 0.6)
    exact = truth(found.omega)[:, RATES.index(output), AXES.index(axis)]
    near = np.abs(h / exact - 1.0)[used] <= np.maximum(3.0 * np.sqrt(2.0) * error[used], 0.023)
    return bool(used.mean() > 0.7 and near.mean() >= share)


ALL = {0: chirp(10), 1: chirp(11), 2: chirp(12)}


@pytest.fixture(scope="module")
def log() -> Flight:
    """Roll, pitch and yaw are swept at the mixer, one after the other."""
    return flown(ALL)


@pytest.mark.parametrize("references", [[], ["sid_target"]])
@pytest.mark.parametrize("axis", AXES)
def test_one_input_of_three_that_were_swept_is_right(log: Flight, axis: str, references: list[str]) -> None:
    output = RATES[AXES.index(axis)]
    found = asked(log, axis, output, references=references)
    assert is_right(found, axis, output)
    assert found.inputs == (f"mixer_{axis}",)
    others = [f"mixer_{name}" for name in sorted(AXES) if name != axis]
    assert found.settings["beside"] == others
    assert all(any(f"'{name}' was swept too" in text for text in found.warnings) for name in others)
    assert not any("feedback biases" in text for text in found.warnings)
    assert not found.problems


def test_it_is_the_response_that_all_inputs_named_give(log: Flight) -> None:
    inputs = [f"mixer_{name}" for name in AXES]
    whole = respond(log, inputs=inputs, outputs=["p"], band=BAND, lines=30)
    alone = asked(log, "roll", "p")
    got, wanted = alone.pair("p", "mixer_roll")[0], whole.pair("p", "mixer_roll")[0]
    upper = alone.omega > TWO_PI * 0.5  # where every sweep leads
    np.testing.assert_allclose(got[upper], wanted[upper], rtol=1e-9)


def test_the_sweeps_of_all_axes_as_one_reference_would_be_wrong(log: Flight) -> None:
    """The trap is there: without knowing whose each sweep is, the response is off by more than its errors."""
    plain = replace(log, provenance=replace(log.provenance, events=()))
    assert not is_right(asked(plain, "roll", "p", references=["sid_target"]), "roll", "p")


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_sweeps_that_are_only_seen_are_told_apart_too(axis: str) -> None:
    output = RATES[AXES.index(axis)]
    found = asked(flown({0: chirp(10), 1: chirp(11)}, told=False), axis, output)
    assert found.method == "along sweeps"
    assert [text.partition(":")[0] for text in found.settings["sweeps"]] == ["mixer_roll", "mixer_pitch"]
    assert is_right(found, axis, output)


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_one_log_per_axis_with_a_recorded_reference_in_each(axis: str) -> None:
    """Nothing says which axis a log sweeps; the commands do."""
    logs = [flown({k: ALL[k]}, seed=5 + k, told=False) for k in (0, 1)]
    logs = [replace(one, provenance=Provenance(source=f"log{k}")) for k, one in enumerate(logs)]
    output = RATES[AXES.index(axis)]
    found = asked(logs, axis, output, references=["sid_target"])
    assert found.settings["beside"] == [f"mixer_{'pitch' if axis == 'roll' else 'roll'}"]
    assert is_right(found, axis, output)


def test_a_renamed_input_keeps_its_sweep(log: Flight) -> None:
    named = with_names(log, {"lateral": "mixer_roll"})
    found = respond(named, inputs=["lateral"], outputs=["p"], band=BAND, lines=30)
    assert set(found.settings["beside"]) == {"mixer_pitch", "mixer_yaw"}
    assert found.settings["sweeps"][0].startswith("lateral: 2.0 to 42.0 s")


@pytest.mark.parametrize("references", [[], ["sid_target"]])
def test_a_loop_broken_at_an_input_has_the_others_closed(log: Flight, references: list[str]) -> None:
    """pid_roll / mixer_roll is -(K G) with the pitch and yaw loops closed, whatever else was swept in the log."""
    found = asked(log, "roll", "pid_roll", references=references)
    h, coherence, error = found.pair("pid_roll", "mixer_roll")
    g = truth(found.omega)
    loop = GAINS @ g
    rest = np.linalg.solve(np.eye(2) + loop[:, 1:, 1:], loop[:, 1:, :1])
    closed = -(loop[:, :1, :1] - loop[:, :1, 1:] @ rest)[:, 0, 0]
    held = -loop[:, 0, 0]
    used = np.isfinite(h) & (coherence >= 0.6)
    allowed = np.maximum(3.0 * error[used], 0.03)
    assert used.mean() > 0.7
    assert (np.abs(h / closed - 1.0)[used] <= allowed).mean() > 0.97
    assert (np.abs(h / held - 1.0)[used] <= allowed).mean() < 0.9
    assert any(text.startswith("pid_roll: what the input is made of") for text in found.warnings)


def test_an_axis_that_no_sweep_moved_is_refused(log: Flight) -> None:
    two = flown({0: chirp(10), 1: chirp(11)})
    for how in ({"references": ["sid_target"]}, {}):
        with pytest.raises(
            FlightError, match=r"mixer_yaw: moved by no sweep; the log's are of roll mixer .* pitch mixer"
        ):
            asked(two, "yaw", "pid_yaw", **how)
    # As it is, it is said; that the loop is no other signal than the command is found even so.
    direct = asked(two, "yaw", "r", direct=True)
    assert any("mixer_yaw: moved by no sweep" in text for text in direct.warnings)
    copied = asked(two, "yaw", "pid_yaw", direct=True)
    assert np.isnan(copied.response).all()
    assert any("'pid_yaw' is a copy of 'mixer_yaw'" in text for text in copied.problems)
    assert not asked(log, "yaw", "pid_yaw").problems  # where it was swept, it is none


def test_an_axis_that_no_sweep_moved_does_not_take_the_others_with_it() -> None:
    two = flown({0: chirp(10), 1: chirp(11)})
    found = respond(two, inputs=["mixer_roll", "mixer_yaw"], outputs=["p", "r"], band=BAND, lines=30)
    assert np.isnan(found.response[:, :, 1]).all()
    assert is_right(found, "roll", "p", share=0.9)
    assert any("mixer_yaw: moved by no sweep" in text for text in found.warnings)
    assert not found.problems


def test_what_sweeps_of_several_axes_move_alike_is_refused(log: Flight) -> None:
    with pytest.raises(FlightError, match=r"sid_target: was moved alike by sweeps of several axes"):
        respond(log, inputs=["sid_target"], outputs=["p"], band=BAND)
    alone = respond(log.between(1.0, 44.0), inputs=["sid_target"], outputs=["p"], band=BAND)
    assert alone.band("p", "sid_target") is not None


def test_where_another_sweep_does_not_reach_the_response_is_that_with_its_loop_closed() -> None:
    """Pitch is swept to 1 Hz only: above, it answers roll, and cannot be told from it."""
    found = asked(flown({0: chirp(10), 1: chirp(11, high=1.0)}, gust=0.002), "roll", "p")
    h = found.pair("p", "mixer_roll")[0]
    hertz = found.omega / TWO_PI
    assert np.isfinite(h[hertz > 0.3]).all()
    g = truth(found.omega)
    held = g[:, 0, 0]
    loop = GAINS @ g
    rest = np.linalg.solve(np.eye(2) + loop[:, 1:, 1:], loop[:, 1:, :1])
    closed = (g[:, :1, :1] - g[:, :1, 1:] @ rest)[:, 0, 0]
    below, above = (hertz > 0.3) & (hertz < 0.8), hertz > 1.5
    assert np.median(np.abs(h / held - 1.0)[below]) < 0.02 < 0.06 < np.median(np.abs(h / closed - 1.0)[below])
    assert np.median(np.abs(h / closed - 1.0)[above]) < 0.01 < 0.02 < np.median(np.abs(h / held - 1.0)[above])
    (text,) = (text for text in found.warnings if "'mixer_pitch' was swept too" in text)
    assert "Elsewhere its loop moves it along" in text


def test_a_reference_beside_the_injected_one_stays_as_it_is(log: Flight) -> None:
    """A set-point that moves all the time is no sweep of an axis, and is not cut to the log's sweeps."""
    slow = np.cumsum(np.random.default_rng(9).standard_normal(log.time("p").size)) * 1e-3
    found = asked(log.with_channel("p_demand", slow, like="p"), "roll", "p", references=["p_demand", "sid_target"])
    assert is_right(found, "roll", "p")
