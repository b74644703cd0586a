"""`swash control`: design to a file that simulate flies, observability in words, bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import swash

import swashplate as sp


def test_a_design_is_flown_from_its_file(tmp_path: Path) -> None:
    file, flown = tmp_path / "lqr.toml", tmp_path / "f.nc"
    made = swash("control", "design", "coax", "--method", "lqr", "--delay", "servo_roll=20", "--out", file)
    assert made.code == 0, made.err
    assert "all at once: gain" in made.out
    assert "servo_roll 20 ms" in made.out
    command = ("simulate", "--vehicle", "coax", "--controller", file, "--maneuver", "doublet:pitch,0.5s,0.1")
    outcome = swash(*command, "--out", flown, "--quiet")
    assert outcome.code == 0, outcome.err
    flight = sp.read(flown)
    assert 0.005 < np.max(np.abs(flight.values("x"))) < 0.5
    other = swash(*command[:1], "--vehicle", "coax", "--option", "bar=false", *command[3:], "--out", flown)
    assert other.code == 2
    assert "was designed on another aircraft than this 16-state one" in other.err


def test_json_has_the_margins() -> None:
    found = json.loads(swash("control", "design", "coax", "--sensors", "gyro@100,mocap@50", "--json").out)
    (at,) = found["trims"]
    assert at["least_stable_mode"]["real"] < 0.0
    assert at["margins"]["together"]["disc"] > 0.3
    assert at["uncertainty"]["eta_bar"] < 0.01


def test_observability_says_it_in_words() -> None:
    outcome = swash("control", "observability", "coax", "--sensors", "imu@100,sonar,flow", "--seconds", "2")
    assert outcome.code == 0, outcome.err
    assert "Not seen at all, and it does not fade:\n  place to the north\n  place to the east\n  heading" in outcome.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--sensors", "imu@100"), "no sensor sees x (mode an integrator)"),
        (("--sensors", "radar"), "'radar' is no sensor"),
        (("--sensors", "mocap@10", "--rate", "20"), "20 Hz is too slow for the mode"),
        (("--state-weights", "1,2,3"), "are for 3 of 22: x, y, z"),
        (("--delay", "rudder=20"), "rudder: expected motor_lower"),
        (("--out", "c.json"), "ends in '.json', expected .toml"),
    ],
)
def test_bad_input_gives_2_and_says_why(arguments: tuple[str, ...], said: str) -> None:
    outcome = swash("control", "design", "coax", *arguments)
    assert outcome.code == 2
    assert said in outcome.err
