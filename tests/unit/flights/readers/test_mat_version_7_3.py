"""MATLAB 7.3 files: variables, structs, and what is named but not read."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

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


def with_objects(path: Path, **classes: str) -> Path:
    """A file of time, p and objects, as MATLAB writes those: numbers that point into a part of the file of its own."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("time", TIME), ("p", np.sin(TIME))):
            file.create_dataset(name, data=np.atleast_2d(values)).attrs["MATLAB_class"] = np.bytes_("double")
        for k, (name, of_class) in enumerate(classes.items(), 1):
            data = file.create_dataset(name.replace("__", "/"), data=np.array([[0xDD000000, 2, 1, 1, k, k]], "u4"))
            data.attrs["MATLAB_class"], data.attrs["MATLAB_object_decode"] = np.bytes_(of_class), np.int32(3)
        part = file.create_group("#subsystem#").create_dataset("MCOS", data=np.zeros((1, 6), "u8"))
        part.attrs["MATLAB_class"], part.attrs["MATLAB_object_decode"] = np.bytes_("FileWrapper__"), np.int32(3)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def test_time_series_and_tables_are_named_with_what_to_type_in_matlab(tmp_path: Path) -> None:
    path = with_objects(tmp_path / "pilot's.mat", ts="timeseries", log__T="table", blob="containers.Map")
    flight = read(path, units={"p": "rad/s"})
    assert flight.channels == ("p",)
    told = " ".join(flight.provenance.notes)
    for words in ("ts (a MATLAB object of class timeseries)", "log.T (a MATLAB object of class table)", "blob ("):
        assert words in told
    assert (
        "type in MATLAB: S = load('pilot''s.mat'); S.ts = struct('time', S.ts.Time, 'data', S.ts.Data); "
        "S.log.T = table2struct(S.log.T, 'ToScalar', true); save('pilot''s_numbers.mat', '-struct', 'S', '-v7')"
    ) in told
    assert "S.blob" not in told, "nothing is promised of a class that is not known"


def test_a_file_of_objects_alone_is_an_error_with_that_line(tmp_path: Path) -> None:
    path = with_objects(tmp_path / "a.mat", T="timetable")
    with h5py.File(path, "r+") as file:
        del file["time"], file["p"]
    with pytest.raises(FlightError, match=r"holds T \(a MATLAB object of class timetable\); expected arrays") as error:
        read(path)
    assert error.value.hint is not None
    assert "S.T.time = seconds(t - t(1)); save('a_numbers.mat'" in error.value.hint
    with h5py.File(path, "r+") as file:
        file["T"].attrs["MATLAB_class"] = np.bytes_("string")
    with pytest.raises(FlightError, match="of class string") as error:
        read(path)
    assert "MATLAB" not in (error.value.hint or ""), "texts become no numbers"


@pytest.mark.parametrize("time", ["a row", "a column"])
def test_what_that_line_saves_is_read(tmp_path: Path, time: str) -> None:
    """The struct that MATLAB makes of a time series or of a table, as `save -v7` writes it."""
    stamps = TIME[None, :] if time == "a row" else TIME[:, None]
    scipy.io.savemat(tmp_path / "ts.mat", {"ts": {"time": stamps, "data": np.sin(TIME)[:, None]}})
    mapping = {"channels": {"time": {"column": "ts.time", "unit": "s"}, "p": {"column": "ts.data", "unit": "rad/s"}}}
    assert np.array_equal(read(tmp_path / "ts.mat", mapping=mapping).values("p"), np.sin(TIME))
    scipy.io.savemat(tmp_path / "table.mat", {"T": {"time": TIME[:, None], "p": np.sin(TIME)[:, None]}})
    flight = read(tmp_path / "table.mat", units={"time": "s", "p": "rad/s"})
    assert np.array_equal(flight.time("p"), TIME)


def test_a_cell_is_read_from_the_file_that_is_saved_again(tmp_path: Path) -> None:
    notes = read(written(tmp_path / "flight.mat"), units={"p": "deg/s"}).provenance.notes
    line = "S = load('flight.mat'); save('flight_numbers.mat', '-struct', 'S', '-v7')"
    assert any(line in note for note in notes), "version 7's cells are read"
