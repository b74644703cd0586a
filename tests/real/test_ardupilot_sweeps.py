"""Genuine ArduPilot helicopter logs of sweeps, against the derivatives of the simulator that flew them.

The truth is in the data set's notes: a four-state rotor-body model, first-order heave, and the effective delays found
there when the phase was fitted (53.4, 52.6 and 52.7 ms). The simulator steps these derivatives by Euler's rule at
1200 Hz (flapping from the old rates, rates from the new flapping): what it flies is up to 0.45 dB above the continuous
equations from 10 Hz on (`flown_response`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.ardupilot_gains import suggest_gains
from swashplate.flights.flight import Flight
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.transfer_function_fit import fit_transfer_function
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.models.linear.state_space_file import structure
from swashplate.validation.verify import verify

A = np.array([[0, 0, 3588.6, 0], [0, 0, 0, 617.5], [-1, 0, -14.6559, 18.9984], [0, -1, -19.6418, -14.6559]])
B = np.array([[0, 0], [0, 0], [3.58967, -1.24391], [1.06772, 3.95150]])
INPUTS, OUTPUTS = ("mixer_roll", "mixer_pitch"), ("p", "q")


def flight(folder: Path, name: str, *channels: str) -> Flight:
    """The streams that hold some channels of a log, at 100 Hz."""
    log = sp.read(folder / "ardupilot_sitl" / name)
    homes = {log.stream_of(channel) for channel in channels}
    log = log.with_streams({key: data for key, data in log.streams.items() if key in homes})
    return log.condition(rate=100, cutoff=0, outliers=False, trim_ground=False, derive=False)


@pytest.fixture(scope="module")
def sweeps(shared_data: Path) -> list[Flight]:
    return [flight(shared_data, f"heli_sid_{axis}_mix.BIN", *INPUTS, *OUTPUTS) for axis in ("roll", "pitch")]


@pytest.fixture(scope="module")
def responses(sweeps: list[Flight]) -> FrequencyResponse:
    return respond(sweeps, inputs=INPUTS, outputs=OUTPUTS, band=(0.1, 16.0))


def flown_response(omega: float) -> np.ndarray:
    """The simulator's own response: flap+ = flap + dt (-rate + F flap + G u), rate+ = rate + dt L flap+, at 1200 Hz."""
    dt = 1.0 / 1200.0
    z = np.exp(1j * omega * dt)
    rates = z * dt / (z - 1.0) * A[:2, 2:]  # of flapping
    flap = np.linalg.solve((z - 1.0) / dt * np.eye(2) - A[2:, 2:] + rates, B[2:])
    return np.asarray(rates @ flap)


def gain_errors(found: FrequencyResponse, truth: np.ndarray, *, upto: float = 16.0) -> np.ndarray:
    """Errors [dB] of all gains where the partial coherence is 0.9 or more, up to a frequency [Hz]."""
    used = (found.coherence >= 0.9) & (found.omega <= 2 * np.pi * upto)[:, None, None]
    return np.abs(20 * np.log10(np.abs(found.response / truth)))[used]


def test_gains_on_and_off_axis(responses: FrequencyResponse) -> None:
    errors = gain_errors(responses, np.array([flown_response(w) for w in responses.omega]))
    assert errors.size > 420
    assert np.max(errors) < 0.5
    # The derivatives' continuous response is the same up to the resonance at 10 Hz, and less above it.
    continuous = np.array([np.linalg.solve(1j * w * np.eye(4) - A, B)[:2] for w in responses.omega])
    assert np.max(gain_errors(responses, continuous, upto=9.0)) < 0.5
    assert 0.5 < np.max(gain_errors(responses, continuous)) < 0.8


