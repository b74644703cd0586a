"""MATLAB files of any layout: variables, fields of structs and columns of matrices, by name or by a mapping."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import swashplate as sp
from made_logs import write_coax
from swashplate.errors import FlightError, UnitError

N = 100
T = np.arange(N) / 50.0
P = np.sin(T)


def _mat(folder: Path, **variables: Any) -> Path:
    savemat(folder / "a.mat", variables)
    return folder / "a.mat"


@pytest.mark.parametrize("turned", [False, True])
def test_variables_called_as_channels_need_their_units(tmp_path: Path, turned: bool) -> None:
    rows: Any = (lambda v: v[None]) if turned else (lambda v: v[:, None])
    path = _mat(tmp_path, time=rows(T), p=rows(np.rad2deg(P)), Ts=0.02)
    with pytest.raises(UnitError, match=r"p: has no unit.*--unit p=rad/s"):
        sp.read(path)
    flight = sp.read(path, units={"p": "deg/s"})
    assert flight.values("p") == pytest.approx(P)
    assert flight.time("p").tolist() == T.tolist()
    assert flight.provenance.reader == "mat"
    assert any("Ts: not 100 numbers long: not read" in note for note in flight.provenance.notes)


def test_fields_and_columns_by_a_mapping(tmp_path: Path) -> None:
    log = {"t": T, "rates": np.stack([P, 2 * P, 3 * P], axis=1), "u": np.stack([P, -P])}
    path = _mat(tmp_path, log=log, other={"t": np.ones(7)})
    channels = {
        "time": {"column": "log.t", "unit": "s"}, "q": {"column": "log.rates(:,2)", "unit": "deg/s"},
        "mixer_roll": {"column": "log.u(2,:)", "factor": -0.5},
    }  # fmt: skip
    flight = sp.read(path, mapping={"channels": channels})
    assert flight.values("q") == pytest.approx(np.deg2rad(2 * P))
    assert flight.values("mixer_roll") == pytest.approx(0.5 * P)
    with pytest.raises(FlightError, match=r"q: there is no column 'rates'; the file has log\.t, log\.rates\(:,1\)"):
        sp.read(path, mapping={"channels": {**channels, "q": {"column": "rates", "unit": "deg/s"}}})


def test_unix_time_keeps_its_digits(tmp_path: Path) -> None:
    flight = sp.read(_mat(tmp_path, time=1.7e9 + T, p=P), units={"p": "rad/s"})
    assert flight.epoch == 1.7e9
    assert np.diff(flight.time("p")) == pytest.approx(0.02, abs=1e-6)


def test_blanks_and_clocks_are_those_of_every_table(tmp_path: Path) -> None:
    p = P.copy()
    p[7] = np.nan
    ticks = np.mod((4294.0 + T) * 1e6, 2**32).round()
    flight = sp.read(_mat(tmp_path, time=ticks, p=p), units={"p": "rad/s", "time": "us"})
    assert np.diff(flight.time("p")).max() == pytest.approx(0.04)
    assert "1 of 100 rows (1 %) are lost: a number is missing in p (1)" in flight.provenance.damage
    assert any("turned over once" in note for note in flight.provenance.notes)


def test_a_coax_record_stays_one_and_can_be_mapped_too(tmp_path: Path) -> None:
    path = write_coax(tmp_path / "a.mat")
    assert sp.read(path).provenance.reader == "coax56"
    channels = {
        "time": {"column": "Data.time", "unit": "s"},
        "z": {"column": "Data.position(3,:)", "unit": "m", "factor": -1.0},
    }
    assert sp.read(path, mapping={"channels": channels}).values("z") == pytest.approx(sp.read(path).values("z"))


def test_a_file_without_numbers_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match="holds words; expected arrays of numbers"):
        sp.read(_mat(tmp_path, words="hello"))


# ---- objects ---------------------------------------------------------------------------------------------------------
def _element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def _matrix(of_class: int, lengths: tuple[int, ...], data: bytes) -> bytes:
    flags, shape = struct.pack("<II", of_class, 0), struct.pack(f"<{len(lengths)}i", *lengths)
    return _element(14, _element(6, flags) + _element(5, shape) + _element(1, b"a") + data)


def test_no_numbers_in_a_huge_shape_and_texts_of_bytes(tmp_path: Path) -> None:
    """Found by the siege's forged files: NumPy has no such shape, and no encoding is called latin-1-le."""
    content = _mat(tmp_path, time=np.arange(5.0), p=np.arange(5.0)).read_bytes()
    huge = _matrix(6, (0, 2**31 - 1, 2**31 - 1, 2**31 - 1), _element(9, b""))
    text = _matrix(4, (1, 3), _element(5, b"abcd"))
    (tmp_path / "a.mat").write_bytes(content + huge + text)
    with pytest.raises(UnitError):  # they are read as far as the numbers that have no unit
        sp.read(tmp_path / "a.mat")


def _object(name: str, of_class: str) -> bytes:
    """A variable of class 17, as MATLAB writes objects: flags, name, kind of class, class, and a matrix of its own."""
    flags = _element(6, struct.pack("<II", 17, 0))
    texts = b"".join(_element(1, text.encode()) for text in (name, "MCOS", of_class))
    ids = _element(6, struct.pack("<II", 13, 0)) + _element(5, struct.pack("<ii", 2, 1)) + _element(1, b"")
    return _element(14, flags + texts + _element(14, ids + _element(6, struct.pack("<II", 0xDD000000, 1))))


@pytest.mark.parametrize("of_class", ["timeseries", "iddata"])
def test_an_object_is_named_and_the_rest_is_read(tmp_path: Path, of_class: str) -> None:
    path = _mat(tmp_path, time=T, p=P)
    path.write_bytes(path.read_bytes() + _object("record", of_class))
    flight = sp.read(path, units={"p": "rad/s"})
    assert flight.values("p") == pytest.approx(P)
    assert flight.provenance.damage == ()
    assert any(f"record (a MATLAB object of class {of_class})" in note for note in flight.provenance.notes)
    # A file that is damaged behind it is still called damaged.
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(FlightError, match="damaged"):
        sp.read(path, units={"p": "rad/s"})


def test_arrays_of_structs_cells_and_stacked_matrices_are_columns(tmp_path: Path) -> None:
    """As Simulink saves signals: an array of structs, each with values; matrices stand along the third dimension."""
    signals = np.zeros((1, 2), dtype=[("values", "O"), ("label", "O")])
    signals[0, 0], signals[0, 1] = (P[:, None], "roll"), (2 * P[:, None], "pitch")
    cell = np.empty(2, dtype=object)
    cell[0], cell[1] = 3 * P, "words"
    turned = np.arange(6.0).reshape(2, 3, 1) * P
    path = _mat(tmp_path, out={"time": T[:, None], "signals": signals}, data=cell, R=turned)
    flight = sp.read(path)
    assert flight.values("out.signals(2).values") == pytest.approx(2 * P)
    assert flight.values("data{1}") == pytest.approx(3 * P)
    assert flight.values("R(2,3,:)") == pytest.approx(5 * P)
    assert any("out.signals(1).label" in note and "data{2}" in note for note in flight.provenance.notes)
    mapping = {"channels": {"p": {"column": "out.signals(1).values", "unit": "deg/s"}}}
    assert sp.read(path, mapping=mapping).values("p") == pytest.approx(np.deg2rad(P))
