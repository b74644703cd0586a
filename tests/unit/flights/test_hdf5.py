"""HDF5 files as groups, variables and attributes; the process that reads them: `test_foreign`."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights import hdf5


def _file(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        file.attrs["mark"] = 1
        file.attrs["word"] = "ä"
        file["a"] = np.arange(3.0)
        file["names"] = np.array(["p", "q"], dtype=object)
        file["inside/b"] = np.arange(4).reshape(2, 2)
        file["inside/b"].attrs["units"] = "m"
    return path


def test_groups_variables_and_attributes(tmp_path: Path) -> None:
    found = hdf5.read(_file(tmp_path / "a.nc"), wanted="mark")
    assert found is not None
    assert dict(found[""].attributes) == {"mark": 1, "word": "ä"}
    assert list(found) == ["", "inside"]
    assert found[""].variables["names"].values.tolist() == ["p", "q"]
    np.testing.assert_array_equal(found[""].variables["a"].values, [0.0, 1.0, 2.0])
    b = found["inside"].variables["b"]
    assert (b.values.tolist(), b.attributes) == ([[0, 1], [2, 3]], {"units": "m"})
    assert hdf5.read(tmp_path / "a.nc", wanted="another mark") is None


def test_what_is_neither_number_nor_text_is_named(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file.attrs["mark"] = 1
        file["pair"] = np.zeros(2, dtype=[("x", "f8"), ("y", "i4")])
    with pytest.raises(FlightError, match=r"a\.nc: pair: has the type .*expected numbers or texts"):
        hdf5.read(tmp_path / "a.nc", wanted="mark")
    (tmp_path / "b.nc").write_bytes(b"\x89HDF\r\n\x1a\n and nothing")
    with pytest.raises(ValueError, match="open"):
        hdf5.read(tmp_path / "b.nc", wanted="mark")