def test_rotor_body_model_has_the_simulators_modes_and_delays(responses: FrequencyResponse) -> None:
    fit = fit_state_space(structure("rotor_body"), responses)
    assert fit.cost < 5.0
    modes = [v for v in fit.solution.eigenvalues() if v.imag > 0.0]
    for value, (hertz, damping) in zip(modes, ((10.11, 0.128), (3.73, 0.279)), strict=True):
        assert abs(value) / (2 * np.pi) == pytest.approx(hertz, rel=0.03)
        assert -value.real / abs(value) == pytest.approx(damping, abs=0.02)
    assert fit["tau_roll"].value == pytest.approx(0.0534, abs=0.003)
    assert fit["tau_pitch"].value == pytest.approx(0.0526, abs=0.003)
    gains = {name: value for s in suggest_gains(fit.solution) for name, value in s.parameters.items()}
    assert gains["ATC_RAT_RLL_FF"] == pytest.approx(1 / 3.5897, rel=0.05)
    assert gains["ATC_RAT_PIT_FF"] == pytest.approx(1 / 3.9515, rel=0.05)


def test_a_single_input_is_wrong_and_said_so(sweeps: list[Flight]) -> None:
    alone = respond(sweeps[0], inputs=["mixer_roll"], outputs=["p"], band=(0.1, 16.0))
    at = int(np.argmin(np.abs(alone.omega - 2 * np.pi * 0.15)))
    assert 20 * np.log10(np.abs(alone.pair("p", "mixer_roll")[0][at])) > 11.1 + 0.6  # uncoupled truth: 11.1 dB
    assert any("'mixer_pitch' moved along" in text for text in alone.warnings)


def test_one_sweep_cannot_tell_two_inputs_apart_and_no_window_feigns_it(sweeps: list[Flight]) -> None:
    """The pitch command is the loop's answer to the roll sweep; windows of 5 s see 1 to 3 % of it as its own."""
    alone = respond(sweeps[0], inputs=INPUTS, outputs=OUTPUTS, band=(0.2, 10.0))
    assert np.isfinite(alone.response).any(axis=(1, 2)).mean() < 0.1
    assert all(alone.band(o, i) is None for o in OUTPUTS for i in INPUTS)
    told = " ".join(alone.problems)
    assert "'mixer_pitch' and 'mixer_roll' move together" in told
    assert "mixer_pitch: moved by no sweep; the log's are of roll mixer" in told


def test_collective_to_vertical_acceleration(shared_data: Path) -> None:
    log = flight(shared_data, "heli_sid_coll_mix.BIN", "mixer_collective", "az_sid")
    # One record with a dwell of 13 s at its lowest frequency: the rules' windows blur, and half the record is added.
    found = respond(log, inputs=["mixer_collective"], outputs=["az_sid"], band=(0.15, 8.0))
    assert any("one of 28.8 s" in text for text in found.warnings), found.warnings
    _, coherence, _ = found.pair("az_sid", "mixer_collective")
    assert np.mean(coherence >= 0.9) > 0.95
    s = 1j * found.omega[:, None, None]
    assert np.max(gain_errors(found, -27.43 * s / (s + 2.25))) < 0.3
    fit = fit_transfer_function(found, "0/1-1s", input="mixer_collective", band=(0.15, 7.0))
    values = fit.solution[0].values
    assert fit.cost < 5.0
    assert values["K"] == pytest.approx(-27.43, rel=0.03)
    assert values["pole"] == pytest.approx(2.25, rel=0.03)
    assert values["tau"] == pytest.approx(0.0527, abs=0.003)


def test_the_injected_sweep_is_offered_and_not_its_frequency(shared_data: Path) -> None:
    log = flight(shared_data, "heli_sid_coll_mix.BIN", "mixer_collective", "az_sid")
    found = respond(log, inputs=["mixer_collective"], outputs=["az_sid"], band=(0.15, 8.0), windows=[28.0, 10.0])
    assert any("the logs hold sid_target: --references sid_target makes" in text for text in found.warnings)


