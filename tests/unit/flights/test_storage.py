"""Flights as netCDF: nothing lost, written whole or not at all, and refused where it is not ours."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from swashplate.errors import FlightError, WriteError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.flights.readers.read import read
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
    with pytest.raises(FlightError, match="a mapping has no meaning"):
        read(path, mapping={"rate": 50})


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


def test_saving_into_a_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(WriteError, match=r"cannot be written.*folder exists"):
        _flight().save(tmp_path / "none" / "a.nc")


def _external_data(file: h5py.File, secret: Path) -> None:
    del file["stream_0/x"]
    file["stream_0"].create_dataset("x", shape=(3,), dtype="f8", external=[(str(secret), 0, 24)])


def _external_link(file: h5py.File, secret: Path) -> None:
    del file["stream_0/x"]
    file["stream_0/x"] = h5py.ExternalLink(str(secret), "/x")


def _external_group(file: h5py.File, secret: Path) -> None:
    del file["stream_0"]
    file["stream_0"] = h5py.ExternalLink(str(secret), "/")


def _soft_link(file: h5py.File, secret: Path) -> None:
    del file["stream_0/x"]
    file["stream_0/x"] = h5py.SoftLink("/stream_1/count")


def _virtual(file: h5py.File, secret: Path) -> None:
    del file["stream_0/x"]
    layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(secret), "x", shape=(3,))
    file["stream_0"].create_virtual_dataset("x", layout)


def _plugin(file: h5py.File, secret: Path) -> None:
    del file["stream_0/x"]
    file["stream_0"].create_dataset("x", data=np.ones(3), chunks=(3,), compression=h5py.h5z.FILTER_LZF)


def _loop(file: h5py.File, secret: Path) -> None:
    file["stream_0/itself"] = file["/"]


@pytest.mark.parametrize(
    ("craft", "said"),
    [
        (_external_data, "stream_0/x: its numbers lie in other files"),
        (_external_link, "stream_0/x: it is a link, to another file perhaps"),
        (_external_group, "stream_0: it is a link"),
        (_soft_link, "stream_0/x: it is a link"),
        (_virtual, "stream_0/x: it is virtual"),
        (_plugin, "stream_0/x: it is packed by a plugin"),
    ],
)
def test_a_file_that_points_outside_of_itself_is_refused(craft, said: str, tmp_path: Path) -> None:
    secret = tmp_path / "secret.nc"
    with h5py.File(secret, "w") as file:
        file["x"] = [1.0, 2.0, 3.0]
    path = _flight().save(tmp_path / "a.nc")
    with h5py.File(path, "a") as file:
        craft(file, secret)
    with pytest.raises(FlightError, match=rf"a\.nc: {said}.*do not trust"):
        read(path)


def test_a_group_within_itself_ends(tmp_path: Path) -> None:
    path = _flight().save(tmp_path / "a.nc")
    with h5py.File(path, "a") as file:
        _loop(file, path)
    assert read(path).streams["motion"].identical(_flight().streams["motion"])


def test_a_stream_without_time_is_refused(tmp_path: Path) -> None:
    path = _flight().save(tmp_path / "a.nc")
    with h5py.File(path, "a") as file:
        file["stream_0"].create_dataset("single", data=3.0)
    with pytest.raises(FlightError, match=r"motion/single: has the shape .*expected numbers over time"):
        read(path)
    with h5py.File(path, "a") as file:
        del file["stream_0/single"]
        file["stream_0/time"][1] = np.nan
    with pytest.raises(FlightError, match="motion/time: the times do not increase"):
        read(path)


@pytest.mark.parametrize("odd", [np.arange(40.0), np.array([["a"]], "S3"), 7], ids=["numbers", "words", "one"])
def test_a_list_of_axes_of_another_type_is_never_read(odd: object, tmp_path: Path) -> None:
    """HDF5 1.14 writes beyond its memory there: the process ends, at once or later."""
    path = _flight().save(tmp_path / "a.nc")
    with h5py.File(path, "r+") as file:
        place = next(item for item in file["stream_0"].values() if "DIMENSION_LIST" in item.attrs)
        place.attrs["DIMENSION_LIST"] = odd
    assert Flight.load(path) == _flight()


ODD = ["imu/p", "imu_p", "/", "a/b/c", "a_b_c", ".", "..", "a\x00b", "a\x00c", "\udcff", "x\u202ey", " p ", "é😀"]


def test_every_name_of_a_channel_comes_back(tmp_path: Path) -> None:
    time = np.arange(4) * 0.1
    flight = Flight({"log": stream(time, {name: k + time for k, name in enumerate(ODD)}, {"imu/p": "V"})})
    back = Flight.load(flight.save(tmp_path / "a.nc"))
    assert back.channels == tuple(ODD)
    for k, name in enumerate(ODD):
        np.testing.assert_array_equal(back.values(name), k + time)
    assert back.streams["log"]["imu/p"].attrs["units"] == "V"
    assert "swashplate_name" not in back.streams["log"]["imu/p"].attrs
    back.save(tmp_path / "b.nc")
    assert (tmp_path / "b.nc").read_bytes() == (tmp_path / "a.nc").read_bytes()
    with h5py.File(tmp_path / "a.nc") as file:
        assert file["stream_0/imu_p_"].attrs["swashplate_name"] == '"imu/p"', "others see which it is"


def test_a_name_that_two_channels_claim_is_refused(tmp_path: Path) -> None:
    time = np.arange(4) * 0.1
    Flight({"log": stream(time, {"p": time, "imu/p": time}, {})}).save(tmp_path / "a.nc")
    for said, expected in (('"p"', "log/p: is there twice"), ("[1]", "imu_p"), ('"p', "is not JSON")):
        with h5py.File(tmp_path / "a.nc", "a") as file:
            file["stream_0/imu_p"].attrs["swashplate_name"] = said
        with pytest.raises(FlightError, match=expected):
            Flight.load(tmp_path / "a.nc")


def test_a_channel_cannot_be_called_as_the_times(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match="time: is the name of the times of the samples"):
        stream(np.arange(3), {"time": np.arange(3)})
