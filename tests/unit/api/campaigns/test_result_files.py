"""Files of results: the same values back, the same bytes again, damage told."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from made_campaigns import tasks
from swashplate.api.campaigns import result_files
from swashplate.api.campaigns.result_files import ENDINGS, NUMPY, PARQUET, packed, unpacked
from swashplate.api.campaigns.store import CampaignStore
from swashplate.api.campaigns.tasks import Columns
from swashplate.errors import CampaignError, MissingLibraryError
from swashplate.flights import foreign

TABLE = {
    "number": np.arange(5),
    "seed": np.array([0, 1, 2**48, 2**63 - 1, 7]),
    "lost": np.array([True, False, True, False, False]),
    "place": np.array([0.1, np.nan, -np.inf, -0.0, 5e-324]),
    "short": np.array([0.1, 2.0, 3.0, np.nan, 1e-40], dtype=np.float32),
    "verdict": np.array(["good", "", "poor fit", 'Übergang, "so"', "good"]),
}


def _back(content: bytes, ending: str, folder: Path, *, task: str = "") -> Columns:
    path = folder / f"a{ending}"
    path.write_bytes(content)
    return unpacked(path, content, task=task)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_table_comes_back_to_the_bit(ending: str, tmp_path: Path) -> None:
    content = packed(TABLE, ending=ending)
    assert packed(dict(TABLE), ending=ending) == content
    back = _back(content, ending, tmp_path)
    assert list(back) == list(TABLE)
    for name, values in TABLE.items():
        assert back[name].dtype.kind == values.dtype.kind
        assert back[name].flags.writeable
        if name == "verdict":
            assert back[name].tolist() == values.tolist()
        else:
            assert back[name].dtype == values.dtype
            assert back[name].tobytes() == values.tobytes()


@pytest.mark.parametrize("ending", ENDINGS)
def test_no_rows_are_a_table_too(ending: str, tmp_path: Path) -> None:
    back = _back(packed({name: values[:0] for name, values in TABLE.items()}, ending=ending), ending, tmp_path)
    assert {name: (len(values), values.dtype.kind) for name, values in back.items()} == {
        name: (0, values.dtype.kind) for name, values in TABLE.items()
    }


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_is_neither_number_nor_text_is_refused(ending: str) -> None:
    with pytest.raises(CampaignError, match="odd: is neither numbers nor texts"):
        packed({"number": np.arange(2), "odd": np.array([None, {}], dtype=object)}, ending=ending)


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("odd", [np.arange(3), np.zeros((2, 2)), np.array(1.0)])
def test_columns_that_are_no_table_are_refused(ending: str, odd: np.ndarray) -> None:
    with pytest.raises(CampaignError, match=r"columns of one length are expected, found number \(2,\), odd \("):
        packed({"number": np.arange(2), "odd": odd}, ending=ending)


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_name_of_a_log_need_not_be_text(ending: str, tmp_path: Path) -> None:
    name = b"flight \xff.bin".decode("utf-8", "surrogateescape")
    back = _back(packed({"log": np.array([name, "b.bin"])}, ending=ending), ending, tmp_path)
    assert back["log"].tolist() == ["flight \\udcff.bin", "b.bin"]


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_changed_number_is_told(ending: str, tmp_path: Path) -> None:
    content = packed({"a": np.linspace(1.0, 2.0, 200)}, ending=ending)
    inside = content.index(np.linspace(1.0, 2.0, 200)[100:102].tobytes())
    with pytest.raises(Exception, match=r"(?i)crc"):
        _back(content[:inside] + b"\x00" + content[inside + 1 :], ending, tmp_path)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_file_that_claims_too_much_is_refused(ending: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    content = packed(TABLE, ending=ending)
    monkeypatch.setattr(result_files, "LARGEST", 100)
    with pytest.raises(ValueError, match="claims more than it can hold"):
        _back(content, ending, tmp_path)


def test_a_packed_archive_is_refused(tmp_path: Path) -> None:
    """Nothing of ours packs a result; a packed one may hold a thousand times of what it weighs."""
    stream = io.BytesIO()
    np.savez_compressed(stream, x=np.zeros(1000))
    with pytest.raises(ValueError, match="it is packed, and no result is"):
        _back(stream.getvalue(), NUMPY, tmp_path)


def test_a_store_reads_what_it_wrote_with_and_without_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store, (first, second, *_) = CampaignStore(tmp_path), tasks()
    store.begin("", {}, {})
    store.keep(first, TABLE)
    with monkeypatch.context() as without:
        without.setattr("swashplate.api.campaigns.store.usual_ending", lambda: NUMPY)
        store.keep(first, TABLE)  # it is there
        store.keep(second, TABLE)
    endings = {path.stem: path.suffix for path in (tmp_path / "results").iterdir()}
    assert endings == {first.name: PARQUET, second.name: NUMPY}
    assert store.done() == set(endings)
    one, other = store.columns(first.name), store.columns(second.name)
    assert all(one[name].tolist() == other[name].tolist() for name in ("number", "seed", "verdict"))

    monkeypatch.setattr(result_files, "find_spec", lambda _: None)
    with pytest.raises(MissingLibraryError):
        store.columns(first.name)


def test_the_folder_of_results_is_one_table_for_others(tmp_path: Path) -> None:
    store = CampaignStore(tmp_path)
    store.begin("", {}, {})
    for k, task in enumerate(tasks()[:3]):
        store.keep(task, {"number": np.arange(2) + 2 * k, "verdict": np.array(["good", "lost"])})
    table = pd.read_parquet(tmp_path / "results").sort_values("number")
    assert table["number"].tolist() == [0, 1, 2, 3, 4, 5]
    assert table["verdict"].tolist() == ["good", "lost"] * 3


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_result_says_whose_it_is(ending: str, tmp_path: Path) -> None:
    content = packed(TABLE, ending=ending, task="a" * 64)
    assert packed(dict(TABLE), ending=ending, task="a" * 64) == content
    assert list(_back(content, ending, tmp_path, task="a" * 64)) == list(TABLE)
    assert list(_back(content, ending, tmp_path)) == list(TABLE)
    with pytest.raises(ValueError, match="it is the result of another task, aaaa"):
        _back(content, ending, tmp_path, task="b" * 64)
    with pytest.raises(ValueError, match="it does not say whose result it is"):
        _back(packed(TABLE, ending=ending), ending, tmp_path, task="a" * 64)


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("name", list(TABLE))
def test_any_other_value_has_another_hash(ending: str, name: str, tmp_path: Path) -> None:
    values = TABLE[name].copy()
    values[1] = {"b": True, "U": "bad"}.get(values.dtype.kind, 3)
    one, other = (result_files._mark(table, "a") for table in (TABLE, {**TABLE, name: values}))
    assert one != other
    assert result_files._mark(_back(packed(TABLE, ending=ending), ending, tmp_path), "a") == one
    assert result_files._mark({f"{name}2" if n == name else n: v for n, v in TABLE.items()}, "a") != one


def test_a_library_that_aborts_over_a_result_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The process that read it is gone, this one is not, and the next result is read."""
    store, (first, *_) = CampaignStore(tmp_path), tasks()
    store.begin("", {}, {})
    store.keep(first, TABLE)
    with monkeypatch.context() as dying:
        dying.setattr(foreign, "own_python", lambda _: [sys.executable, "-c", "import os; input(); os.abort()"])
        dying.setattr(foreign, "_processes", [foreign._Process()])
        with pytest.raises(CampaignError, match=r"is no result of its task: was given up: .*\(SIGABRT\)"):
            store.columns(first.name)
    assert store.columns(first.name)["number"].tolist() == [0, 1, 2, 3, 4]
