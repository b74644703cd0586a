"""`swash control`: design to a file that simulate flies, bad input."""

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
    assert "late: servo_roll 20 ms (as given); computation: not known" in made.out
    command = ("simulate", "--vehicle", "coax", "--controller", file, "--maneuver", "doublet:pitch,0.5s,0.1")
    outcome = swash(*command, "--out", flown, "--quiet")
    assert outcome.code == 0, outcome.err
    flight = sp.read(flown)
    assert 0.005 < np.max(np.abs(flight.values("x"))) < 0.5
    other = swash(*command[:1], "--vehicle", "coax", "--set", "bar=false", *command[3:], "--out", flown)
    assert other.code == 2
    assert "was designed on another aircraft than this 16-state one" in other.err


def test_json_has_the_margins() -> None:
    found = json.loads(swash("control", "design", "coax", "--sensors", "gyro@100,mocap@50", "--json").out)
    (at,) = found["trims"]
    assert at["least_stable_mode"]["real"] < 0.0
    assert at["margins"]["together"]["disc"] > 0.3
    assert at["uncertainty"]["eta_bar"] < 0.01


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--sensors", "imu@100"), "no sensor sees x (mode an integrator)"),
        (("--sensors", "radar"), "'radar' is no sensor"),
        (("--sensors", "mocap@10", "--rate", "20"), "20 Hz is too slow for the mode"),
        (("--settings", "state_weights=1,2,3"), "state weights: are for 3 of 22: x, y, z"),
        (("--settings", "input_weights=1,2"), "input weights: are for 2 of 4: motor_lower, motor_upper"),
        (("--method", "lqr", "--gain", "steady"), "gain: has no observer"),
        (("--delay", "-5"), "--delay: is -5 ms, expected 0 to 1000"),
        (("--delay", "rudder=20"), "rudder: expected motor_lower"),
        (("--out", "c.json"), "ends in '.json', expected one of .toml, .html, .c"),
    ],
)
def test_bad_input_gives_2_and_says_why(arguments: tuple[str, ...], said: str) -> None:
    outcome = swash("control", "design", "coax", *arguments)
    assert outcome.code == 2
    assert said in outcome.err


# ---- state-space files ----------------------------------------------------------------------------------------------
def test_a_state_space_file_is_held_with_its_delays(tmp_path: Path) -> None:
    file, flown = tmp_path / "lqr.toml", tmp_path / "f.nc"
    made = swash("control", "design", "thirteen_state", "--method", "lqr", "--out", file)
    assert made.code == 0, made.err
    assert "lateral 20 ms, longitudinal 20 ms, pedal 20 ms, collective 20 ms (identified)" in made.out
    assert "range of lateral, longitudinal, pedal, collective: assumed, 1 either way" in made.err
    command = (
        "simulate",
        "--vehicle",
        "thirteen_state",
        "--controller",
        file,
        "--maneuver",
        "doublet:lateral,0.5s,0.1",
    )
    outcome = swash(*command, "--out", flown, "--quiet")
    assert outcome.code == 0, outcome.err
    flight = sp.read(flown)
    assert 0.02 < np.max(np.abs(flight.values("y"))) < 1.0
    other = swash(*command[:2], "raptor50", *command[3:], "--out", flown)
    assert other.code == 2
    assert "is fed with the linear model's states, which another vehicle does not have" in other.err


def without(text: str, name: str) -> str:
    """A card without one of its parameters."""
    start = text.index(f"[parameters.{name}]")
    return text[:start] + text[text.index("[parameters.", start + 1) :]


def test_a_card_without_a_number_is_named(tmp_path: Path) -> None:
    card = tmp_path / "card.toml"
    card.write_text(without(sp.vehicle("coax").card.to_toml(), "k_thrust_upper"))
    for verb in (
        ("control", "design"),
        (
            "control",
            "decouple",
        ),
    ):
        outcome = swash(*verb, card)
        assert outcome.code == 2
        assert "card.toml: k_thrust_upper: is missing. Add [parameters.k_thrust_upper]" in outcome.err


def test_what_cannot_be_held_is_named(tmp_path: Path) -> None:
    from swashplate.models.linear.state_space_file import structure, to_toml

    model = structure("six_dof")
    floating = tmp_path / "floating.toml"
    floating.write_text(to_toml(model.with_values({"Zcol": 0.0, "Zr": 0.0})))
    outcome = swash("control", "design", floating, "--method", "lqr")
    assert outcome.code == 2
    assert "no input moves" in outcome.err
    assert "it cannot be stabilised" in outcome.err
    outcome = swash("control", "design", "six_dof", "--sensors", "gyro@100")
    assert outcome.code == 2
    assert "no sensor sees" in outcome.err
    outcome = swash("control", "design", "heave")
    assert outcome.code == 2
    assert "has no equation for u, v, phi, theta, p, q, r: that is not enough to fly" in outcome.err
    outcome = swash("control", "design", "thirteen_state", "--rate", "20", "--sensors", "mocap@20")
    assert outcome.code == 2
    assert "20 Hz is too slow for the mode" in outcome.err
    assert "1/s (" in outcome.err
