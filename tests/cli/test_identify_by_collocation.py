"""`swash identify --method collocation` on a model file, from reading to the model that it writes."""

from __future__ import annotations

from pathlib import Path

import pytest
from commands import one_message, swash

import swashplate as sp
from rolling import SAME, TRUTH, gusty


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> tuple[str | Path, ...]:
    folder = tmp_path_factory.mktemp("roll")
    gusty().save(folder / "flight.nc")
    (folder / "roll.toml").write_text(SAME, encoding="utf-8")
    return ("identify", "--vehicle", folder / "roll.toml", "--flight", folder / "flight.nc", "--rate", "50")


@pytest.mark.proof  # the estimator itself is in tests/unit/identification/time/test_collocation.py
def test_a_model_file_is_identified_by_collocation(asked: tuple[str | Path, ...], tmp_path: Path) -> None:
    done = swash(*asked, "--method", "collocation", "--outputs", "p,pdot,ay", "--out", tmp_path / "fit")
    assert done.code == 0, done.err
    assert "roll by collocation: converged" in done.out
    fit = sp.load(tmp_path / "fit" / "fit.json")
    model = sp.vehicle(tmp_path / "fit" / "model.toml")
    for name, value in TRUTH.items():
        assert abs(fit[name].value - value) < 3.0 * fit[name].sigma
        assert model.structure is not None
        assert model.structure.parameters[name].value == fit[name].value
    assert "identified in time" in (tmp_path / "fit" / "report.html").read_text(encoding="utf-8")


def test_a_method_that_is_none_is_refused(asked: tuple[str | Path, ...]) -> None:
    message = one_message(swash(*asked, "--method", "magic"))
    assert "expected one of" in message
    assert "collocation" in message
