"""`swash vehicle linearize --out` and `stitch`: from a vehicle to points to one model, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from commands import one_message, swash


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("points")
    for speeds in ("1-3/1", "0-2/2"):  # nothing is left of the first
        outcome = swash("vehicle", "linearize", "crazyflie", "--speed", speeds, "--out", folder)
        assert (outcome.code, outcome.out.splitlines()[-1]) == (0, f"Written: {folder}")
    return folder


def test_points_become_one_vehicle(points: Path, tmp_path: Path) -> None:
    assert sorted(file.name for file in points.iterdir()) == ["at-0.toml", "at-2.toml"]
    made = tmp_path / "stitched.toml"
    outcome = swash("vehicle", "stitch", points, "--out", made)
    assert (outcome.code, outcome.err) == (0, "")
    assert "Derivatives by speed" in outcome.out
    assert outcome.out.splitlines()[-1] == f"Written: {made}"
    told = swash("vehicle", "show", made)
    assert told.code == 0
    assert "Between 0 and 2 m/s ahead" in " ".join(told.out.split())
    assert swash("vehicle", "stitch", points, "--out", made, "--quiet").out == ""


def test_what_is_refused(points: Path, tmp_path: Path, simulated: Path) -> None:
    made, (slow, fast) = tmp_path / "s.toml", sorted(points.iterdir())
    refused = {
        ("vehicle", "stitch", slow, "--out", made): "1 given, expected two or more",
        ("vehicle", "stitch", slow, fast, "--out", tmp_path / "s.json"): "ends in '.json', expected .toml",
        ("vehicle", "stitch", slow, tmp_path / "none.toml", "--out", made): "there is no such file",
        ("vehicle", "stitch", tmp_path, "--out", made): "has no .toml file in it",
        ("vehicle", "stitch", slow, fast, "--out", made, "--trim", simulated): "1 given for 2 points",
        ("vehicle", "stitch", slow, "six_dof_coupled", "--out", made): "states: are",
    }
    for command, words in refused.items():
        assert words in one_message(swash(*command))
    assert not made.exists()
