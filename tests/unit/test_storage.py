"""Flights as netCDF: nothing lost, written whole or not at all, and refused where it is not ours."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from swashplate import atomic
from swashplate.errors import FlightError
from swashplate.flights import storage
from swashplate.flights.flight import Flight, Provenance, stream
from swashplate.flights.readers import read
from swashplate.flights.schema import SCHEMA_VERSION


def _flight() -> Flight:
    motion = stream(
        [0.0, 0.1, 0.30000000000000004], {"x": [1 / 3, np.nan, -0.0], "odd": [1.0, 2, 3]}, {"odd": "furlong"}
    )
    counts = stream([-1.5, 2.0], {"count": np.array([1, 2], dtype=np.int32), "armed": np.array([True, False])})
    note = 'Grüße, "quoted"\nand a second line'
    provenance = Provenance("a.mat", "ab" * 32, "coax56", "1", True, "coax", (note, "second"))
    flight = Flight({"motion": motion, "odd name/with slash": counts}, provenance, segments=((0.0, 0.1), (0.2, 1 / 3)))
    return flight.done("lowpass", cutoff=np.float64(0.1), channels=["x"], nested={"order": 4}).done("empty")


def test_nothing_is_lost(tmp_path: Path) -> None:
    flight = _flight()
    loaded = Flight.load(flight.save(tmp_path / "a.nc"))
    assert list(loaded.streams) == list(flight.streams)
    for name, data in flight.streams.items():
        assert loaded.streams[name].identical(data)
        assert {v: loaded.streams[name][v].dtype for v in data} == {v: data[v].dtype for v in data}
    assert loaded.provenance == flight.provenance
    assert loaded.segments == flight.segments
    assert loaded.history == flight.history


def test_read_opens_it_by_content(tmp_path: Path) -> None:
    path = _flight().save(tmp_path / "flight.dat")
    assert read(path).provenance == _flight().provenance
    with pytest.raises(FlightError, match="units and mappings have no meaning"):
        read(path, units={"x": "mm"})


def test_a_flight_without_streams(tmp_path: Path) -> None:
    assert Flight.load(Flight({}).save(tmp_path / "a.nc")) == Flight({})


def test_saving_twice_replaces(tmp_path: Path) -> None:
    path = _flight().save(tmp_path / "a.nc")
    replace(_flight(), segments=()).save(path)
    assert Flight.load(path).segments == ()
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.nc"]


def test_a_newer_schema_is_refused(tmp_path: Path) -> None:
    path = _flight().save(tmp_path / "a.nc")
    with h5py.File(path, "a") as file:
        file.attrs["swashplate_schema"] = SCHEMA_VERSION + 1
    with pytest.raises(FlightError, match=f"schema version {SCHEMA_VERSION + 1}.*Update swashplate"):
        Flight.load(path)


def test_a_forged_data_set_takes_no_memory(tmp_path: Path) -> None:
    """HDF5 stores nothing for a data set that was never written, but reads it as zeros: here 10 GB of them."""
    path = _flight().save(tmp_path / "a.nc")
    with h5py.File(path, "a") as file:
        file["stream_0"].create_dataset("huge", shape=(1_250_000_000,), dtype="f8", chunks=(1_000_000,))
    tracemalloc.start()
    try:
        with pytest.raises(FlightError, match=r"claims 10,000,000,\d+ bytes in a file of .*forged"):
            read(path)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("attribute", ["streams", "provenance", "history", "segments"])
def test_a_damaged_attribute_is_named(tmp_path: Path, attribute: str) -> None:
    path = _flight().save(tmp_path / "a.nc")
    for broken in ("{", '"text"', "[[1]]"):
        with h5py.File(path, "a") as file:
            file.attrs[attribute] = broken
        with pytest.raises(FlightError, match=r"a\.nc"):
            Flight.load(path)
    with h5py.File(path, "a") as file:
        del file.attrs[attribute]
    with pytest.raises(FlightError, match=attribute):
        Flight.load(path)


def test_times_that_do_not_increase_are_refused(tmp_path: Path) -> None:
    path = _flight().save(tmp_path / "a.nc")
    with h5py.File(path, "a") as file:
        file["stream_0/time"][1] = -1.0
    with pytest.raises(FlightError, match="motion/time: the times do not increase"):
        read(path)


def test_what_swashplate_did_not_write_is_refused(tmp_path: Path) -> None:
    xr.Dataset({"x": ("time", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(FlightError, match="did not write"):
        read(tmp_path / "other.nc")
    (tmp_path / "classic.nc").write_bytes(b"CDF\x01\0\0\0\0")
    with pytest.raises(FlightError, match="classic netCDF"):
        read(tmp_path / "classic.nc")
    (tmp_path / "cut.nc").write_bytes(_flight().save(tmp_path / "a.nc").read_bytes()[:3000])
    with pytest.raises(FlightError, match="damaged"):
        read(tmp_path / "cut.nc")
    with pytest.raises(FlightError, match="no such file"):
        Flight.load(tmp_path / "none.nc")


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = _flight().save(tmp_path / "a.nc")
    before = path.read_bytes()

    def fail(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(storage.xr.Dataset, "to_netcdf", fail)
    with pytest.raises(FlightError, match="cannot be written: No space left"):
        Flight({}).save(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.nc"]


def test_saving_into_a_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match=r"cannot be written.*folder exists"):
        _flight().save(tmp_path / "none" / "a.nc")


def test_atomic_text_keeps_permissions_and_bytes(tmp_path: Path) -> None:
    plain = tmp_path / "plain.txt"
    plain.write_text("x")
    path = atomic.write_text(tmp_path / "a.txt", "one\r\ntwo\nü")
    assert path.read_bytes() == "one\r\ntwo\nü".encode()
    assert path.stat().st_mode == plain.stat().st_mode
    path.chmod(0o640)
    assert atomic.write_bytes(path, b"new").stat().st_mode & 0o777 == 0o640


def test_atomic_block_that_fails(tmp_path: Path) -> None:
    def write_half() -> None:
        with atomic.replaced_when_complete(tmp_path / "a.txt") as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert list(tmp_path.iterdir()) == []
