"""Sweeps as their own references: whose they are, how they are known, and what is said where one is missing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.series import parse
from swashplate.flights.provenance import Event, Provenance
from swashplate.identification.responses.excitations import told_sweeps
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.responses.references import References, references_of
from swashplate.identification.responses.respond import respond
from swashplate.identification.responses.response_warnings import bias_words, biased_by_feedback, without_unswept
from swashplate.identification.responses.spectra import signals

RATE, INPUTS = 50.0, ("stick_roll", "stick_pitch")
TIME = np.arange(6_000) / RATE


def slow(seed: int, size: float) -> np.ndarray:
    noise = np.random.default_rng(seed).standard_normal(TIME.size)
    low = lfilter([1.0], [1.0, -np.exp(-2.0 * np.pi * 0.2 / RATE)], noise)
    return np.asarray(size * low / np.std(low))


def sweep(start: float, length: float = 50.0) -> np.ndarray:
    return np.asarray(parse(f"sweep:roll,0.15-4Hz,{length:g}s,0.1").signals(TIME - start)["roll"])


def flown(*, roll: np.ndarray, pitch: np.ndarray, gust: float, seed: int = 1, name: str = "flown") -> Flight:
    """Two first-order axes, y = (u + d) / (s + 1), each held by u = r - 1.5 y, with noise on what is seen."""
    random = np.random.default_rng(seed)
    keep = np.exp(-1.0 / RATE)
    columns: dict[str, np.ndarray] = {}
    for axis, asked, k in (("roll", roll, 0), ("pitch", pitch, 1)):
        disturbance, y, u = slow(seed + 10 + k, gust), np.zeros(TIME.size), np.zeros(TIME.size)
        for i in range(TIME.size):
            if i:
                y[i] = keep * y[i - 1] + (1.0 - keep) * (u[i - 1] + disturbance[i - 1])
            u[i] = asked[i] + (0.15 * roll[i] if axis == "pitch" else 0.0) - 1.5 * y[i]
        columns[f"stick_{axis}"] = u
        columns[f"{axis}_rate"] = y + 1e-4 * random.standard_normal(TIME.size)
    return Flight({"uniform": stream(TIME, columns, dict.fromkeys(INPUTS, "1"))}, Provenance(source=name))


def both(flight: Flight, **how: bool) -> FrequencyResponse:
    return respond(flight, inputs=INPUTS, outputs=("roll_rate", "pitch_rate"), band=(0.15, 4.0), lines=25, **how)


def truth(omega: np.ndarray) -> np.ndarray:
    keep, z = np.exp(-1.0 / RATE), np.exp(1j * omega / RATE)
    return np.asarray((1.0 - keep) / (z - keep))


def references(flight: Flight) -> References | None:
    pieces = signals([flight], (*INPUTS, "roll_rate"))
    commands = {name: k for k, name in enumerate(INPUTS)}
    return references_of(pieces, told_sweeps([flight]), commands, len(INPUTS), {}, called={})


@pytest.fixture(scope="module")
def gusty() -> Flight:
    """Both axes in one record, one after the other, in gusts."""
    return flown(roll=sweep(5.0), pitch=sweep(62.0), gust=0.03)


@pytest.fixture(scope="module")
def answers(gusty: Flight) -> FrequencyResponse:
    return both(gusty)


def test_two_sweeps_in_one_record_belong_to_their_own_axes(gusty: Flight) -> None:
    found = references(gusty)
    assert found is not None
    assert found.swept == (True, True)
    assert [text.partition(":")[0] for text in found.sweeps] == ["stick_roll", "stick_pitch"]
    (columns,) = found.columns
    assert np.all(columns[TIME > 58.0, 0] == 0.0)
    assert np.all(columns[TIME < 50.0, 1] == 0.0)


def test_the_estimate_along_the_sweep_is_right_and_the_direct_one_is_kept_beside_it(
    answers: FrequencyResponse, gusty: Flight, tmp_path: Path
) -> None:
    h = truth(answers.omega)
    for output, name in (("roll_rate", "stick_roll"), ("pitch_rate", "stick_pitch")):
        got, coherence, error = answers.pair(output, name)
        used = (coherence >= 0.6) & np.isfinite(got)
        assert used.sum() > 20
        assert np.all(np.abs(got / h - 1.0)[used] <= np.maximum(0.122, 3.0 * error[used]))
    direct = both(gusty, direct=True)
    assert (answers.method, direct.method, direct.direct) == ("along sweeps", "direct", None)
    again = FrequencyResponse.load(answers.save(tmp_path / "responses.nc"))
    assert again.direct is not None
    assert answers.direct is not None
    np.testing.assert_array_equal(again.direct, answers.direct)
    part = again.select(("roll_rate",), ("stick_roll",))
    assert part.direct is not None
    assert part.direct.shape == part.response.shape
    assert "direct_magnitude_db" in part.to_document()["responses"][0]


def test_where_direct_and_tracked_differ_is_said_by_band(answers: FrequencyResponse) -> None:
    hertz = answers.omega / TWO_PI
    off = answers.response.copy()
    off[(hertz > 0.5) & (hertz < 0.9), 0, 0] *= 3.0
    off[(hertz > 2.0) & (hertz < 3.0), 0, 0] *= 4.0
    direct = replace(answers, response=off)
    assert not biased_by_feedback(answers, answers).any()
    biased = biased_by_feedback(answers, direct)
    assert not biased[:, 1].any()
    (text,) = bias_words(answers, direct, biased)
    assert text.startswith("roll_rate / stick_roll: feedback biases the direct estimate by up to 12.0 dB at 0.5")
    assert text.count(" and ") == 1
    assert text.endswith("the estimate along the sweep is given.")


def test_an_input_without_a_sweep_has_no_number_where_the_loop_is_seen_to_rule(answers: FrequencyResponse) -> None:
    none = np.zeros(answers.response.shape, dtype=bool)
    same, words = without_unswept(answers, (True, True), none)
    assert (same is answers, words) == (True, [])
    same, (text,) = without_unswept(answers, (True, False), none)
    assert same is answers
    assert "'stick_pitch'" in text
    assert "a loop may bias them" in text
    biased = none.copy()
    biased[4:8, 0, 0] = True
    found, (text,) = without_unswept(answers, (True, False), biased)
    assert np.isnan(found.response[:8, :, 1]).all()
    np.testing.assert_array_equal(found.response[:, :, 0], answers.response[:, :, 0])
    np.testing.assert_array_equal(found.response[8:], answers.response[8:])
    assert "no number is given" in text
    assert "--direct" in text


def test_doublets_are_no_sweep() -> None:
    doublets = parse("3211:roll,1s,0.1").signals(TIME - 70.0)["roll"]
    found = references(flown(roll=sweep(5.0), pitch=doublets, gust=0.03))
    assert found is not None
    assert found.swept == (True, False)


def test_without_any_sweep_the_estimate_is_direct() -> None:
    random = np.random.default_rng(5)
    flight = flown(roll=0.1 * random.standard_normal(TIME.size), pitch=slow(9, 0.1), gust=0.0)
    assert references(flight) is None
    assert both(flight).method == "direct"


def test_an_autopilots_sweep_is_taken_by_the_law_that_the_log_tells() -> None:
    chirp = Chirp(10, 0.1, 0.15, 4.0, 90.0, 5.0, 2.0, 2.0 / 0.15)
    flight = flown(roll=chirp.signal(TIME - 10.0), pitch=np.zeros(TIME.size), gust=0.03)
    details = {**chirp.as_details(), "start": 10.0, "stop": 100.0, "seen": 80.0}
    told = Flight(flight.streams, Provenance(source="told", events=(Event(9.0, "sweep", "roll mixer", details),)))
    found = references(told)
    assert found is not None
    assert found.sweeps[0].endswith("by the log's law")
    np.testing.assert_allclose(
        found.columns[0][:, 0], np.where(TIME <= 80.0, chirp.signal(TIME - 10.0), 0.0), atol=1e-12
    )
