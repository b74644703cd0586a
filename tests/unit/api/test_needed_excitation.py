"""What the next flight must have: errors over what may be missed, and the axes that only answered."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import swashplate as sp
from swashplate.errors import SwashError


def _saved(folder: Path, **changed: Any) -> Path:
    floors = [
        {"channel": "phi", "horizon": 1.0, "rms": 0.0195, "moved": 0.05, "fit": 61.0},
        {"channel": "p", "horizon": 1.0, "rms": 0.12, "moved": 0.41, "fit": 71.0},
        {"channel": "p", "horizon": 0.5, "rms": 0.12, "moved": 0.3, "fit": 60.0},
    ]
    verdict = [{"axis": "roll", "level": "good"}, {"axis": "yaw", "level": "cannot be judged"}]
    document = {"kind": "validation", "floors": floors, "verdict": verdict, "not_logged": ["omega_upper"]} | changed
    file = folder / "validation.json"
    file.write_text(json.dumps(document), encoding="utf-8")
    return file


def test_a_channel_must_move_by_its_error_over_what_may_be_missed(tmp_path: Path) -> None:
    """The CoaX: 0.065 rad of roll and 0.4 rad/s of roll rate for 70 %."""
    found = sp.needed_excitation(_saved(tmp_path), fit=70.0, ahead=1.0)
    phi, p = found.movements
    assert (phi.channel, phi.needed) == ("phi", pytest.approx(0.065))
    assert (p.channel, p.needed) == ("p", pytest.approx(0.4))
    assert [row[-1] for row in found.rows()[1]] == ["NO", "yes"]
    assert len(found.further) == 2
    assert found.further[0].startswith("yaw: an independent multisine")
    assert "omega_upper" in found.further[1]


def test_what_was_judged_and_logged_is_not_asked_for_again(tmp_path: Path) -> None:
    verdict = [{"axis": "yaw", "level": "poor", "words": ""}]
    assert sp.needed_excitation(_saved(tmp_path, verdict=verdict, not_logged=[])).further == ()


def test_questions_without_an_answer_are_refused(tmp_path: Path) -> None:
    file = _saved(tmp_path)
    with pytest.raises(SwashError, match=r"is 100 %, expected more than 0 and less than 100"):
        sp.needed_excitation(file, fit=100.0)
    with pytest.raises(SwashError, match=r"is 2 s, and the validation has 0\.5, 1"):
        sp.needed_excitation(file, ahead=2.0)
    with pytest.raises(SwashError, match=r"kind is 'fit', expected 'validation'"):
        sp.needed_excitation(_saved(tmp_path, kind="fit"))
