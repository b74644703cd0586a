"""A campaign from its file to its page: stopped and gone on with, changed, held by another, wrong."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import rolling
import swashplate as sp
from made_campaigns import InProcess
from swashplate.api.campaigns import verbs, worker
from swashplate.api.campaigns.result_files import packed
from swashplate.api.campaigns.store import CampaignStore
from swashplate.api.campaigns.tasks import CampaignTask
from swashplate.api.campaigns.verbs import replay_campaign
from swashplate.errors import CampaignError
from swashplate.reporting.structure import Figure, Table

FILE = """
kind = "campaign"
of = "multi-start"
count = 4
seed = 3
vehicle = "roll.toml"
flight = ["gusty.nc"]
rate = 50
method = "output-error"
outputs = ["p", "pdot", "ay"]
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a campaign's file, and what that names."""
    folder = tmp_path_factory.mktemp("campaign")
    rolling.gusty().save(folder / "gusty.nc")
    (folder / "roll.toml").write_text(rolling.SAME)
    (folder / "c.toml").write_text(FILE)
    (folder / "two.toml").write_text(FILE.replace("count = 4", "count = 2"))
    return folder


@pytest.fixture
def engines(monkeypatch: pytest.MonkeyPatch) -> list[InProcess]:
    """The engines that campaigns were given, in place of processes."""
    made: list[InProcess] = []

    def chosen(*_: object) -> Callable[..., InProcess]:
        return lambda work, tasks: made.append(InProcess(work)) or made[-1]

    monkeypatch.setattr(verbs, "_chosen", chosen)
    return made


def test_stopped_and_gone_on_with_it_is_as_in_one_go(
    place: Path, tmp_path: Path, engines: list[InProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = sp.campaign(place / "two.toml", tmp_path / "whole")
    assert whole.complete
    assert [len(engine.did) for engine in engines] == [2]
    with monkeypatch.context() as patched:
        patched.setattr(verbs, "_chosen", lambda *_: lambda work, tasks: InProcess(work, stop_after=1))
        with pytest.raises(KeyboardInterrupt):
            sp.campaign(place / "two.toml", tmp_path / "parts")
    early = sp.campaign_results(tmp_path / "parts")
    assert (len(early.done), early.complete) == (1, False)
    assert f"1 of 2 tasks done; `swash campaign resume {tmp_path / 'parts'}` goes on" in repr(early)
    assert list(early.table["number"]) == [0]
    resumed = sp.resume_campaign(tmp_path / "parts")
    assert len(engines[-1].did) == 1
    assert resumed.table.keys() == whole.table.keys()
    for name in whole.table:
        np.testing.assert_array_equal(resumed.table[name], whole.table[name])
    sp.resume_campaign(tmp_path / "parts")
    assert len(engines) == 2, "all is done: no worker is started"

    # What it says.
    assert "Reached it: 2 of 2" in repr(whole)
    for ending in (".nc", ".csv", ".parquet"):
        whole.save(tmp_path / f"t{ending}")
    with xr.open_dataset(tmp_path / "t.nc", engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["Lb"], whole.table["Lb"])
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["cost"]) for row in rows] == list(whole.table["cost"])
    assert pd.read_parquet(tmp_path / "t.parquet")["cost"].tolist() == list(whole.table["cost"])
    with pytest.raises(CampaignError, match=r"ends in '\.txt', expected \.nc, \.csv or \.parquet"):
        whole.save(tmp_path / "t.txt")
    assert sp.report(whole, path=tmp_path / "r.html").stat().st_size > 10_000
    assert whole.to_document()["done"] == 2

    # One row again.
    monkeypatch.setattr(verbs, "ProcessPool", lambda work, workers: InProcess(work))
    again = replay_campaign(tmp_path / "whole", 1)
    assert again["Lb"].value == whole.table["Lb"][1]
    with pytest.raises(CampaignError, match="has no fit 2; it has 2"):
        replay_campaign(tmp_path / "whole", 2)

    # Another program.
    monkeypatch.setattr(verbs, "program", lambda: {"numpy": "9.9"})
    with pytest.raises(CampaignError, match=r"was begun with another program: .*numpy is 9\.9"):
        sp.resume_campaign(tmp_path / "parts")
    with pytest.raises(CampaignError, match=r"was begun with another program: .*numpy is 9\.9"):
        replay_campaign(tmp_path / "whole", 1)


