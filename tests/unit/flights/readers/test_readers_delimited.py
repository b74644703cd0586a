"""CSV in and out: units in the header or in a mapping, and what is wrong with a table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swashplate.errors import FlightError, UnitError, WriteError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers.read import read
from swashplate.flights.tabular import write_csv


def _file(folder: Path, text: str, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_units_in_the_header_become_si(tmp_path: Path) -> None:
    path = _file(
        tmp_path,
        "time [ms],phi [deg],p (deg/s),x [mm],z [ft],az [g],omega_lower [rpm],motor_lower [%],servo_roll\n"
        "0,180,90,1000,10,-1,60,50,0.1\n20,0,0,0,0,0,0,0,0.2\n",
    )
    flight = read(path)
    expected = {
        "phi": np.pi,
        "p": np.pi / 2,
        "x": 1.0,
        "z": 3.048,
        "az": -9.80665,
        "omega_lower": 2 * np.pi,
        "motor_lower": 0.5,
        "servo_roll": 0.1,
    }
    assert flight.time("phi").tolist() == [0.0, 0.02]
    assert set(flight.channels) == set(expected)
    for name, value in expected.items():
        assert flight.values(name)[0] == pytest.approx(value, rel=1e-15), name
    assert flight.provenance.reader == "csv"


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_separators_comments_and_byte_order_mark(tmp_path: Path, mark: str) -> None:
    text = "\ufeff# made by hand\n" + mark.join(["time [s]", "u [m/s]"]) + "\n\n"
    rows = "\r\n".join(mark.join(row) for row in (["0", "1e0"], ["0.5", " 2.5 "])) + "\r\n\r\n"
    assert read(_file(tmp_path, text.replace("\n\n", "\n") + rows)).values("u").tolist() == [1.0, 2.5]


def test_a_table_without_spaces_reads_as_one_with_them(tmp_path: Path) -> None:
    """Bare tables are read faster; blanks, underscores and words are seen in both."""
    rows = ["0,1.5,7", "0.5,2.5e-3,8", "1,-3,9"]
    bare = read(_file(tmp_path, "time [s],u [m/s],v [m/s]\n" + "\n".join(rows)))
    wide = read(_file(tmp_path, "time [s],u [m/s],v [m/s]\n" + "\n".join(row.replace(",", " , ") for row in rows)))
    assert [bare.values(n).tolist() for n in "uv"] == [wide.values(n).tolist() for n in "uv"]
    for cell in ("1_0", "five", "1.2.3"):
        with pytest.raises(FlightError, match=r"line 3 is not a number"):
            read(_file(tmp_path, f"time [s],u [m/s],v [m/s]\n0,1,7\n0.5,{cell},8\n1,3,9\n"))


def test_a_mapping_file_names_units_factors_and_columns(tmp_path: Path) -> None:
    path = _file(tmp_path, "TimeUS,Roll,Ch7\n0,90,1500\n10000,45,2000\n")
    mapping = _file(
        tmp_path,
        '[channels]\ntime = {column = "TimeUS", unit = "us"}\nphi = {column = "Roll", unit = "deg"}\n'
        'servo_pitch = {column = 3, unit = "1", factor = -0.002, offset = 3.0}\n',
        "mapping.toml",
    )
    flight = read(path, mapping=mapping)
    assert flight.time("phi").tolist() == [0.0, 0.01]
    assert flight.values("phi") == pytest.approx([np.pi / 2, np.pi / 4])
    assert flight.values("servo_pitch") == pytest.approx([0.0, -1.0])


def test_a_file_without_header_is_mapped_by_number(tmp_path: Path) -> None:
    path = _file(tmp_path, "0,1,10\n1,2,20\n")
    with pytest.raises(FlightError, match="header = false"):
        read(path)
    channels = {"time": {"column": 1, "unit": "s"}, "r": {"column": 3, "unit": "deg/s"}}
    assert read(path, mapping={"header": False, "channels": channels}).values("r") == pytest.approx(
        np.deg2rad([10, 20])
    )


def test_bare_numbers_parted_by_spaces(tmp_path: Path) -> None:
    path = tmp_path / "flight.asc"
    path.write_text("   0.00   1.0e-01  2\n   0.10  -2.0e-01  3\n   0.20   3.0e-01  4\n", encoding="utf-8")
    channels = {"time": {"column": 1, "unit": "s"}, "q": {"column": 2, "unit": "rad/s"}}
    flight = read(path, mapping={"header": False, "channels": channels})
    np.testing.assert_allclose(flight.values("q"), [0.1, -0.2, 0.3])
    with pytest.raises(FlightError, match="header = false"):
        read(path)
    path.write_text("a letter\nto a friend\n", encoding="utf-8")
    with pytest.raises(FlightError, match="no flight log that is known"):
        read(path)


def test_units_as_an_argument(tmp_path: Path) -> None:
    path = _file(tmp_path, "time,phi\n0,90\n1,0\n")
    # All of it is in the message, with the options to be copied.
    with pytest.raises(UnitError, match=r"phi: has no unit, expected \[rad\].*time: has no unit.*=rad.*--unit time=s"):
        read(path)
    assert read(path, units={"time": "s", "phi": "deg"}).values("phi")[0] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("head", ["t [ms]", "Time (ms)", "TIME [ms]"])
def test_a_time_column_by_its_other_names(tmp_path: Path, head: str) -> None:
    flight = read(_file(tmp_path, f"{head},u [m/s]\n0,1\n20,2\n"))
    assert flight.time("u").tolist() == [0.0, 0.02]
    assert flight.channels == ("u",)


@pytest.mark.parametrize("named", ["t", "time"])
def test_the_unit_of_a_column_t_is_found_as_that_of_time(tmp_path: Path, named: str) -> None:
    path = _file(tmp_path, "t,u [m/s]\n1600000000000,1\n1600000000100,2\n")
    with pytest.raises(UnitError, match=r"time: has no unit.*may be ms \(10 Hz\) or us \(1e\+04 Hz\).*--unit time=s"):
        read(path)
    flight = read(path, units={named: "ms"})
    assert np.diff(flight.time("u")) == pytest.approx([0.1], abs=1e-12)
    assert flight.epoch + flight.start == pytest.approx(1.6e9)
    with pytest.raises(UnitError, match="'m' is a unit of"):
        read(path, units={named: "m"})
    dated = _file(tmp_path, "t,u [m/s]\n2026-03-05T14:20:00Z,1\n2026-03-05T14:20:01Z,2\n", "dated.csv")
    assert np.diff(read(dated).time("u")) == pytest.approx([1.0])


def test_beside_a_column_time_t_is_a_channel(tmp_path: Path) -> None:
    flight = read(_file(tmp_path, "t [degC],time [s],u [m/s]\n20,0,1\n21,1,2\n"))
    assert flight.values("t").tolist() == [20.0, 21.0]
    assert flight.time("u").tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("head", "asked"),
    [("T [s],v [m/s]", "'T'"), ("tme [s],v [m/s]", "'tme'"), ("Time [s],TIME [s]", "'Time' or 'TIME'")],
)
def test_a_column_that_may_be_time_is_asked_about(tmp_path: Path, head: str, asked: str) -> None:
    """A capital T is a temperature as often, and of two times neither is chosen."""
    with pytest.raises(FlightError, match=f"no time column.*Did you mean {asked}\\?"):
        read(_file(tmp_path, f"{head},u [m/s]\n0,1,2\n1,2,3\n"))


def test_a_column_near_a_channels_name_is_asked_about(tmp_path: Path) -> None:
    path = _file(tmp_path, "t [s],servo_rol,Phi [deg],phi_ref,u [m/s],omega_3 [rpm]\n0,1,2,3,4,5\n1,2,3,4,5,6\n")
    flight = read(path)
    notes = [note for note in flight.provenance.notes if "did you mean" in note]
    assert [note.split("'")[1::2] for note in notes] == [["servo_rol", "servo_roll"], ["Phi", "phi"]]
    assert flight.values("servo_rol").tolist() == [1.0, 2.0]  # kept, and under the name that it has
    with pytest.raises(UnitError, match="Did you mean 'servo_rol'"):
        read(path, units={"servo_rl": "1"})
    both = read(_file(tmp_path, "t [s],Phi,phi [deg]\n0,1,2\n1,2,3\n"))
    assert not any("did you mean" in note for note in both.provenance.notes)


def test_a_channel_outside_the_schema_keeps_a_unit_nobody_knows(tmp_path: Path) -> None:
    flight = read(_file(tmp_path, "time [s],temperature [degC],wheel [deg],qdot [deg/s^2]\n0,20,180,90\n1,21,0,0\n"))
    assert flight["qdot"].attrs["units"] == "rad/s^2"
    assert flight.values("qdot")[0] == pytest.approx(np.pi / 2)
    assert flight["temperature"].attrs["units"] == "degC"
    assert flight.values("temperature").tolist() == [20.0, 21.0]
    assert flight["wheel"].attrs["units"] == "rad"
    assert flight.values("wheel")[0] == pytest.approx(np.pi)


BAD_TABLES = {
    "unknown unit": ("time [s],phi [grad]\n0,1\n1,2\n", "phi: unit 'grad' is not known"),
    "wrong unit": ("time [s],phi [m]\n0,1\n1,2\n", r"phi: unit 'm' is a unit of \[m\], expected one of \[rad\]"),
    "no time": ("tau [s],phi [deg]\n0,1\n1,2\n", "time: there is no time column; found tau, phi"),
    "only time": ("time [s],\n0,\n1,\n", "no channel beside time"),
    "no rows": ("time [s],x [m]\n", "time: has no samples"),
    "one sample": ("time [s],x [m]\n0,1\n", "time: has one sample"),
    "infinite": ("time [s],x [m]\n0,1\n1,inf\n2,3\n", "x: 1 of 3 samples are not finite numbers, first at sample 1"),
    "one number": ("time [s],x [m]\n0,nan\n1,1\n", "x: no channel has two numbers"),
    "text": ("time [s],x [m]\n0,1\n1,abc\n", "x: 'abc' in line 3 is not a number"),
    "underscore": ("time [s],x [m]\n0,1_0\n1,1\n", "'1_0' in line 2"),
    "cut off": ("time [s],x [m]\n0,1\n1\n", r"has one sample.*line 3 has 1 cell, the header 2"),
    "backwards": ("time [s],x [m]\n0,1\n2,1\n1,1\n", "time: time goes backwards at sample 2"),
    "duplicated": ("time [s],x [m]\n0,1\n0,2\n", "time: time repeats the stamp before it at sample 1"),
    "doubled name": ("time [s],x [m],x [m]\n0,1,1\n1,1,1\n", "x: the name stands twice"),
    "prose": ("Dear reader, this is no log.", "there is no time column"),
    "mixed decimals": ("time [s];phi [deg]\n0,0;1.5\n0,01;1.6\n", "time: '0,0' in line 2 .*with a comma in all cells"),
    "late point": ("time [s];phi [deg]\n" + "0,5;1,5\n" * 60 + "9,0;1.6\n", r"phi: '1\.6 \(with a point\)' in line 62"),
    "only comments": ("# a, b\n", "holds no table"),
}


@pytest.mark.parametrize(("text", "message"), BAD_TABLES.values(), ids=BAD_TABLES.keys())
def test_a_bad_table_is_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FlightError, match=message) as caught:
        read(_file(tmp_path, text))
    assert "log.csv" in str(caught.value)


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ({"channels": {}}, r"table \[channels\]"),
        ({"chanels": {"time": {"column": "t"}}}, r"table \[channels\]"),
        ({"channels": {"time": "t"}}, "time: the mapping says 't'"),
        ({"channels": {"time": {"column": "nope"}}}, "there is no column 'nope'; the file has t, a"),
        ({"channels": {"time": {"column": "t", "unit": "s"}, "phi": {"column": 9, "unit": "deg"}}}, "no column 9"),
        ({"channels": {"time": {"column": "t", "unit": 3}}}, "unit = 3"),
        ({"channels": {"time": {"column": "t", "factor": "x"}}}, "factor = 'x'"),
        ({"channels": {"time": {"column": "t", "unit": "s"}, "phi": {"column": "a"}}}, "phi: has no unit"),
    ],
)
def test_a_bad_mapping_is_named(tmp_path: Path, mapping: dict[str, Any], message: str) -> None:
    with pytest.raises(FlightError, match=message):
        read(_file(tmp_path, "t,a\n0,1\n1,2\n"), mapping=mapping)


def test_what_is_wrong_with_a_mapping_file_is_said_of_that_file(tmp_path: Path) -> None:
    path = _file(tmp_path, "t,a\n0,1\n1,2\n")
    for text in ("[chanels]\n", "[channels]\ntime = {colum = 't'}\n", "[channels]\ntime = {column = 't', unit = 3}\n"):
        with pytest.raises(FlightError, match=r"mapping\.toml: .*mapping"):
            read(path, mapping=_file(tmp_path, text, "mapping.toml"))


def test_a_spreadsheets_unicode_text_is_read(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes("time [s]\tphi [deg]\n0\t90\n0.01\t0\n".encode("utf-16"))
    assert read(tmp_path / "log.txt").values("phi")[0] == pytest.approx(np.pi / 2)


def test_units_for_a_column_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match=r"phy: .*the file lacks; it has time, phi"):
        read(_file(tmp_path, "time [s],phi\n0,1\n1,2\n"), units={"phy": "deg"})


def test_a_mapping_file_that_is_no_toml(tmp_path: Path) -> None:
    path = _file(tmp_path, "time [s],x [m]\n0,1\n1,2\n")
    with pytest.raises(FlightError, match=r"mapping\.toml: is not TOML.*Correct the mapping file"):
        read(path, mapping=_file(tmp_path, "[channels", "mapping.toml"))
    with pytest.raises(FlightError, match="no such file"):
        read(path, mapping=tmp_path / "none.toml")
    with pytest.raises(FlightError, match=r"blank\.toml: says nothing.*Correct the mapping file"):
        read(path, mapping=_file(tmp_path, " ", "blank.toml"))


def test_binary_rubbish_is_no_flight(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(b"\xa3\x95\x80\x80\x00\x01")
    with pytest.raises(FlightError, match="no flight log that is known"):
        read(tmp_path / "a.bin")


def test_written_numbers_read_back_exactly(tmp_path: Path) -> None:
    numbers = np.array([0.1, 1 / 3, 1e-300, -np.pi * 1e200, -0.0])
    time = np.array([0.0, 0.1, 0.2 + 1e-16, 0.30000000000000004, 1e9])
    flight = Flight({"log": stream(time, {"x": numbers, "odd": numbers[::-1]}, {"odd": "furlong"})})
    (path,) = write_csv(flight, tmp_path / "out.csv")
    assert read(path).streams["log"].identical(flight.streams["log"])


def test_several_streams_become_several_files(tmp_path: Path) -> None:
    streams = {"motion": stream([0, 1], {"x": [1.0, 2.0]}), "inputs": stream([0, 2], {"servo_roll": [0.0, 1.0]})}
    paths = write_csv(Flight(streams), tmp_path / "out.csv")
    assert [path.name for path in paths] == ["out_motion.csv", "out_inputs.csv"]
    assert read(paths[1]).streams["log"].identical(streams["inputs"])


def test_nothing_is_written_where_a_number_is_not_finite(tmp_path: Path) -> None:
    streams = {"a": stream([0, 1], {"x": [1.0, 2.0]}), "b": stream([0, 1], {"y": [1.0, np.nan]})}
    with pytest.raises(FlightError, match="y: holds numbers that are not finite"):
        write_csv(Flight(streams), tmp_path / "out.csv")
    with pytest.raises(WriteError, match="cannot be written"):
        write_csv(Flight({"a": streams["a"]}), tmp_path / "nowhere" / "out.csv")
    assert list(tmp_path.iterdir()) == []