def test_given_windows_that_blur_are_said(shared_data: Path) -> None:
    log = flight(shared_data, "heli_sid_coll_mix.BIN", "mixer_collective", "az_sid")
    found = respond(log, inputs=["mixer_collective"], outputs=["az_sid"], band=(0.1, 8.0), windows=[11.5, 5.0, 2.5])
    assert any("blurred az_sid / mixer_collective" in text and "windows=28.8" in text for text in found.warnings), (
        found.warnings
    )


def test_a_log_that_no_fit_has_seen_refutes_wrong_models_and_not_the_identified_one(
    shared_data: Path, responses: FrequencyResponse
) -> None:
    """A roll-rate sweep of 3 s under the rate loop, in time."""
    fit = fit_state_space(structure("rotor_body"), responses)
    unseen = flight(shared_data, "heli_sid_allbits_roll_rate.BIN", *INPUTS, *OUTPUTS)
    found = verify(fit.solution, unseen)
    assert found.cost < 0.4, found
    assert all(found[name].theil < 0.03 for name in OUTPUTS), found
    assert found.verdict == "not refuted", found
    values = {name: fit[name].value for name in ("Lb", "Ma", "Blat", "Alon")}
    wrong = [
        {"Blat": -values["Blat"], "Alon": -values["Alon"]},
        *({name: factor * values[name]} for name in values for factor in (0.5, 1.5)),
    ]
    verdicts = {str(change): verify(fit.solution.with_values(change), unseen).verdict for change in wrong}
    # Half more Lb hides in every single band; what all of them ask of this parameter together does not.
    assert set(verdicts.values()) == {"refuted"}, verdicts


def test_a_log_that_was_cut_off_is_named_and_what_is_left_is_used(shared_data: Path, tmp_path: Path) -> None:
    whole = (shared_data / "ardupilot_sitl" / "heli_sid_roll_mix.BIN").read_bytes()
    part = tmp_path / "cut.BIN"
    part.write_bytes(whole[:2_600_000])
    log = sp.read(part)
    log = log.with_streams({"rates": log.streams["rates"]})
    found = respond(
        log.condition(rate=100, cutoff=0, outliers=False, trim_ground=False, derive=False),
        inputs=["mixer_roll"],
        outputs=["p"],
        band=(0.2, 5.0),
    )
    assert any("cut.BIN" in text and "cut off" in text for text in found.problems), found.problems
    assert found.band("p", "mixer_roll") is not None


def test_the_error_filter_is_in_the_loop_that_flew(shared_data: Path) -> None:
    """What the suggested gains take ArduPilot's controller to be, against what its log shows it did."""
    log = flight(shared_data, "heli_sid_roll_mix.BIN", "mixer_roll", "p", "p_demand", "sid_target")
    said = log.provenance.parameter
    own = log.values("mixer_roll") - np.interp(log.time("p") - 0.0025, log.time("p"), log.values("sid_target"))
    found = respond(
        log.with_channel("own", own, like="p"),
        inputs=["p"],
        outputs=["own", "p_demand"],
        band=(2.0, 6.0),
        bystanders=(),
    )
    s = 1j * found.omega
    at = {name: said(f"ATC_RAT_RLL_{name}", at=130.0) for name in ("P", "I", "D", "FF", "FLTE", "FLTT")}
    assert at["FLTE"] == 20.0
    wanted = found.pair("p_demand", "p")[0]
    target, error = (1.0 / (1.0 + s / (2 * np.pi * at[name])) for name in ("FLTT", "FLTE"))
    pid = (at["P"] + at["I"] / s + at["D"] * s) * (wanted - 1.0)
    measured = found.pair("own", "p")[0]

    def lag(said: np.ndarray) -> np.ndarray:
        return np.abs(np.degrees(np.angle(said / measured)))

    assert np.max(lag(at["FF"] * target * wanted + pid * error)) < 3.0
    assert np.min(lag(at["FF"] * target * wanted + pid)) > 4.0
    assert np.max(lag(at["FF"] * target * wanted + pid)) > 14.0
