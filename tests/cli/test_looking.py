"""Verbs that look and simulate: inspect, vehicles, data, simulate."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import swash

from swashplate.flights.datasets import REGISTRY
from swashplate.flights.example_logs import FOLDER as EXAMPLES
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read
from swashplate.models.card import packaged_cards


def test_inspect_shows_streams_channels_and_problems(simulated: Path) -> None:
    outcome = swash("inspect", simulated)
    assert (outcome.code, outcome.err) == (0, "")
    for part in ("motion", "inputs", "servo_pitch", "problems", "notes"):
        assert part in outcome.out


def test_inspect_as_json(simulated: Path) -> None:
    document = json.loads(swash("inspect", simulated, "--json").out)
    assert {stream["name"] for stream in document["streams"]} == {"motion", "inputs", "battery"}
    assert document["simulated"] is True


def test_a_window_of_a_flight(simulated: Path) -> None:
    document = json.loads(swash("inspect", f"{simulated}@2-5", "--json").out)
    assert document["duration"] == pytest.approx(3.0, abs=0.02)


def test_a_file_whose_name_looks_like_a_window(simulated: Path, tmp_path: Path) -> None:
    odd = tmp_path / "log@2-5"
    odd.write_bytes(simulated.read_bytes())
    assert json.loads(swash("inspect", odd, "--json").out)["duration"] > 9.0


def test_rotor_speed_is_measured_from_vibration_and_saved(tmp_path: Path) -> None:
    time, rng = np.arange(900) / 150.0, np.random.default_rng(1)
    turning = np.exp(-2j * np.pi * 35.0 * time) + 0.5 * rng.standard_normal(900) + 0.5j * rng.standard_normal(900)
    log, out = tmp_path / "log.nc", tmp_path / "out.nc"
    Flight.from_arrays(time, {"phi": 1e-3 * turning.real, "theta": 1e-3 * turning.imag}).save(log)
    outcome = swash("inspect", log, "--rotor-speed", "--settings", "line=omega_upper=-40..-30", "--out", out)
    assert outcome.code == 0
    assert "omega_upper: 219." in outcome.out
    assert np.mean(Flight.load(out).values("omega_upper")) == pytest.approx(2 * np.pi * 35.0, abs=0.4)
    refused = swash("inspect", log, "--rotor-speed", "--settings", "line=omega_lower=30..40")
    assert refused.code != 0
    assert "no line stands out" in refused.err
    assert "is no line" in swash("inspect", log, "--rotor-speed", "--settings", "line=omega_lower").err


def test_vehicles_are_listed_with_what_they_are() -> None:
    for arguments in (
        (
            "vehicle",
            "list",
        ),
        ("vehicle", "list"),
    ):
        outcome = swash(*arguments)
        assert outcome.code == 0
        for name, card in packaged_cards().items():
            assert name in outcome.out
            assert card.title in outcome.out


def test_a_vehicle_is_shown_with_every_number() -> None:
    outcome, card = swash("vehicle", "show", "coax"), packaged_cards()["coax"]
    assert outcome.code == 0
    assert card.trust in outcome.out
    for name, parameter in card.parameters.items():
        assert name in outcome.out
        assert parameter.source in outcome.out


def test_a_vehicle_as_json_and_its_hover() -> None:
    document, card = json.loads(swash("vehicle", "show", "coax", "--json", "--trim").out), packaged_cards()["coax"]
    assert {name: entry["value"] for name, entry in document["parameters"].items()} == card.values()
    hover = document["trim"]["states"]
    weight = card.values()["mass"] * 9.81
    thrust = sum(card.values()[f"k_thrust_{r}"] * hover[f"omega_{r}"] ** 2 for r in ("upper", "lower"))
    assert thrust == pytest.approx(weight, rel=1e-2)  # the two discs are level: the air's density differs a little
    assert "eigenvalue" in swash("vehicle", "show", "coax", "--trim").out


def test_data_sets_are_listed_with_where_they_are() -> None:
    rows = json.loads(swash("data", "list", "--json").out)
    shipped = {("examples", file.name) for file in EXAMPLES.glob("*.bin")}
    listed = {(n, f) for n, data in REGISTRY.items() for f in data.files} | shipped
    assert {(row["name"], row["file"]) for row in rows} == listed
    assert len(shipped) == 3
    text = swash("data", "list").out
    assert all(row["file"] in text for row in rows)


def _simulate(out: Path, *extra: str) -> None:
    outcome = swash("simulate", "--vehicle", "coax", "--maneuver", "doublet:roll,0.5s,0.1", "--out", out, *extra)
    assert outcome.code == 0, outcome.err


def test_simulate_writes_a_flight_that_can_be_read(tmp_path: Path) -> None:
    _simulate(tmp_path / "a.nc")
    flight = Flight.load(tmp_path / "a.nc")
    assert flight.provenance.simulated
    assert np.ptp(flight.values("servo_roll")) > 0.15
    assert np.ptp(flight.values("phi")) > np.ptp(flight.values("theta"))


def test_the_same_seed_gives_the_same_flight_and_another_does_not(tmp_path: Path) -> None:
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        _simulate(tmp_path / f"{name}.nc", "--sensors", "real", "--seed", seed, "--quiet")
    a, b, c = (Flight.load(tmp_path / f"{name}.nc") for name in "abc")
    assert np.array_equal(a.values("x"), b.values("x"))
    assert a.values("x").shape != c.values("x").shape or not np.array_equal(a.values("x"), c.values("x"))


def test_simulate_into_csv_and_in_wind(tmp_path: Path) -> None:
    _simulate(tmp_path / "calm.csv")
    _simulate(tmp_path / "windy.csv", "--wind", "1,0,0")
    calm, windy = read(tmp_path / "calm.csv"), read(tmp_path / "windy.csv")
    assert np.all(windy.values("wind_north") == 1.0)
    assert not np.allclose(calm.values("x"), windy.values("x"))
