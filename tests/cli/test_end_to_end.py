"""Simulate, identify, validate: the whole chain as a user types it, on a short flight."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from commands import swash

import swashplate as sp
from simulated_flights import FREE, TIE

ASKED = ("--free", ",".join(FREE), "--tie", TIE)
METHOD = ("--method", "output-error")  # nothing disturbs this flight, and it is the quicker one


@pytest.fixture(scope="module")
def fitted(simulated: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("end-to-end") / "fit"
    outcome = swash("identify", "--vehicle", "coax", "--flight", simulated, *ASKED, *METHOD, "--out", out)
    assert outcome.code == 0, outcome.err
    return out


def test_the_truth_is_recovered(fitted: Path) -> None:
    fit, truth = json.loads((fitted / "fit.json").read_text(encoding="utf-8")), sp.vehicle("coax").card.values()
    assert not fit["failed"]
    by_name = {entry["name"]: entry for entry in fit["parameters"]}
    for name in FREE:
        entry = by_name[name]
        assert abs(entry["value"] - truth[name]) < 4.0 * entry["sigma_corrected"], entry


def test_the_model_is_a_vehicle_like_any_other(fitted: Path) -> None:
    model = sp.vehicle(fitted / "model.toml")
    assert model.card.parameters["tau_f_upper"].status == "identified"
    assert swash("vehicles", "show", fitted / "model.toml").code == 0


def test_the_report_is_there(fitted: Path) -> None:
    assert "simulated" in (fitted / "report.html").read_text(encoding="utf-8")


def test_the_model_validates(fitted: Path, simulated: Path) -> None:
    outcome = swash(
        "validate",
        "--model",
        fitted / "model.toml",
        "--flight",
        simulated,
        "--horizons",
        "0.5,1",
        "--every",
        "0.5",
        "--json",
    )
    assert outcome.code == 0, outcome.err
    scores = json.loads(outcome.out)["scores"]
    at = {s["predictor"]: s["fit"] for s in scores if (s["channel"], s["horizon"]) == ("phi", 0.5)}
    assert at["model"] > at["hold"]
