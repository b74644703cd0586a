"""MATLAB 7.3 files: variables, structs, and what is named but not read."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights.readers.read import read

TIME = 0.02 * np.arange(500)


def written(path: Path, *, user_block: bool = True) -> Path:
    """A file as MATLAB writes it: text of 512 bytes before HDF5, dimensions turned, cells as references."""
    with h5py.File(path, "w", userblock_size=512 if user_block else 0) as file:
        log = file.create_group("log")
        log.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in (("time", TIME), ("p", np.sin(TIME)), ("u", np.stack([np.cos(TIME), 0.5 * TIME], axis=1))):
            data = log.create_dataset(name, data=np.atleast_2d(values) if values.ndim == 1 else values.T)
            data.attrs["MATLAB_class"] = np.bytes_("double")
        title = file.create_dataset("title", data=np.frombuffer("hover".encode("utf-16-le"), "u2").reshape(-1, 1))
        title.attrs["MATLAB_class"] = np.bytes_("char")
        empty = file.create_dataset("nothing", data=np.array([0, 0], "u8"))
        empty.attrs["MATLAB_class"], empty.attrs["MATLAB_empty"] = np.bytes_("double"), np.uint8(1)
        refs = file.create_group("#refs#")
        refs.create_dataset("a", data=np.ones((1, 3)))
        cell = file.create_dataset("names", (1, 1), dtype=h5py.ref_dtype)
        cell[0, 0] = refs["a"].ref
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def test_a_struct_is_read_and_the_rest_is_named(tmp_path: Path) -> None:
    flight = read(written(tmp_path / "flight.mat"), units={"p": "deg/s"})
    assert np.allclose(flight.values("p"), np.deg2rad(np.sin(TIME)))
    assert np.array_equal(flight.values("log.u(:,2)"), 0.5 * TIME)
    (note,) = (text for text in flight.provenance.notes if "no array of numbers" in text)
    assert "title (text)" in note
    assert "names (a MATLAB cell)" in note


def test_a_mapping_says_which_variable_is_which_channel(tmp_path: Path) -> None:
    mapping = {
        "channels": {"time": {"column": "log.time", "unit": "s"}, "q": {"column": "log.u(:,1)", "unit": "rad/s"}}
    }
    flight = read(written(tmp_path / "flight.mat"), mapping=mapping)
    assert flight.channels == ("q",)
    assert np.array_equal(flight.values("q"), np.cos(TIME))


def test_a_damaged_one_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "flight.mat")
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(FlightError, match=r"damaged MATLAB 7\.3 file"):
        read(path)


def test_an_object_is_named_as_what_it_is(tmp_path: Path) -> None:
    path = written(tmp_path / "flight.mat")
    with h5py.File(path, "r+") as file:
        record = file.create_dataset("record", data=np.array([[0xDD000000, 2, 1, 1, 1, 1]], "u4"))
        record.attrs["MATLAB_class"] = np.bytes_("timeseries")
    notes = read(path, units={"p": "deg/s"}).provenance.notes
    assert any("record (a MATLAB object of class timeseries)" in note for note in notes)
