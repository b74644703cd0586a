"""`swash maneuver`: files, checks in words and as JSON, ArduPilot's parameters, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, saying, swash

from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.series import parse
from swashplate.flights.readers.read import read

SWEEP = "sweep:roll,0.5-8Hz,60s,0.1"


@pytest.mark.parametrize("spec", [SWEEP, "doublet:pitch,0.5s,0.2", "3-2-1-1:yaw,0.5s", "sine:heave,1Hz,10s,0.05"])
def test_the_table_reads_back_as_the_maneuver(spec: str, tmp_path: Path) -> None:
    outcome = swash("maneuver", spec, "--out", tmp_path / "a.csv", "--rate", "200")
    assert (outcome.code, outcome.err) == (0, "")
    for part in ("rule", "met", "sample rate", "a.csv"):
        assert part in outcome.out
    maneuver, flight = parse(spec), read(tmp_path / "a.csv")
    (axis,) = maneuver.axes
    np.testing.assert_array_equal(flight.values(axis), maneuver.signals(flight.time(axis))[axis])
    assert flight.rate(axis) == pytest.approx(200.0)


def test_a_broken_rule_is_shown_and_the_file_written_all_the_same(tmp_path: Path) -> None:
    outcome = swash("maneuver", SWEEP, "--out", tmp_path / "a.csv", "--noise", "2", "--gain", "1")
    assert outcome.code == 0
    assert "NO" in outcome.out
    assert "an amplitude of" in outcome.out
    assert (tmp_path / "a.csv").exists()


def test_ardupilots_schedule_and_parameters(tmp_path: Path) -> None:
    outcome = swash("maneuver", SWEEP, "--out", tmp_path / "a.csv", "--ardupilot", "--rate", "400")
    assert "SID_F_STOP_HZ,8.0" in outcome.out
    assert (tmp_path / "a.param").read_text().splitlines()[0] == "SID_AXIS,10"
    flight = read(tmp_path / "a.csv")
    chirp = Chirp.planned(10, 0.1, (0.5, 8.0), record=60.0, fade=3.0)
    np.testing.assert_array_equal(flight.values("roll"), chirp.signal(flight.time("roll")))
    document = json.loads(swash("maneuver", SWEEP, "--ardupilot", "--json", "--settings", saying(sid_axis=7)).out)
    assert document["ardupilot"]["SID_AXIS"] == 7.0
    assert "written" not in document
    assert {check["rule"] for check in document["checks"]} >= {"sample rate", "length", "windows"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("swep:roll,1-2Hz,60s",), "swep"),
        ((SWEEP, "--out", "a.txt"), "expected .csv"),
        ((SWEEP, "--out", "nowhere/a.csv"), "nowhere"),
        ((SWEEP, "--noise", "1"), "--noise and --gain"),
        ((SWEEP, "--noise", "1", "--gain", "1", "--settings", "coherence=1"), "make no sense"),
        (("doublet:roll,1s", "--ardupilot"), "flies sweeps only"),
        (("sweep:tail,1-2Hz,60s", "--ardupilot"), "'tail' has no SID_AXIS"),
        ((SWEEP, "--ardupilot", "--settings", "sid_axis=99"), "99 is no SID_AXIS"),
        ((SWEEP, "--settings", "sid_axis=7"), "without --ardupilot"),
        ((SWEEP, "--ardupilot", "--settings", "sid_axis=12"), "12 is the yaw mixer, and the sweep is one of roll"),
        (("sweep:heave,0.5-8Hz,60s", "--ardupilot", "--settings", "sid_axis=10"), "the sweep is one of heave"),
        (("sweep:roll,0.5-8Hz,60s,15", "--ardupilot"), "beyond the mixer's range"),
        (("sweep:roll,0.02-2Hz,300s", "--ardupilot"), "SID_T_REC"),
    ],
)
def test_what_is_refused(
    arguments: tuple[str, ...], says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert says in one_message(swash("maneuver", *arguments))
    assert list(tmp_path.iterdir()) == []
