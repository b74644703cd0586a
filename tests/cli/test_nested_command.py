"""`swash identify --nested`: what it says of physics that a flight asks for, and what it leaves behind."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from commands import swash

from rolling import biased, gusty
from swashplate.models.catalogue import EQUATIONS

HOW = ("--free", "Lb,tau,A", "--outputs", "p,pdot,ay", "--method", "filter-error", "--rate", "50")


@pytest.mark.parametrize(
    ("offset", "verdict"), [(0.05, "needed"), pytest.param(0.0, "not needed", marks=pytest.mark.proof)]
)
def test_it_says_by_how_many_sigmas_a_part_moves_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, offset: float, verdict: str
) -> None:
    monkeypatch.setitem(EQUATIONS._own, "roll", "rolling:biased_of")
    card, log, out = tmp_path / "roll.toml", tmp_path / "flight.nc", tmp_path / "out"
    biased().save(card)
    gusty(offset=offset).save(log)
    outcome = swash("identify", "--flight", log, "--vehicle", card, "--nested", *HOW, "--out", out)
    assert outcome.code == 0, outcome.err
    head = "Missing physics: stick that stands off centre." if offset else "No missing physics among what was tried."
    assert head in outcome.out
    assert ("freeing it moves" in outcome.out) == bool(offset)
    (told,) = json.loads((out / "nested.json").read_text(encoding="utf-8"))["tests"]
    assert told["verdict"] == verdict
    assert (told["adjusted"] < 0.01) == bool(offset)
    assert verdict in (out / "report.html").read_text(encoding="utf-8")
    assert (out / "fit.json").is_file()
