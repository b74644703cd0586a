"""HDF5 files in a process of their own: its end, its hang and its forks cost an error at most."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights import hdf5, hdf5_process


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


@pytest.mark.parametrize(
    ("way", "said"), [(signal.SIGXCPU, "came to no end"), (signal.SIGSEGV, r"ended its process \(SIGSEGV\)")]
)
def test_a_process_that_ends_is_told_and_another_one_started(
    way: signal.Signals, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dying = f"import os, sys; sys.stdin.readline(); print(end='half', flush=True); os.kill(os.getpid(), {int(way)})"
    one = hdf5._Process()
    piped = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    one._running = subprocess.Popen([sys.executable, "-c", dying], **piped)
    monkeypatch.setattr(hdf5, "_processes", [one])
    path = _file(tmp_path / "a.nc")
    with pytest.raises(FlightError, match=rf"a\.nc: the HDF5 library {said} over it"):
        hdf5.read(path, wanted="mark")
    assert hdf5.read(path, wanted="mark") is not None
    one._close()


def test_a_fork_starts_its_own(tmp_path: Path) -> None:
    path = _file(tmp_path / "a.nc")
    hdf5.read(path, wanted="mark")
    before = hdf5._processes[-1]
    before.owner += 1  # as seen from a fork
    try:
        hdf5.read(path, wanted="mark")
        assert hdf5._processes[-1] is not before
        running = before._running
        before._close()
        assert running is not None
        assert running.poll() is None
        running.kill()
        running.wait()
    finally:
        before.owner = os.getpid()


@pytest.mark.proof
def test_a_heap_that_never_ends_is_refused(tmp_path: Path) -> None:
    """HDF5 2.0 counts the objects of a heap for ever where one claims all but 16 bytes of all numbers."""
    content = bytearray(_file(tmp_path / "a.nc").read_bytes())
    at = content.index(b"GCOL") + 16
    content[at + 8 : at + 16] = (2**64 - 16).to_bytes(8, "little")
    (tmp_path / "a.nc").write_bytes(content)
    with pytest.raises(FlightError, match="came to no end"):
        hdf5.read(tmp_path / "a.nc", wanted="mark")
    assert hdf5_process.seconds(1 << 30) < 60
