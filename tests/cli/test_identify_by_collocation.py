"""`swash identify --method collocation` on a model file, from reading to the model that it writes."""

from __future__ import annotations

from pathlib import Path

from commands import one_message, swash

import swashplate as sp
from rolling import SAME, TRUTH, gusty


def test_a_model_file_is_identified_by_collocation(tmp_path: Path) -> None:
    gusty().save(tmp_path / "flight.nc")
    (tmp_path / "roll.toml").write_text(SAME, encoding="utf-8")
    asked = ("identify", "--vehicle", tmp_path / "roll.toml", "--flight", tmp_path / "flight.nc", "--rate", "50")
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
    message = one_message(swash(*asked, "--method", "magic"))
    assert "expected one of" in message
    assert "collocation" in message
