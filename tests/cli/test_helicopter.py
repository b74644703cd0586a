"""Verbs for single-rotor helicopters: trim, linearize, derivatives, simulate, vehicles new; and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, swash

from swashplate.flights.flight import Flight
from swashplate.vehicles.card import read_card
from swashplate.vehicles.catalogue import vehicle
from swashplate.vehicles.helicopter_parameters import MEANING


def test_trim_at_one_speed_and_over_a_range(tmp_path: Path) -> None:
    assert "theta0" in swash("trim", "raptor50", "--speed", "5").out
    page = tmp_path / "curves.html"
    document = json.loads(swash("trim", "raptor50", "--speed", "0-12/4", "--json", "--plot", page).out)
    assert [entry["speed"] for entry in document["trims"]] == [0.0, 4.0, 8.0, 12.0]
    assert max(entry["residual"] for entry in document["trims"]) < 1e-10
    text = page.read_text(encoding="utf-8")
    assert "root-locus" in text
    assert "trim-curves" in text
    table = swash("trim", "raptor50", "--speed", "0-8/8").out.splitlines()
    assert len(table) == 3
    assert "B1 [deg]" in table[0]


@pytest.mark.parametrize("verb", ["trim", "linearize", "derivatives"])
def test_every_verb_says_where_it_is_not_to_be_believed(verb: str) -> None:
    outcome = swash(verb, "raptor50", "--climb=-4")
    assert outcome.code == 0
    assert "vortex ring" in outcome.err


def test_weight_altitude_wind_numbers_and_options_change_the_trim() -> None:
    def collective(*extra: str) -> float:
        document = json.loads(swash("trim", "raptor50", "--json", *extra).out)
        return float(document["trims"][0]["inputs"]["theta0"])

    plain = collective()
    assert collective("--mass", "5.5") > plain
    assert collective("--altitude", "2500") > plain
    assert collective("--wind=-6,0,0") < plain
    assert collective("--set", "rotor_chord=0.06") < plain
    assert collective("--option", "inflow=pitt-peters") == pytest.approx(plain, rel=1e-3)


def test_linearize_tells_modes_and_matrices() -> None:
    assert "+0.761" in swash("linearize", "raptor50").out or "eigenvalue" in swash("linearize", "raptor50").out
    document = json.loads(swash("linearize", "raptor50", "--json").out)
    model = document["models"][0]
    assert np.array(model["A"]).shape == (14, 14)
    assert model["inputs"] == ["theta0", "B1", "A1", "theta0T"]


def test_derivatives_by_contributor_in_both_units(tmp_path: Path) -> None:
    metric = json.loads(swash("derivatives", "raptor50", "--json").out)["tables"][0]["derivatives"]
    feet = json.loads(swash("derivatives", "raptor50", "--json", "--imperial").out)["tables"][0]["derivatives"]
    assert metric["Mu"]["value"] * 0.3048 == pytest.approx(feet["Mu"]["value"])
    assert feet["Mu"]["unit"] == "1/(ft s)"
    assert sum(metric["Yv"]["by"].values()) == pytest.approx(metric["Yv"]["value"])
    page = tmp_path / "derivatives.html"
    swash("derivatives", "raptor50", "--speed", "0-8/4", "--plot", page)
    assert "Derivatives by contributor" in page.read_text(encoding="utf-8")


def test_primed_rows_mix_roll_and_yaw_by_the_product_of_inertia() -> None:
    plain, mixed = (
        json.loads(swash("derivatives", "lynx", "--json", *extra).out)["tables"][0]["derivatives"]
        for extra in ((), ("--primed",))
    )
    assert mixed["Mq"] == plain["Mq"]
    card = vehicle("lynx").card.values()
    whole = 1.0 - card["inertia_xz"] ** 2 / (card["inertia_xx"] * card["inertia_zz"])
    expected = (plain["Lp"]["value"] + card["inertia_xz"] / card["inertia_xx"] * plain["Np"]["value"]) / whole
    assert mixed["Lp"]["value"] == pytest.approx(expected)


def test_uncertainty_bounds_hold_the_cards_value_and_repeat() -> None:
    arguments = ("derivatives", "raptor50", "--uncertainty", "--draws", "20", "--json")
    first, second = swash(*arguments), swash(*arguments)
    assert first.out == second.out
    found = json.loads(first.out)["tables"][0]["derivatives"]
    for name in ("Lp", "Mq", "Zw", "Xu"):
        assert found[name]["5 %"] < found[name]["value"] < found[name]["95 %"]
    assert "5 % and 95 % bounds of 20 samples" in swash(*arguments[:-1]).out


def test_a_sweep_in_hover_is_flown_and_saved(tmp_path: Path) -> None:
    out = tmp_path / "sweep.nc"
    outcome = swash("simulate", "--vehicle", "raptor50", "--maneuver", "doublet:pitch,0.5s,0.03", "--out", out)
    assert outcome.code == 0, outcome.err
    flight = Flight.load(out)
    assert np.ptp(flight.values("B1")) > 0.05
    assert np.ptp(flight.values("q")) > np.ptp(flight.values("p"))


def test_a_new_card_is_commented_and_flies(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    outcome = swash("vehicles", "new", mine, "--mass", "8", "--radius", "0.78", "--title", "Mine", "--rotation", "ccw")
    assert outcome.code == 0, outcome.err
    text, card = mine.read_text(encoding="utf-8"), read_card(mine)
    assert all(f"# {meaning}" in text for meaning in MEANING.values())
    assert card.values()["mass"] == 8.0
    assert card.parameters["rotor_chord"].status == "assumed"
    assert swash("trim", mine, "--speed", "5").code == 0
    assert "exists already" in one_message(swash("vehicles", "new", mine, "--mass", "8", "--radius", "0.78"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("trim", "raptor50", "--speed", "50"), "but its limit is"),
        (("trim", "raptor50", "--speed", "9-3"), "no ascending range"),
        (("trim", "raptor50", "--speed", "fast"), "is not a number"),
        (("trim", "raptor50", "--altitude", "20000"), "expected -500 to 11000"),
        (("trim", "raptor50", "--set", "rotor_cord=0.05"), "has no parameter rotor_cord"),
        (("trim", "raptor50", "--set", "inertia_xx=0.9"), "more than the two others together"),
        (("trim", "raptor50", "--set", "rotor_chord=55"), "lies outside"),
        (("trim", "raptor50", "--option", "flybar=true"), "is not an option"),
        (("trim", "raptor51"), "neither a vehicle's name nor a file"),
        (("derivatives", "coax"), "needs a single-rotor card"),
        (("derivatives", "raptor50", "--uncertainty", "--speed", "0-5"), "takes one speed"),
        (("derivatives", "raptor50", "--uncertainty", "--primed"), "has no bounds"),
        (("trim", "raptor50", "--option", "engine_lag=true"), "needs a rotor speed that the engine can change"),
        (("trim", "raptor50", "--set", "rotor_chord=0"), "lies outside"),
        (("trim", "raptor50", "--set", "inertia_xx=-0.1"), "lies outside"),
        (("trim", "raptor50", "--wind", "3,4"), "is not 3 numbers"),
        (("trim", "raptor50", "--set", "mass=nan"), "is not a number"),
        (("trim", "raptor50", "--mass", "60"), "lies outside"),
        (("trim", "raptor50", "--turn", "20", "--wind", "3,0,0"), "a turn in wind is no steady flight"),
        (("trim", "raptor50", "--speed", "3", "--plot", "x.html"), "needs a range of speeds"),
        (("vehicles", "new", "x.toml", "--mass=-1", "--radius", "1"), "expected both above 0"),
    ],
)
def test_what_is_refused(arguments: tuple[str, ...], said: str) -> None:
    assert said in one_message(swash(*arguments))


def test_a_card_with_a_missing_or_wrongly_united_number(tmp_path: Path) -> None:
    text = swash("vehicles", "new", tmp_path / "a.toml", "--mass", "5", "--radius", "0.7")
    assert text.code == 0
    whole = (tmp_path / "a.toml").read_text(encoding="utf-8")
    (tmp_path / "unit.toml").write_text(whole.replace('unit = "kg"', 'unit = "lb"'), encoding="utf-8")
    (tmp_path / "missing.toml").write_text(whole.replace("[parameters.mass]", "[parameters.weight]"), encoding="utf-8")
    assert "unit is 'lb', expected 'kg'" in one_message(swash("trim", tmp_path / "unit.toml"))
    assert "mass: is missing" in one_message(swash("trim", tmp_path / "missing.toml"))
