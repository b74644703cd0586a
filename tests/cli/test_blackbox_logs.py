"""Blackbox logs at the command line: inspect, respond."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import swash

import made_blackbox_logs as made
import swashplate as sp

LP, LD, GAIN, STEP = -6.0, 90.0, 0.35, 4000  # 1/s, rad/s^2, s/rad, us


def flown(*, chirp: bool, seconds: float = 80.0, seed: int = 1) -> bytes:
    """A roll axis under a rate controller, p' = LP p + LD mixer, in gusts; with a chirp in the set-point or without."""
    dt, rng = 1e-6 * STEP, np.random.default_rng(seed)
    t = np.arange(int(seconds / dt)) * dt
    phase = 2 * np.pi * 0.3 * seconds / np.log(30.0) * (30.0 ** (t / seconds) - 1.0)  # 0.3 to 9 Hz
    wanted = np.deg2rad(60.0) * np.sin(phase) * np.minimum(1.0, np.minimum(t, seconds - t)) * chirp
    gust = np.zeros(t.size)
    p, mixer = np.zeros(t.size), np.zeros(t.size)
    for k in range(1, t.size):
        gust[k] = 0.98 * gust[k - 1] + rng.normal() * (0.1 if chirp else 1.0)
        mixer[k - 1] = GAIN * (wanted[k - 1] - p[k - 1])
        p[k] = p[k - 1] + dt * (LP * p[k - 1] + LD * mixer[k - 1] + gust[k])
    mixer[-1] = mixer[-2]
    # Rotorflight logs whole degrees a second and thousandths
    degrees = np.rint(np.rad2deg(np.column_stack([p, wanted]))).astype(int)
    return made.rotorflight(
        {"gyroADC[0]": degrees[:, 0], "setpoint[0]": degrees[:, 1], "mixer[0]": np.rint(1e3 * mixer).astype(int),
         "accADC[2]": np.full(t.size, 2048), "headspeed": np.full(t.size, 2100)}, step_us=STEP,
        more={"rollPID": "50,100,20,90,0", "rollBW": "60,15,15"},
    )  # fmt: skip


@pytest.fixture(scope="module")
def chirped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("blackbox") / "chirp.bbl"
    path.write_bytes(flown(chirp=True))
    return path


def test_inspect_shows_the_log(chirped: Path) -> None:
    outcome = swash("inspect", chirped)
    assert outcome.code == 0, outcome.err
    assert "Rotorflight 4.4.0" in outcome.out
    assert "mixer_roll" in outcome.out
    found = json.loads(swash("inspect", chirped, "--json").out)
    assert found["damage"] == []
    assert found["sweeps"], "a chirp is a sweep"


def test_respond_finds_the_aircraft_in_a_chirp(chirped: Path, tmp_path: Path) -> None:
    arguments = ("--inputs", "mixer_roll", "--outputs", "p", "--references", "p_demand", "--band", "0.5-8")
    outcome = swash("respond", chirped, *arguments, "--out", tmp_path / "out", "-q")
    assert outcome.code == 0, outcome.err
    found = sp.FrequencyResponse.load(tmp_path / "out" / "responses.nc")
    truth = LD / (1j * found.omega - LP)
    ratio = found.response[:, 0, 0] / truth
    # Sampled at 250 Hz with a held input, half a step late
    ratio *= np.exp(0.5j * found.omega * 1e-6 * STEP)
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.5
    assert np.abs(np.rad2deg(np.angle(ratio))).max() < 3.0


def test_gains_come_in_the_firmwares_own_names(chirped: Path, tmp_path: Path) -> None:
    """The plant is 90 / (s + 6), so feed-forward is 6 / 90 of a radian per second, 46.5 in Rotorflight's unit."""
    arguments = ("--inputs", "mixer_roll", "--outputs", "p", "--references", "p_demand", "--band", "0.5-8")
    assert swash("respond", chirped, *arguments, "--out", tmp_path / "out", "-q").code == 0
    outcome = swash(
        "identify",
        "--responses",
        tmp_path / "out" / "responses.nc",
        "--input",
        "mixer_roll",
        "--form",
        "0/1",
        "--gains",
        "--json",
        "--out",
        tmp_path,
    )
    assert outcome.code == 0, outcome.err
    (roll,) = json.loads(outcome.out)["gains"]
    assert roll["axis"] == "roll"
    assert roll["flown"]["roll_i_gain"] == 100.0
    assert roll["parameters"]["roll_gyro_cutoff"] == 60.0
    assert roll["parameters"]["roll_f_gain"] == pytest.approx(np.deg2rad(1.0) * 6.0 / 90.0 / 2.5e-5, abs=3.0)
    assert all(value == int(value) for value in roll["parameters"].values())


def test_a_flight_of_feedback_alone_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "calm.bbl").write_bytes(flown(chirp=False, seconds=20.0))
    arguments = ("respond", tmp_path / "calm.bbl", "--inputs", "mixer_roll", "--outputs", "p", "--band", "0.5-8")
    outcome = swash(*arguments)
    assert outcome.code == 2
    assert "'mixer_roll' is a controller's answer" in outcome.err
    assert "Fly a sweep" in outcome.err
    outcome = swash(*arguments, "--references", "p_demand")
    assert outcome.code == 2
    assert "reference 'p_demand' never moves" in outcome.err
