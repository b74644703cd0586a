"""Logs of unmodified firmware that sweep several axes in turn: one input named, what is built on it, what is refused.

The right values are in the data set's notes; they were reckoned from the stretches of the single sweeps by other
means.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.ardupilot_gains import suggest_gains
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.identification.frequency.handling import ResponseMargins, margins
from swashplate.identification.responses.arithmetic import combine
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse

PHASES = {2.04: -73.4, 2.96: -91.1, 5.98: -123.7, 7.91: -134.5}
"""Degrees of p / mixer_roll by frequency [Hz], of the unfiltered gyro."""
BROKEN = {"roll": (10.7, 78.3), "pitch": (8.4, 57.3), "yaw": (14.7, 69.0)}
"""Crossover [rad/s] and phase margin [deg] of the loops as flown."""
STRETCH = {"roll": (178.4, 221.0), "pitch": (227.9, 270.5), "yaw": (277.4, 320.0)}
RATES = {"roll": "p_sid", "pitch": "q_sid", "yaw": "r_sid"}


@pytest.fixture(scope="module")
def log(shared_data: Path) -> Flight:
    flight = sp.read(shared_data / "ardupilot_firmware" / "raptor50_three_sweeps.BIN")
    names = {"rates", "system_identification", *(f"pid_{axis}" for axis in RATES)}
    return flight.with_streams({key: data for key, data in flight.streams.items() if key in names})


def asked(log: Flight, axis: str, output: str, *, references: tuple[str, ...] = (), **how: bool) -> FrequencyResponse:
    records = sp.uniform_records(log, (f"mixer_{axis}", output, *references))
    return sp.respond(records, inputs=[f"mixer_{axis}"], outputs=[output], references=references, **how)


@pytest.fixture(scope="module")
def answers(log: Flight) -> dict[str, FrequencyResponse]:
    """Of each axis' controller to its actuator, from the whole log."""
    return {axis: asked(log, axis, f"pid_{axis}") for axis in BROKEN}


@pytest.fixture(scope="module")
def loops(answers: dict[str, FrequencyResponse]) -> dict[str, FrequencyResponse]:
    """Broken at the actuators."""
    return {axis: combine("negative", answer) for axis, answer in answers.items()}


@pytest.mark.parametrize("references", [(), ("sid_target",)])
def test_roll_alone_from_the_log_of_three_sweeps_is_not_late(log: Flight, references: tuple[str, ...]) -> None:
    found = asked(log, "roll", "p_sid", references=references)
    h, coherence, error = found.pair("p_sid", "mixer_roll")
    phase = np.degrees(np.unwrap(np.angle(h[found.omega > TWO_PI])))
    hertz = found.omega[found.omega > TWO_PI] / TWO_PI
    for at, right in PHASES.items():
        assert np.interp(at, hertz, phase) == pytest.approx(right, abs=0.8), at
    inside = found.omega > TWO_PI
    assert np.median(coherence[inside]) > 0.999
    assert np.median(error[inside]) < 0.002
    assert not any("feedback biases" in text for text in found.warnings)
    assert found.settings["beside"] == ["mixer_pitch", "mixer_yaw"]


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw"])
def test_the_whole_log_says_what_the_stretch_of_the_sweep_says(
    log: Flight, answers: dict[str, FrequencyResponse], axis: str
) -> None:
    whole, part = answers[axis], asked(log.between(*STRETCH[axis]), axis, f"pid_{axis}")
    h, other = (one.pair(f"pid_{axis}", f"mixer_{axis}")[0] for one in (whole, part))
    known = np.isfinite(other)
    log_h = np.log(np.abs(other[known])) + 1j * np.unwrap(np.angle(other[known]))
    inside = (whole.omega > TWO_PI * 0.8) & (whole.omega < TWO_PI * 8.0)
    between = np.exp(np.interp(whole.omega[inside], part.omega[known], log_h))
    apart = np.abs(h[inside] / between - 1.0)
    assert apart.max() < 0.03
    assert np.median(apart) < 0.005


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw"])
def test_margins_of_the_loops_as_flown(loops: dict[str, FrequencyResponse], axis: str) -> None:
    h, _, error = loops[axis].pair(f"pid_{axis}", f"mixer_{axis}")
    known = np.isfinite(h)
    read = margins(loops[axis].omega[known], h[known], error=error[known])
    crossover, phase = BROKEN[axis]
    assert read.crossover.value == pytest.approx(crossover, rel=0.01)
    assert read.phase_margin.value == pytest.approx(phase, abs=1.0)
    assert read.phase_margin.sigma < 1.0


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw"])
@pytest.mark.parametrize("form", [None, "0/1+1s"])
def test_errors_of_a_models_margins_reach_to_the_right_ones(
    loops: dict[str, FrequencyResponse], axis: str, form: str | None
) -> None:
    """74.7 +- 0.6 degrees were printed where 78.3 are right: the chosen form is not the loop's."""
    study = sp.fit_tf(loops[axis], input=f"mixer_{axis}", form=form, margins=True)
    (model,) = (line.read for line in study.margins if line.source == "model")
    assert isinstance(model, ResponseMargins)
    for read, right in zip((model.crossover, model.phase_margin), BROKEN[axis], strict=True):
        assert abs(read.value - right) < 2.0 * read.sigma
        assert abs(read.value - right) > 0.4 * read.sigma, "nor is it merely wide"


def test_gains_from_one_input_are_those_from_all(log: Flight) -> None:
    records = sp.uniform_records(log, (*(f"mixer_{axis}" for axis in RATES), *RATES.values()))
    inputs = [f"mixer_{axis}" for axis in RATES]
    whole = sp.respond(records, inputs=inputs, outputs=list(RATES.values()), band=(0.6, 10.0))
    alone = sp.respond(records, inputs=inputs[:1], outputs=["p_sid"], band=(0.6, 10.0))
    gains = []
    for found in (whole, alone):
        fit = sp.fit_transfer_function(found, "0/2", input="mixer_roll", outputs=["p_sid"])
        (suggestion,) = suggest_gains(fit, sources={"p_sid": "p_sid", "mixer_roll": "mixer_roll"})
        gains.append(suggestion.parameters)
    assert gains[0]["ATC_RAT_RLL_P"] > 0.0
    assert gains[1] == pytest.approx(gains[0], rel=0.02)


def test_an_axis_without_a_sweep_is_refused_with_the_sweeps_that_there_are(log: Flight) -> None:
    two = log.between(178.0, 271.0)
    with pytest.raises(FlightError, match=r"mixer_yaw: moved by no sweep; the log's are of roll mixer .* pitch mixer"):
        asked(two, "yaw", "pid_yaw", references=("sid_target",))
    copied = asked(two, "yaw", "pid_yaw", direct=True)
    assert np.isnan(copied.response).all()
    assert any("'pid_yaw' is a copy of 'mixer_yaw'" in text for text in copied.problems)


def test_no_healthy_pair_of_real_logs_is_called_a_copy(log: Flight) -> None:
    records = sp.uniform_records(log, (*(f"mixer_{axis}" for axis in RATES), *RATES.values(), "p", "q", "r"))
    inputs = [f"mixer_{axis}" for axis in RATES]
    found = sp.respond(records, inputs=inputs, outputs=[*RATES.values(), "p", "q", "r"], band=(0.6, 10.0))
    assert not any("is a copy of" in text for text in (*found.warnings, *found.problems))
