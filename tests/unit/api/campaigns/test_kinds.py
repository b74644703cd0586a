"""What each kind of campaign computes and concludes; every conclusion can be the other one."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from scipy.signal import lfilter

import swashplate as sp
from swashplate.api.asking import flight_limits, turbulence
from swashplate.api.campaigns import worker
from swashplate.api.campaigns.fitting import unusable
from swashplate.api.campaigns.kind import CAMPAIGNS, CampaignFindings, settings_of
from swashplate.api.campaigns.kinds import monte_carlo as of_flights
from swashplate.api.campaigns.kinds.fleet import FLEET
from swashplate.api.campaigns.kinds.multi_start import MULTI_START, optima, start_values
from swashplate.api.campaigns.kinds.recovery import RECOVERY, judged
from swashplate.api.campaigns.shares import quantile, share_interval
from swashplate.api.campaigns.tasks import Columns, Portion, portions
from swashplate.api.question import entries
from swashplate.api.verbs.identify import FitTransferFunctions, FitVehicle
from swashplate.api.verbs.simulate import FlyMany
from swashplate.control.draws.spread import Limits
from swashplate.errors import CampaignError
from swashplate.flights.flight import Flight, stream
from swashplate.models.catalogue import from_card


def found(of: str, table: Columns, **settings: object) -> CampaignFindings:
    """What a kind says of a table."""
    kind = CAMPAIGNS[of]
    return kind.findings(msgspec.convert({"kind": "campaign", "of": of, **settings}, kind.schema), table)


# ---- shares and quantiles --------------------------------------------------------------------------------------------
def test_an_interval_of_a_share_is_clopper_and_pearsons() -> None:
    # Clopper and Pearson (1934); 1 - 0.025^(1/n) for none of n.
    assert share_interval(0, 10) == (0.0, pytest.approx(1.0 - 0.025**0.1))
    assert share_interval(10, 10) == (pytest.approx(0.025**0.1), 1.0)
    low, high = share_interval(5, 10)
    assert (low, high) == (pytest.approx(0.1871, abs=1e-4), pytest.approx(0.8129, abs=1e-4))


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_an_interval_of_a_quantile_holds_the_truth_as_often_as_it_says(share: float) -> None:
    random = np.random.default_rng(2)
    truth = -np.log(1.0 - share)  # of the exponential distribution
    ends = np.array([quantile(random.exponential(size=120), share)[1:] for _ in range(250)])
    inside = np.mean((ends[:, 0] <= truth) & (truth <= ends[:, 1]))
    assert 0.95 - 2.5 * np.sqrt(0.05 * 0.95 / 250) < inside < 1.0


def test_a_quantile_of_too_few_says_so() -> None:
    assert quantile(np.arange(20.0), 0.99)[2] == np.inf
    assert quantile(np.array([1.0, np.inf, 2.0]), 0.5)[0] == 2.0
    assert np.isnan(quantile(np.array([]), 0.5)[0])


def test_seeds_of_tasks_are_their_own() -> None:
    parts = portions(count=1000, batch=7, seed=0)
    assert [part.first for part in parts] == list(range(0, 1000, 7))
    assert sum(part.count for part in parts) == 1000
    starts = np.sort([part.seed for part in parts])
    assert np.diff(starts).min() > 10_000_000, "seeds are counted up within a task, and by millions between sources"
    assert not {p.seed for p in parts} & {p.seed for p in portions(count=1000, batch=7, seed=1)}

    with pytest.raises(CampaignError, match=r"count: 9,007,199,254,740,992 rows in tasks of 2 are more than 100,000"):
        portions(count=2**53, batch=2, seed=0)


# ---- flights ---------------------------------------------------------------------------------------------------------
FLIGHTS: dict[str, Any] = {"vehicle": "coax", "controller": "c.toml", "maneuver": "hover:10s"}


def test_flights_are_asked_for_as_the_file_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    questions: list[FlyMany] = []
    spread = SimpleNamespace(
        lost_after=np.array([np.inf, 1.5]),
        values={"lean": np.array([0.1, np.inf]), "place": np.array([1.0, np.inf])},
        place_rms=np.array([0.5, np.inf]),
    )

    def flown(asked: FlyMany) -> SimpleNamespace:
        questions.append(asked)
        return SimpleNamespace(spread=spread, drawn={"mass": np.array([0.3, 0.4])})

    monkeypatch.setattr(FlyMany, "answer", flown)
    varies = {"gusts": "indoor=0.3", "vary": {"mass": "5%"}, "payload": 0.01, "fit": "fit.json"}
    document = {**FLIGHTS, **varies, "limit": {"lean": "30deg", "place": "none"}, "command_bits": 8}
    settings: Any = settings_of("monte-carlo", document)
    files = {"c.toml": tmp_path / "c.toml", "fit.json": tmp_path / "fit.json"}
    table = of_flights.MONTE_CARLO.run(settings, Portion(4, 2, 77), files)
    assert list(table) == ["lost_after", "lost", "lean", "place", "place_rms", "drawn.mass"]
    assert list(table["lost"]) == [0, 1]
    (asked,) = questions
    assert asked.vehicle.name == "coax"
    assert asked.controller == tmp_path / "c.toml"
    assert (asked.seed, asked.count, asked.command_bits) == (77, 2, 8)
    assert turbulence(asked.gusts).sigma[0] == 0.3
    assert (asked.fit, asked.vary, asked.payload) == (tmp_path / "fit.json", {"mass": "5%"}, 0.01)
    assert flight_limits(asked.limit) == Limits(lean=np.radians(30.0), place=np.inf)
    says = found("monte-carlo", table, **document)
    assert says.summary[0][1].startswith("1 of 2 (50 %")
    assert (says.worst, says.again) == ("place", ".nc")
    assert [entry for entry, _ in of_flights.MONTE_CARLO.files(settings)] == ["vehicle", "controller", "fit"]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"gusts": "indoors"}, "is 'indoors', expected none"),
        ({"limit": {"leaning": 3.0}}, "'leaning' is no limit"),
        ({"maneuver": "loop"}, "loop"),
    ],
)
def test_a_file_of_flights_that_means_nothing_is_refused(wrong: dict[str, Any], said: str) -> None:
    settings: Any = settings_of("monte-carlo", {**FLIGHTS, **wrong})
    with pytest.raises(sp.SwashError, match=said):
        CAMPAIGNS["monte-carlo"].parts(settings, Path())


# ---- recoveries ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("scale", "verdict"), [(1.0, "as they say"), (3.0, "too narrow"), (0.2, "too wide")])
def test_bounds_are_judged(scale: float, verdict: str) -> None:
    off = scale * np.random.default_rng(4).standard_normal(400)
    table = {"Lb.off": off, "usable": np.ones(400, dtype=np.int64)}
    says = found("recovery", table, vehicle="coax", maneuver="hover:1s")
    assert says.tables[0][2][0][-1] == verdict
    assert any("too narrow: Lb" in words for words in says.careful) == (verdict == "too narrow")


def test_lost_fits_are_in_no_share_and_said() -> None:
    off = np.concatenate([np.zeros(30), np.full(30, np.nan)])
    usable = np.repeat([1, 0], 30)
    says = found("recovery", {"Lb.off": off, "usable": usable}, vehicle="coax", maneuver="hover:1s")
    assert says.careful[0] == "30 fits may not be used and are in no figure below"
    assert says.summary[0][1].startswith("30 of 60")
    assert says.tables[0][2][0][1] == "100.0"
    assert judged(0, 0) == "nothing is known"
    assert judged(9, 10) == "as they say", "ten fits do not tell 90 from 95 %"


def test_a_start_beyond_all_sense_is_refused() -> None:
    settings = msgspec.convert(
        {"kind": "campaign", "of": "recovery", "vehicle": "coax", "maneuver": "hover:1s", "start": 1.0}, RECOVERY.schema
    )
    with pytest.raises(CampaignError, match="start: is 1, expected 0 to less than 1"):
        RECOVERY.parts(settings, Path())


# ---- starts ----------------------------------------------------------------------------------------------------------
def test_starts_are_sorted_by_the_optimum_they_end_at() -> None:
    cost = np.array([5.0, 1.05, np.inf, 1.0, 5.04, 9.0])
    assert optima(cost, same=0.1) == [[3, 1], [0, 4], [5]]
    table = {
        "number": np.arange(6), "cost": cost, "usable": np.array([1, 1, 1, 1, 1, 0]), "start.Lb": np.ones(6),
        "Lb": np.arange(6.0),
    }  # fmt: skip
    says = found("multi-start", table, vehicle="coax", flight=["a"])
    assert says.summary[0][1] == "1, number 3"
    assert says.summary[1][1].startswith("2 of 6")
    assert says.summary[2][1].startswith("2 of 6"), "an infinite cost, and one that may not be used"
    assert says.tables[0][2][:2] == (("1", "1", "2", "3"), ("2", "5", "2", "0"))
    assert says.careful == ()
    alone = found("multi-start", table | {"cost": np.array([5, 1, 3, 7, 9, 11.0])}, vehicle="coax", flight=["a"])
    assert "reached by one start only" in alone.careful[0]
    none = found("multi-start", table | {"usable": np.zeros(6)}, vehicle="coax", flight=["a"])
    assert none.careful == ("6 fits may not be used and are in no figure below",)
    assert MULTI_START.rows == "fit"


# ---- logs ------------------------------------------------------------------------------------------------------------
def log(path: Path, *, noise: float, seed: int) -> None:
    """A log of a sweep of 60 s at 50 Hz through 4 / (s + 4), with noise on what it answers."""
    random, dt = np.random.default_rng(seed), 0.02
    time = dt * np.arange(3000)
    stick = np.sin(2 * np.pi * (0.1 * time + (3.0 - 0.1) / 120.0 * time**2))
    pole = np.exp(-4.0 * dt)
    p = lfilter([0.0, 1.0 - pole], [1.0, -pole], stick) + noise * random.standard_normal(3000)
    Flight({"log": stream(time, {"stick": stick, "p": p}, {"stick": "1"})}).save(path)


def test_a_fleet_of_logs_is_one_table(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    log(logs / "a.nc", noise=0.01, seed=1)
    log(logs / "b.nc", noise=20.0, seed=2)
    (logs / "c.nc").write_bytes(b"this is no log")
    (logs / "notes.txt").write_text("not asked for")
    file = tmp_path / "fleet.toml"
    text = 'kind = "campaign"\nof = "fleet"\nfolder = "logs"\npattern = "*.nc"\ninput = "stick"\noutput = "p"\n'
    file.write_text(text + 'rate = 50\nform = "0/1"\nband = [0.2, 2.5]\n')
    made = sp.plan_campaign(file)
    assert [Path(task.portion.of).name for task in made.tasks] == ["a.nc", "b.nc", "c.nc"]
    parts = [worker.work(task) for task in made.tasks]
    table = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    assert all(part.keys() == parts[0].keys() for part in parts)
    assert table["verdict"][0] == "good"
    assert table["K"][0] == pytest.approx(4.0, rel=0.05)
    assert table["pole"][0] == pytest.approx(4.0, rel=0.05)
    assert table["verdict"][1].startswith("no response: ")
    assert table["verdict"][2].startswith("cannot be read: ")
    assert np.isnan(table["K"][1:]).all()
    says = found("fleet", table, folder="logs", input="stick", output="p", form="0/1")
    assert says.summary[0][1].startswith("1 of 3")
    assert dict(says.tables[0][2]) == {"good": "1", "no response": "1", "cannot be read": "1"}
    poor = worker.work(sp.plan_campaign(_with(file, "largest_cost = 1e-9")).tasks[0])
    assert poor["verdict"][0].startswith("poor fit: J = ")
    log(logs / "a.nc", noise=0.02, seed=3)
    with pytest.raises(CampaignError, match=r"a\.nc: is not the log that the campaign was begun with"):
        worker.work(made.tasks[0])
    with pytest.raises(CampaignError, match=r"has no file '\*\.bin'"):
        sp.plan_campaign(_with(file, "", pattern="*.bin"))
    assert FLEET.rows == "log"


def _with(file: Path, line: str, *, pattern: str = "*.nc") -> Path:
    other = file.with_name("other.toml")
    other.write_text(file.read_text().replace("*.nc", pattern) + line + "\n")
    return other


# ---- the page --------------------------------------------------------------------------------------------------------
def test_the_files_of_the_page_are_ones_that_their_kinds_take(tmp_path: Path) -> None:
    page = (Path(__file__).parents[4] / "docs" / "howto" / "campaigns.md").read_text(encoding="utf-8")
    written = re.findall(r"<!-- file: (\S+) -->\n```toml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "logs").mkdir()
    for name in ("hold.toml", "fit.json", "flight.nc", "logs/a.bin"):
        (tmp_path / name).write_bytes(b"")
    rows = {}
    for name, text in written:
        (tmp_path / name).write_text(text)
        made = sp.plan_campaign(tmp_path / name)
        rows[made.of] = made.rows
    assert rows == {
        "monte-carlo": 100_000, "recovery": 200, "multi-start": 1000, "fleet": 1,
    }  # fmt: skip
    assert set(rows) == set(CAMPAIGNS), "every kind is shown"


def test_a_number_that_is_zero_starts_about_it_by_its_own_spread() -> None:
    coax = sp.vehicle("coax")
    named = replace(coax.card.parameters["gyroscopic"], value=0.0, sigma=0.01)
    known = from_card(replace(coax.card, parameters={**coax.card.parameters, "gyroscopic": named}))
    starts = [start_values(known, ("gyroscopic",), factor=3.0, seed=seed)[0] for seed in range(20)]
    assert 0.01 < max(np.abs(starts)) <= 0.03


@pytest.mark.parametrize(
    ("of", "settings"), [("recovery", {"maneuver": "hover:4s"}), ("multi-start", {"flight": ["a"]})]
)
def test_a_method_that_nobody_has_is_refused_before_anything_is_computed(of: str, settings: dict[str, Any]) -> None:
    with pytest.raises(sp.SwashError, match="method is 'predicton-error', expected one of "):
        CAMPAIGNS[of].parts(settings_of(of, {"vehicle": "coax", "method": "predicton-error", **settings}), Path())


def test_files_of_fits_and_logs_have_the_words_of_identify() -> None:
    for of, question in (("recovery", FitVehicle), ("multi-start", FitVehicle), ("fleet", FitTransferFunctions)):
        kind, words = CAMPAIGNS[of], set(CAMPAIGNS[of].schema.__struct_fields__)
        assert entries(question).keys() - words == set(kind.without)
        assert "hold_out" not in words, "files of an entry that no worker would have"
    settings = settings_of("multi-start", {"vehicle": "v.toml", "flight": ["a.nc", "b.nc"], "mapping": "m.toml"})
    assert list(MULTI_START.files(settings)) == [
        ("vehicle", "v.toml"), ("flight", "a.nc"), ("flight", "b.nc"), ("mapping", "m.toml"),
    ]  # fmt: skip
    with pytest.raises(sp.SwashError, match="iterations: is 0, expected at least 1"):
        MULTI_START.parts(settings_of("multi-start", {"vehicle": "coax", "flight": ["a"], "iterations": 0}), Path())


def test_the_reason_of_most_unusable_fits_is_told() -> None:
    table: Columns = {"problem": np.array(["", "flat", "it diverged", "flat", ""])}
    usable = np.array([True, False, False, False, False])
    assert unusable(table, usable) == [
        "4 fits may not be used and are in no figure below",
        "their most frequent problem (2 of 4): flat",
    ]
    assert unusable({}, usable) == ["4 fits may not be used and are in no figure below"], "without the column"
    assert unusable(table, usable | True) == []