def test_a_changed_file_is_refused_with_what_changed(
    place: Path, tmp_path: Path, engines: list[InProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "work", lambda task: {"cost": np.zeros(1), "usable": np.ones(1), "number": np.zeros(1)})
    file = place / "changed.toml"
    file.write_text(FILE)
    out = tmp_path / "out"
    sp.campaign(file, out)
    file.write_text(FILE.replace("count = 4", "count = 6") + 'title = "longer"\n')
    with pytest.raises(CampaignError) as refused:
        sp.campaign(file, out)
    assert "was begun otherwise: count was 4, is 6. Put that back, or begin anew" in str(refused.value)
    assert "--accept-changes" in str(refused.value)
    assert len(engines) == 1
    assert len(sp.campaign(file, out, accept_changes=True).done) == 6
    assert len(engines[-1].did) == 2, "tasks whose inputs are the same are kept"
    file.write_text(FILE.replace('method = "output-error"', 'method = "filter-error"'))
    (place / "roll.toml").write_text(rolling.SAME.replace("45.0", "46.0"))
    with pytest.raises(CampaignError, match="method was output-error, is filter-error; the file roll"):
        sp.campaign(file, out)
    (place / "roll.toml").write_text(rolling.SAME)


@pytest.mark.parametrize(
    ("entry", "value", "said"),
    [
        ("portions", [[0, 1]], "portions"),
        ("files", {"a": 3}, "files"),
        ("schema", 9, "schema 9"),
        ("schema", 2, "schema 2, expected 3"),
        ("program", None, "program"),
    ],
)
def test_a_damaged_plan_is_refused(entry: str, value: object, said: str, tmp_path: Path) -> None:
    store = CampaignStore(tmp_path)
    plan = {"of": "recovery", "document": {}, "files": {}, "program": {}, "portions": [[0, 1, 2, "", ""]]}
    store.begin("", plan, {})
    assert store.plan()["portions"] == [[0, 1, 2, "", ""]]
    found = json.loads((tmp_path / "plan.json").read_text())
    (tmp_path / "plan.json").write_text(json.dumps({**found, entry: value}))
    with pytest.raises(CampaignError, match=rf"plan\.json.*{said}"):
        store.plan()


def test_a_store_has_one_client(place: Path, tmp_path: Path, engines: list[InProcess]) -> None:
    store = CampaignStore(tmp_path)
    with store.held():
        with pytest.raises(CampaignError, match=r"is in use by process \d+ on \S+ since 20\d\d-"):
            sp.campaign(place / "c.toml", tmp_path)
        assert store.owner.startswith("process ")
    assert store.owner == ""
    assert engines == []


def test_a_damaged_result_is_named(tmp_path: Path) -> None:
    store = CampaignStore(tmp_path)
    store.begin("", {}, {"a": b"content"})
    (tmp_path / "results" / "x.npz").write_bytes(b"half of")
    with pytest.raises(CampaignError, match=r"x\.npz: is no result of its task: .*resume"):
        store.columns("x")
    read, values = 0, {"a": np.arange(4), "b": np.array(["one", "two"] * 2)}
    whole = packed(values, task="a")
    for at in range(0, len(whole), 7):  # libraries raise all kinds of errors for a bit in a header
        content = bytearray(whole)
        content[at] ^= 0xFF
        (tmp_path / "results" / "a.npz").write_bytes(content)
        with contextlib.suppress(CampaignError):
            found = store.columns("a")
            assert {name: column.tolist() for name, column in found.items()} == {
                name: column.tolist() for name, column in values.items()
            }, "what is read is what was written"
            read += 1
    assert read, "bytes that mean nothing may be anything"
    kept = next((tmp_path / "inputs").iterdir())
    assert store.input(kept.name) == b"content"
    kept.write_bytes(b"other")
    with pytest.raises(CampaignError, match="is not the file that the campaign was begun with"):
        store.input(kept.name)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ('of = "multi-start"', 'of = "multistart"'),
            "c.toml: of: is 'multistart', expected one of monte-carlo, recov",
        ),
        (('kind = "campaign"', 'kind = "vehicle"'), "kind is 'vehicle', expected 'campaign'"),
        (("count = 4", "count = 0"), "count: is less than one"),
        (("count = 4", "counts = 4"), "counts: is not known here"),
        (("gusty.nc", "missing.nc"), "flight: there is no file 'missing.nc'. It is looked for in"),
        (("seed = 3", "factor = 0.5"), "factor, same: expected factor above 1"),
        (('flight = ["gusty.nc"]', ""), "c.toml: flight: expected either flights or responses"),
        (('"roll.toml"', '"rool"'), "rool: is neither a vehicle's name nor a file"),
    ],
)
def test_a_file_that_is_none_is_refused(place: Path, tmp_path: Path, change: tuple[str, str], said: str) -> None:
    for name in ("gusty.nc", "roll.toml"):
        (tmp_path / name).write_bytes((place / name).read_bytes())
    (tmp_path / "c.toml").write_text(FILE.replace(*change))
    with pytest.raises(CampaignError) as refused:
        sp.plan_campaign(tmp_path / "c.toml")
    assert said in str(refused.value)


