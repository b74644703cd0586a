"""Cross-validation, bootstrap and sweeps: what they compute and conclude; every conclusion can be the other one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rolling
import swashplate as sp
from swashplate.api.campaigns import worker
from swashplate.api.campaigns.fitting import unusable
from swashplate.api.campaigns.kind import CAMPAIGNS, CampaignFindings, settings_of
from swashplate.api.campaigns.kinds import monte_carlo as of_flights
from swashplate.api.campaigns.kinds.bootstrap import compared, pieces_of
from swashplate.api.campaigns.tasks import Columns, Portion
from swashplate.errors import CampaignError, SwashError

FITS = """
kind = "campaign"
vehicle = "roll.toml"
condition = false
method = "output-error"
outputs = ["p", "pdot", "ay"]
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two flights and the model of their roll."""
    folder = tmp_path_factory.mktemp("refits")
    for name, seed in (("a.nc", 11), ("b.nc", 12)):
        rolling.gusty(seed).save(folder / name)
    (folder / "roll.toml").write_text(rolling.SAME)
    return folder


def found(of: str, table: Columns, **settings: Any) -> CampaignFindings:
    """What a kind says of a table."""
    return CAMPAIGNS[of].findings(settings_of(of, settings), table)


# ---- cross-validation ------------------------------------------------------------------------------------------------
def test_each_flight_is_judged_by_the_fit_of_the_others(place: Path) -> None:
    (place / "x.toml").write_text(FITS + 'of = "cross-validation"\nflights = ["a.nc", "b.nc"]\n')
    tasks = sp.plan_campaign(place / "x.toml").tasks
    assert [task.portion.of for task in tasks] == ["a.nc", "b.nc"]
    table = worker.work(tasks[1])
    fit = sp.identify(
        sp.load(place / "roll.toml").structure,
        rolling.gusty(11),
        method="output-error",
        outputs=rolling.OUTPUTS_OF_ROLL,
    )
    assert table["Lb"][0] == fit["Lb"].value, "b was left out"
    judged = sp.validate(fit, rolling.gusty(12), outputs=rolling.OUTPUTS_OF_ROLL)
    assert table["fit.p"][0] == judged["p"].fit  # type: ignore[index]
    assert str(table["left_out"][0]) == "b.nc"


@pytest.mark.parametrize("far", [False, True])
def test_folds_that_differ_by_more_than_their_bounds_are_told(far: bool) -> None:
    table = {
        "number": np.arange(3), "usable": np.array([1, 1, 1]), "left_out": np.array(["a", "b", "c"]),
        "fit.p": np.array([80.0, 60.0, 70.0]), "Lb": np.array([1.0, 1.1, 0.9]),
        "Lb.sigma": np.full(3, 0.05 if far else 0.2),
    }  # fmt: skip
    says = found("cross-validation", table, vehicle="coax", flights=["a", "b", "c"])
    assert says.tables[0][2] == (("p", "70.0", "8.2", "60.0", "b"),)
    # Jackknife (Efron and Stein 1981): sqrt(2 / 3 (0.1^2 + 0.1^2)).
    assert says.tables[1][2][0][3] == "0.12"
    assert ("differ between flights" in " ".join(says.careful)) == far
    lost = found("cross-validation", table | {"usable": np.array([1, 1, 0])}, vehicle="coax", flights=["a", "b", "c"])
    assert lost.careful[0].startswith("1 fits may not be used")


# ---- bootstrap -------------------------------------------------------------------------------------------------------
def test_row_0_has_every_piece_once_and_others_draw_them(place: Path) -> None:
    (place / "b.toml").write_text(FITS + 'of = "bootstrap"\nflights = ["a.nc"]\npiece = 1.5\ncount = 3\nbatch = 3\n')
    (task,) = sp.plan_campaign(place / "b.toml").tasks
    table = worker.work(task)
    cut = pieces_of(rolling.gusty(11), 1.5)
    assert [len(piece.values("p")) for piece in cut] == [75] * 4
    fit = sp.identify(
        sp.load(place / "roll.toml").structure, cut, method="output-error", outputs=rolling.OUTPUTS_OF_ROLL
    )
    assert table["Lb"][0] == fit["Lb"].value
    assert list(table["pieces"]) == [4, 4, 4]
    assert len(set(table["Lb"])) == 3, "other pieces, other numbers"


@pytest.mark.parametrize(("scale", "verdict"), [(1.0, "as they say"), (2.0, "too narrow"), (0.5, "too wide")])
def test_bounds_are_compared_with_the_scatter(scale: float, verdict: str) -> None:
    values = np.concatenate([[5.0], 5.0 + 0.1 * scale * np.random.default_rng(1).standard_normal(200)])
    table = {
        "number": np.arange(201), "usable": np.ones(201), "pieces": np.full(201, 40), "Lb": values,
        "Lb.sigma": np.full(201, 0.1),
    }  # fmt: skip
    says = found("bootstrap", table, vehicle="coax", flights=["a"])
    assert says.tables[0][2][0][-1] == verdict
    assert any("too narrow" in words for words in says.careful) == (verdict == "too narrow")
    low, ratio, high = compared(values[1:], 0.1, pieces=3)
    assert high > 5.0 * low, "three pieces tell little"
    assert ratio == pytest.approx(np.sqrt(3.0 / 2.0) * np.std(values[1:], ddof=1) / 0.1), "and scatter too little"


# ---- sweeps ----------------------------------------------------------------------------------------------------------
SWEEP: dict[str, Any] = {
    "campaign": "monte-carlo",
    "count": 4,
    "batch": 2,
    "each": {"vehicle": "coax", "design": {"gain": "steady"}},
    "over": {"design.rate": [50, 100], "varies.delay": [0.0, 0.01, 0.02]},
}


def test_a_sweep_flies_each_choice_with_the_same_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    kind, settings = CAMPAIGNS["sweep"], settings_of("sweep", SWEEP)
    parts = kind.parts(settings, Path())
    assert [(part.first, part.count) for part in parts] == [(2 * k, 2) for k in range(12)]
    assert len({part.seed for part in parts}) == 2
    asked = []

    def run(inner: object, settings: Any, portion: Portion, files: object) -> Columns:
        asked.append((settings.design.rate, settings.design.gain, settings.varies.delay, portion))
        return {"lost": np.zeros(portion.count)}

    monkeypatch.setattr(of_flights.FlightsKind, "run", run)
    table = kind.run(settings_of("sweep", {k: v for k, v in SWEEP.items() if k != "over"}), parts[9], {})
    assert asked == [(100.0, "steady", 0.01, Portion(2, 2, parts[1].seed))]
    assert list(table) == ["design.rate", "varies.delay", "lost"]
    assert list(table["varies.delay"]) == [0.01, 0.01]
    longer = {**SWEEP, "over": {**SWEEP["over"], "design.rate": [50, 100, 200]}}
    assert kind.parts(settings_of("sweep", longer), Path())[:12] == parts, "results are kept"


def test_what_a_sweep_says_is_told_by_choice() -> None:
    table = {
        "number": np.arange(24),
        "design.rate": np.repeat([50.0, 100.0], 12),
        "varies.delay": np.tile(np.repeat([0.0, 0.01, 0.02], 4), 2),
        "lost": np.array([0] * 8 + [1] * 4 + [0] * 10 + [1] * 2),
        "place": np.arange(24.0),
    }
    says = found("sweep", table, **SWEEP)
    cells = says.tables[0][2]
    assert [row[:3] for row in cells] == [(r, d, "4") for r in ("50.0", "100.0") for d in ("0.0", "0.01", "0.02")]
    assert cells[2][3].startswith("4 of 4")
    assert [curve.name for curve in says.curves] == ["design.rate = 50.0", "design.rate = 100.0"]
    assert [point[:2] for point in says.curves[1].points] == [(0.0, 0.0), (0.01, 0.0), (0.02, 50.0)]
    low, high = says.curves[1].points[2][2:]
    assert 0.0 < low < 50.0 < high < 100.0
    assert says.worst == "place"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"campaign": "sweep"}, "campaign: is 'sweep', expected one of monte-carlo, "),
        ({"over": {}}, "over: expected one entry or more"),
        ({"over": {"design.rates": [1]}}, "design.rates: is not known here"),
        ({"over": {"vehicle.mass": [1]}}, "there is no table for 'vehicle.mass'"),
        ({"each": {"vehicle": "coax", "count": 3}}, "each.count: 'count' belongs outside of 'each'"),
        ({"keep": ["lost"]}, "keep: leaves out 'design.rate', by which rows are told apart"),
        ({"each": {"vehicle": "coax", "controller": "c.toml"}}, "expected either a controller's file or a table"),
    ],
)
def test_a_sweep_that_means_nothing_is_refused(change: dict[str, Any], said: str) -> None:
    settings = settings_of("sweep", {**SWEEP, **change})
    with pytest.raises(CampaignError) as refused:
        CAMPAIGNS["sweep"].parts(settings, Path())
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("of", "change", "said"),
    [
        ("cross-validation", {"flights": ["a"]}, "flights: expected two or more different logs"),
        ("cross-validation", {"flights": ["a", "a"]}, "flights: expected two or more different logs"),
        ("cross-validation", {"flights": ["a", "b"], "folds": 3}, "folds: is 3, expected 2 to 2"),
        ("bootstrap", {}, "flights: expected one log or more"),
        ("bootstrap", {"flights": ["a"], "piece": -1.0}, "piece: is -1, expected seconds, or 0"),
    ],
)
def test_refits_of_nothing_are_refused(of: str, change: dict[str, Any], said: str) -> None:
    with pytest.raises(CampaignError, match=said):
        CAMPAIGNS[of].parts(settings_of(of, {"vehicle": "coax", **change}), Path())


@pytest.mark.parametrize(
    ("of", "settings"),
    [
        ("recovery", {"maneuver": "hover:4s"}),
        ("multi-start", {"flights": ["a"]}),
        ("cross-validation", {"flights": ["a", "b"]}),
        ("bootstrap", {"flights": ["a"]}),
    ],
)
def test_a_method_that_nobody_has_is_refused_before_anything_is_computed(of: str, settings: dict[str, Any]) -> None:
    with pytest.raises(SwashError, match="method is 'predicton-error', expected one of "):
        CAMPAIGNS[of].parts(settings_of(of, {"vehicle": "coax", "method": "predicton-error", **settings}), Path())


def test_a_sweep_over_methods_is_held_against_those_there_are() -> None:
    each = {"vehicle": "coax", "maneuver": "hover:4s"}
    over = {"method": ["output-error", "predicton-error"]}
    with pytest.raises(SwashError, match="method is 'predicton-error', expected one of "):
        CAMPAIGNS["sweep"].parts(settings_of("sweep", {"campaign": "recovery", "each": each, "over": over}), Path())


def test_the_reason_of_most_unusable_fits_is_told() -> None:
    table: Columns = {"problem": np.array(["", "flat", "it diverged", "flat", ""])}
    usable = np.array([True, False, False, False, False])
    assert unusable(table, usable) == [
        "4 fits may not be used and are in no figure below",
        "their most frequent problem (2 of 4): flat",
    ]
    assert unusable({}, usable) == ["4 fits may not be used and are in no figure below"], "without the column"
    assert unusable(table, usable | True) == []
