"""`swash maneuver design`: its arguments, its tables, its files, and what it refuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from commands import one_message, swash

import swashplate as sp
from swashplate.api.designed_maneuver import DesignedManeuver, Offer
from swashplate.api.verbs.maneuver import DesignManeuver
from swashplate.flights.maneuvers.composed import composed
from swashplate.flights.maneuvers.series import parse

ASKED = ("maneuver", "design", "--vehicle", "coax", "--unknown", "tau_f_upper, linkage_lower")
PEAKS = {"attitude": 5.0, "rate": 50.0, "place": 0.5}


def made(best: str = "multisine") -> DesignedManeuver:
    design = composed(
        {"roll": {5: 1.0, 20: 1.0}, "pitch": {6: 1.0, 21: 1.0}}, duration=10.0, peak={"roll": 0.2, "pitch": 0.1}
    )
    sweep = parse("sweep:roll,0.8-8Hz,5s,0.2")
    good, bad = {"tau_f_upper": 0.1, "linkage_lower": 0.001}, {"tau_f_upper": 0.4, "linkage_lower": 0.002}
    offers = (
        Offer("multisine", (design,), 10.0, good if best == "multisine" else bad, PEAKS),
        Offer("sweep", (sweep,), 10.0, bad if best == "multisine" else good, PEAKS),
    )
    limits = {"attitude": 20.0, "rate": 120.0, "place": 3.0, "seconds": 10.0}
    names = ("tau_f_upper", "linkage_lower")
    return DesignedManeuver(
        sp.vehicle("coax"), names, offers, ((5.0, bad), (10.0, good)), limits, "D", "average", 5, 0.3, 100.0
    )


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the verb was asked; it answers at once."""
    found: dict[str, Any] = {"best": "multisine"}

    def stand_in(question: DesignManeuver, say: Any) -> DesignedManeuver:
        found.update(vars(question))
        return made(found["best"])

    monkeypatch.setattr("swashplate.api.design_maneuver.design_for", stand_in)
    return found


def test_the_command_is_the_call(asked: dict[str, Any], tmp_path: Path) -> None:
    more = (
        "--limits",
        "attitude=6,seconds=10",
        "--band",
        "0.5-8Hz",
        "--axes",
        "roll,pitch",
        "--out",
        tmp_path / "d.csv",
    )
    outcome = swash(*ASKED, *more)
    assert (outcome.code, outcome.err) == (0, "")
    for words in ("multisine", "What each second buys", "FLIGHT CARD", "roll at most 0.2, pitch at most 0.1", "d.txt"):
        assert words in outcome.out
    assert asked["unknown"] == ("tau_f_upper", "linkage_lower")
    assert asked["limits"] == {"attitude": 6.0, "seconds": 10.0}
    assert asked["band"] == (0.5, 8.0)
    assert asked["axes"] == ("roll", "pitch")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["d.csv", "d.txt"]


def test_a_script_is_written_where_the_design_can_be_flown_as_angles(asked: dict[str, Any], tmp_path: Path) -> None:
    outcome = swash(*ASKED, "--out", tmp_path / "d.lua")
    assert (outcome.code, outcome.err) == (0, "")
    assert "d.lua" in outcome.out
    assert "local LINES" in (tmp_path / "d.lua").read_text(encoding="utf-8")
    asked["best"] = "sweep"
    assert "the best offer is the sweep" in one_message(swash(*ASKED, "--out", tmp_path / "e.lua"))
    assert not (tmp_path / "e.lua").exists()


def test_a_sweep_that_is_best_comes_with_ardupilots_parameters(asked: dict[str, Any], tmp_path: Path) -> None:
    asked["best"] = "sweep"
    assert swash(*ASKED, "--out", tmp_path / "d.csv").code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["d.csv", "d.param", "d.txt"]
    assert "SID_AXIS,10" in (tmp_path / "d.param").read_text(encoding="utf-8").replace(" ", "")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--limits", "attitude"), "'attitude' is not NAME=VALUE"),
        (("--limits", "attitude=steep"), "'steep' is not a number"),
        (("--limits", "place=2,seconds=9,place=3"), "--limits: place is given twice"),
        (("--band", "fast"), "'fast' is not LOW-HIGH"),
        (("--out", "design.txt"), "expected one of .csv, .lua"),
    ],
)
def test_what_cannot_be_read_is_refused(asked: dict[str, Any], more: tuple[str, ...], words: str) -> None:
    assert words in one_message(swash(*ASKED, *more))
    assert "unknown" not in asked


def test_a_design_that_nothing_allows_ends_with_code_two() -> None:
    outcome = swash(*ASKED, "--limits", "seconds=40,battery=30")
    assert outcome.code == 2
    assert "battery: 40 s and 6 s of hover are more than the battery's 30 s" in outcome.err
