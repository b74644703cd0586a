"""Files of results: the same values back, the same bytes again, damage told."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from swashplate.api.campaigns import result_files
from swashplate.api.campaigns.result_files import digest_of_table, packed, tabulated, unpacked
from swashplate.errors import CampaignError

TABLE = {
    "number": np.arange(5),
    "seed": np.array([0, 1, 2**48, 2**63 - 1, 7]),
    "lost": np.array([True, False, True, False, False]),
    "place": np.array([0.1, np.nan, -np.inf, -0.0, 5e-324]),
    "short": np.array([0.1, 2.0, 3.0, np.nan, 1e-40], dtype=np.float32),
    "verdict": np.array(["good", "", "poor fit", 'Übergang, "so"', "good"]),
}


@pytest.mark.parametrize("rows", [5, 0])
def test_a_table_comes_back_to_the_bit(rows: int) -> None:
    table = {name: values[:rows] for name, values in TABLE.items()}
    content = packed(table, task="a")
    assert packed(dict(table), task="a") == content
    back = unpacked(content, task="a")
    assert list(back) == list(table)
    for name, values in table.items():
        assert back[name].dtype.kind == values.dtype.kind
        assert back[name].tobytes() == values.tobytes()


def test_what_is_neither_number_nor_text_is_refused() -> None:
    with pytest.raises(CampaignError, match="odd: is neither numbers nor texts"):
        packed({"number": np.arange(2), "odd": np.array([None, {}], dtype=object)}, task="a")


@pytest.mark.parametrize("odd", [np.arange(3), np.zeros((2, 2)), np.array(1.0)])
def test_columns_that_are_no_table_are_refused(odd: np.ndarray) -> None:
    with pytest.raises(CampaignError, match=r"columns of one length are expected, found number \(2,\), odd \("):
        packed({"number": np.arange(2), "odd": odd}, task="a")


def test_the_name_of_a_log_need_not_be_text() -> None:
    name = b"flight \xff.bin".decode("utf-8", "surrogateescape")
    assert tabulated({"log": np.array([name, "b.bin"])})["log"].tolist() == ["flight \\udcff.bin", "b.bin"]


def test_a_changed_number_is_told() -> None:
    content = packed({"a": np.linspace(1.0, 2.0, 200)}, task="a")
    inside = content.index(np.linspace(1.0, 2.0, 200)[100:102].tobytes())
    with pytest.raises(zipfile.BadZipFile, match="CRC"):
        unpacked(content[:inside] + b"\x00" + content[inside + 1 :], task="a")


def test_a_file_that_claims_too_much_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    content = packed(TABLE, task="a")
    monkeypatch.setattr(result_files, "LARGEST", 100)
    with pytest.raises(ValueError, match="claims more than it can hold"):
        unpacked(content, task="a")


def test_a_packed_archive_is_refused() -> None:
    """Nothing of ours packs a result; a packed one may hold a thousand times of what it weighs."""
    stream = io.BytesIO()
    np.savez_compressed(stream, x=np.zeros(1000))
    with pytest.raises(ValueError, match="it is packed, and no result is"):
        unpacked(stream.getvalue(), task="a")


def test_a_result_says_whose_it_is() -> None:
    with pytest.raises(ValueError, match="it is the result of another task, aaaa"):
        unpacked(packed(TABLE, task="a" * 64), task="b" * 64)
    stream = io.BytesIO()
    np.savez(stream, **TABLE)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="it does not say whose result it is"):
        unpacked(stream.getvalue(), task="a")


@pytest.mark.parametrize("name", list(TABLE))
def test_any_other_value_has_another_hash(name: str) -> None:
    values = TABLE[name].copy()
    values[1] = {"b": True, "U": "bad"}.get(values.dtype.kind, 3)
    assert digest_of_table({**TABLE, name: values}, "a") != digest_of_table(TABLE, "a")
    assert digest_of_table({f"{name}2" if n == name else n: v for n, v in TABLE.items()}, "a") != digest_of_table(
        TABLE, "a"
    )
