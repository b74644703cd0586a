"""`swash compare`: files side by side, along a flight, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, saying, swash

from swashplate.flights.flight import Flight

MODEL = """
kind = "state-space"
name = "{name}"
[states]
p = "rad/s"
[inputs]
lateral = "1"
[equations]
p = {{p = "Lp", lateral = "8"}}
[outputs.p]
of = {{p = "1"}}
[parameters]
Lp = {{value = {lp}, unit = "1/s"}}
"""


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("models")
    files = (folder / "fast.toml", folder / "slow.toml")
    for file, lp in zip(files, (-4.0, -2.0), strict=True):
        file.write_text(MODEL.format(name=file.stem, lp=lp))
    return files


def test_models_side_by_side(models: tuple[Path, Path], tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    outcome = swash("compare", *models, "--out", page)
    assert (outcome.code, outcome.err) == (0, "")
    assert ["-4.000", "-2.000", "50.0"] in [line.split() for line in outcome.out.splitlines()]
    assert outcome.out.splitlines()[-1] == f"Written: {page}"
    assert "Mismatch J" in page.read_text()
    assert json.loads(swash("compare", *models, "--json").out)["what"] == "models"


def test_models_along_a_flight(models: tuple[Path, Path], tmp_path: Path) -> None:
    stick = np.repeat(np.random.default_rng(0).choice((-1.0, 1.0), 100), 10)
    p = np.convolve(stick, 8.0 / 50.0 * np.exp(-4.0 * np.arange(100) / 50.0))[:1000]
    log, page = tmp_path / "log.csv", tmp_path / "page.html"
    log = Flight.from_arrays(np.arange(1000) / 50.0, {"lateral": stick, "p": p}).save(tmp_path / "log.nc")
    outcome = swash("compare", *models, "--flight", log, "--rate", "50", "--json", "--out", page)
    assert outcome.code == 0
    fits = json.loads(outcome.out)["fit"]["p"]
    assert fits["fast.toml"] > 90.0 > fits["slow.toml"]
    assert "Models along the flight" in page.read_text()


def test_what_is_refused(models: tuple[Path, Path], tmp_path: Path) -> None:
    assert "1 given, expected two or more" in one_message(swash("compare", models[0]))
    assert "expected .html" in one_message(swash("compare", *models, "--out", tmp_path / "a.pdf"))
    assert "is neither a vehicle's name nor a file" in one_message(swash("compare", models[0], tmp_path / "no.toml"))
    assert "Give flights too" in one_message(swash("compare", *models, "--settings", saying(outputs="p")))
