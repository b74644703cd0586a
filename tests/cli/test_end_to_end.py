"""Simulate, identify, validate: the whole chain as a user types it, on a short flight."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from commands import saying, swash

import swashplate as sp
from simulated_flights import FREE, TIE
from swashplate.flights.tabular import write_csv

ASKED = ("--free", ",".join(FREE), "--settings", f"tie={TIE}")
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
    by_name = {entry["name"]: entry for entry in fit["estimates"]}
    for name in FREE:
        entry = by_name[name]
        assert abs(entry["value"] - truth[name]) < 4.0 * entry["sigma_corrected"], entry


def test_the_model_is_a_vehicle_like_any_other(fitted: Path) -> None:
    model = sp.vehicle(fitted / "model.toml")
    assert model.card.parameters["tau_f_upper"].status == "identified"
    assert swash("vehicle", "show", fitted / "model.toml").code == 0


def test_the_report_is_there(fitted: Path) -> None:
    assert "simulated" in (fitted / "report.html").read_text(encoding="utf-8")


def test_the_model_validates(fitted: Path, simulated: Path) -> None:
    outcome = swash(
        "validate",
        "--vehicle",
        fitted / "model.toml",
        "--flight",
        simulated,
        "--horizons",
        "0.5,1",
        "--json",
        "--settings",
        saying(every=0.5),
    )
    assert outcome.code == 0, outcome.err
    scores = json.loads(outcome.out)["scores"]
    at = {s["predictor"]: s["fit"] for s in scores if (s["channel"], s["horizon"]) == ("phi", 0.5)}
    assert at["model"] > at["hold"]


def test_unix_time_gives_the_same_fit(fitted: Path, simulated: Path, tmp_path: Path) -> None:
    """A CSV stamped in nanoseconds since 1970, where float64 steps by 256 ns: same numbers as with small times."""
    flight = sp.read(simulated).condition(rate=100, cutoff=0, derive=False)
    (plain,) = write_csv(flight, tmp_path / "plain.csv")
    header, *rows = plain.read_text(encoding="utf-8").splitlines()
    cut = [row.split(",", 1) for row in rows]
    lines = [f"{1_772_681_685_000_000_000 + round(1e9 * float(t))},{rest}" for t, rest in cut]
    path = tmp_path / "epoch.csv"
    path.write_text("\n".join([header.replace("time [s]", "time [ns]"), *lines, ""]), encoding="utf-8")
    assert swash("inspect", path).code == 0
    values = []
    for log in (plain, path):
        out = tmp_path / f"fit-{log.stem}"
        outcome = swash("identify", "--vehicle", "coax", "--flight", log, *ASKED, *METHOD, "--out", out)
        assert outcome.code == 0, outcome.err
        fit = json.loads((out / "fit.json").read_text(encoding="utf-8"))
        values.append([entry["value"] for entry in fit["estimates"]])
    assert values[1] == pytest.approx(values[0], rel=1e-6)
