"""`swash track`: what it prints and writes, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, swash

from short_period import short_period
from swashplate.flights.flight import Flight

EQUATION = "q_dot = Mw*w + Mq*q + Md*servo_pitch + bias"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    samples = short_period(900, gust=0.02)
    samples[500:520] = np.nan
    channels = dict(zip(("q", "w", "servo_pitch"), samples.T, strict=True))
    return Flight.from_arrays(np.arange(900) * 0.01, channels).save(tmp_path / "log.nc")


def test_it_shows_writes_and_exports(log: Path, tmp_path: Path) -> None:
    out, code = tmp_path / "out", tmp_path / "code"
    done = swash("track", log, "--equation", EQUATION, "--held", "servo_pitch", "--out", out, "--code", code)
    assert (done.code, done.err) == (0, "")
    assert "Mq" in done.out
    assert "stood still 4.99 to 5.20 s: a value that is no number" in done.out
    assert "operations a step" in done.out
    assert sorted(p.name for p in out.iterdir()) == ["report.html", "track.json"]
    assert sorted(p.name for p in code.iterdir()) == ["track_q.c", "track_q.h"]
    as_json = json.loads(swash("track", log, "--equation", EQUATION, "--held", "servo_pitch", "--json").out)
    assert as_json["followed"][0]["values"]["Md"] == pytest.approx(-10.0, rel=0.05)


def test_what_cannot_be_told_ends_with_a_message(log: Path) -> None:
    for arguments, words in (
        (("--equation", "q_dot = Mq*q + Ma*alpha"), "alpha"),
        (("--equation", "q_dot"), "is no equation"),
        ((), "--equation"),
        (("--equation", EQUATION, "--band", "5-1"), "--band"),
        (("--equation", EQUATION, "--settings", "delay=servo_pitch=late"), "delay"),
    ):
        done = swash("track", log, *arguments)
        assert done.code == 2
        assert words in one_message(done)
    short = swash("track", f"{log}@0-0.5", "--equation", EQUATION)
    assert short.code == 2
    assert "has coefficients that the log does not separate" in short.err