def test_what_is_kept_is_chosen(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    task = sp.plan_campaign(place / "c.toml").tasks[1]
    kind = worker.opened(task)[0]
    with pytest.raises(
        CampaignError, match=r"free: is \('Lb',\), and 'roll' is a state-space model"
    ):  # whose file says it
        worker.work(replace(task, settings={**task.settings, "free": "Lb"}))
    monkeypatch.setattr(type(kind), "run", lambda *_: {n: np.zeros(1) for n in ("cost", "usable", "Lb", "Lb.sigma")})
    assert list(worker.work(replace(task, settings={**task.settings, "keep": ["Lb*", "cost"]}))) == [
        "number", "seed", "cost", "Lb", "Lb.sigma",
    ]  # fmt: skip
    with pytest.raises(CampaignError, match="keep: 'Mq' is none of cost, usable"):
        worker.work(replace(task, settings={**task.settings, "keep": ["Mq"]}))
    monkeypatch.setattr(type(kind), "run", lambda *_: {"cost": np.zeros(2)})
    with pytest.raises(CampaignError, match=r"gave columns of \[2\] rows, expected 1"):
        worker.work(task)


def test_tasks_are_named_by_all_that_their_results_depend_on(place: Path) -> None:
    names = {}
    for what, text in {
        "as it is": FILE,
        "another title": FILE + 'title = "x"\n',
        "more of them": FILE.replace("count = 4", "count = 9"),
        "another seed": FILE.replace("seed = 3", "seed = 4"),
        "another method": FILE.replace("output-error", "filter-error"),
    }.items():
        (place / "named.toml").write_text(text)
        names[what] = [task.name for task in sp.plan_campaign(place / "named.toml").tasks]
    assert names["as it is"] == names["another title"] == names["more of them"][:4]
    for other in ("another seed", "another method"):
        assert not set(names["as it is"]) & set(names[other])
    assert len(set(names["more of them"])) == 9


def test_a_failure_is_in_the_report_with_its_seed(
    place: Path, tmp_path: Path, engines: list[InProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = sp.plan_campaign(place / "c.toml")
    store = CampaignStore(tmp_path)
    store.begin(made.text, made.stored(), made.tasks[0].files)
    store.give_up(made.tasks[3], ["no", "no", "not at all"])
    for k, task in enumerate(made.tasks[:3]):
        own = {"number": np.array([k]), "seed": np.array([task.portion.seed])}
        store.keep(task, own | {"cost": np.array([1.0 + k]), "usable": np.array([1])})
    monkeypatch.setattr(worker, "work", lambda task: store.columns(made.tasks[0].name))
    found = sp.resume_campaign(tmp_path)
    assert engines == [], "what was given up is not tried again unless that is asked for"
    assert "3 of 4 tasks done, 1 given up" in repr(found)
    assert f"given up: rows from 3 (seed {made.tasks[3].portion.seed}): not at all" in repr(found)
    assert "Careful: the best optimum was reached by one start only" in repr(found)
    page = found.page()
    assert page.banners[0] == ("bad", "1 fit could not be computed and are in no figure below")
    failed = next(section for section in page.sections if section.identifier == "failed")
    assert isinstance(failed.blocks[0], Table)
    assert [cell.words for cell in failed.blocks[0].rows[0]] == ["3", str(made.tasks[3].portion.seed), "", "3",
                                                                 "not at all"]  # fmt: skip
    assert {figure.identifier for figure in page.figures} == {"campaign-spread", "campaign-convergence"}
    assert all(isinstance(figure, Figure) for figure in page.figures)
    assert sp.resume_campaign(tmp_path, retry_failed=True).failed == {}
    assert [task.portion.first for task in engines[-1].did] == [3]


def _store_of_three(place: Path, folder: Path) -> tuple[CampaignStore, tuple[CampaignTask, ...]]:
    """A campaign of three fits, all done."""
    (place / "three.toml").write_text(FILE.replace("count = 4", "count = 3"))
    made = sp.plan_campaign(place / "three.toml")
    store = CampaignStore(folder)
    store.begin(made.text, made.stored(), made.tasks[0].files)
    for k, task in enumerate(made.tasks):
        own = {"number": np.array([k]), "seed": np.array([task.portion.seed])}
        store.keep(task, own | {"cost": np.array([1.0 + k]), "usable": np.array([1])})
    return store, made.tasks


def _file(store: CampaignStore, task: CampaignTask) -> Path:
    return next((store.folder / "results").glob(f"{task.name}.*"))


def _copied(store: CampaignStore, tasks: tuple[CampaignTask, ...]) -> None:
    _file(store, tasks[1]).write_bytes(_file(store, tasks[0]).read_bytes())


def _edited(store: CampaignStore, tasks: tuple[CampaignTask, ...]) -> None:
    """A number by hand, with what the file says of itself left as it was."""
    path = _file(store, tasks[1])
    with zipfile.ZipFile(path) as archive:
        comment, entries = archive.comment, {name: archive.read(name) for name in archive.namelist()}
    stream = io.BytesIO()
    np.save(stream, np.array([0.5]))
    _zipped(path, {**entries, "cost.npy": stream.getvalue()}, comment)


def _foreign(store: CampaignStore, tasks: tuple[CampaignTask, ...]) -> None:
    path = _file(store, tasks[1])
    with zipfile.ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    _zipped(path, entries, b"")


def _zipped(path: Path, entries: dict[str, bytes], comment: bytes) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
        archive.comment = comment


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (_copied, "is the result of another task"),
        (_edited, "its values are not those"),
        (_foreign, "does not say whose"),
    ],
)
def test_a_result_that_is_not_what_was_computed_is_in_no_figure_and_done_again(
    change: Callable[..., None], why: str, place: Path, tmp_path: Path, engines: list[InProcess],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    store, tasks = _store_of_three(place, tmp_path)
    assert sp.campaign_results(tmp_path).refused == {}
    assert sp.campaign_results(tmp_path).complete
    right = _file(store, tasks[1]).read_bytes()
    change(store, tasks)
    found = sp.campaign_results(tmp_path)
    assert list(found.refused) == [tasks[1].name]
    assert why in found.refused[tasks[1].name]
    assert found.table["number"].tolist() == [0, 2]
    assert not found.complete
    assert "3 of 3 tasks done, the results of 1 refused; `swash campaign resume" in repr(found)
    assert "rows 1 to 1 are refused: " in repr(found)
    assert found.to_document()["refused"] == dict(found.refused)
    assert found.page().banners[0] == ("bad", found.refused[tasks[1].name])

    def work(task: CampaignTask) -> dict[str, np.ndarray]:
        own = {"number": np.array([task.portion.first]), "seed": np.array([task.portion.seed])}
        return own | {"cost": np.array([1.0 + task.portion.first]), "usable": np.array([1])}

    monkeypatch.setattr(worker, "work", work)
    again = sp.resume_campaign(tmp_path)
    assert [task.portion.first for task in engines[-1].did] == [1]
    assert again.complete
    assert _file(store, tasks[1]).read_bytes() == right


def test_a_result_that_cannot_be_read_is_not_removed(place: Path, tmp_path: Path, engines: list[InProcess]) -> None:
    store, tasks = _store_of_three(place, tmp_path)
    path = _file(store, tasks[1])
    path.unlink()
    path.mkdir()
    with pytest.raises(CampaignError, match="cannot be read"):
        sp.resume_campaign(tmp_path)
    assert path.is_dir()
    assert engines == []
