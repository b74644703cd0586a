"""The reader of CoaX-56 records: frames, names, provenance, and every bad input of a `.mat` file."""

from __future__ import annotations

import hashlib
import struct
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from made_logs import N, coax_record, dimensions, write_coax
from swashplate.errors import FlightError, UnitError
from swashplate.flights.readers.read import read

MEGABYTE = 1 << 20


def test_two_streams_at_the_native_stamps(tmp_path: Path) -> None:
    flight = read(write_coax(tmp_path / "a.mat"))
    record = coax_record()
    assert set(flight.streams) == {"motion", "inputs"}
    assert np.array_equal(flight.time("x"), record["time"])
    assert np.array_equal(flight.time("motor_lower"), record["time"])
    assert flight["logged_vx"].attrs["units"] == "m/s"
    assert flight["logged_wx"].attrs["units"] == "rad/s"
    assert flight["servo_pitch"].attrs["units"] == "1"


def test_z_up_becomes_north_east_down(tmp_path: Path) -> None:
    flight, record = read(write_coax(tmp_path / "a.mat")), coax_record()
    for names, field in ((("x", "y", "z"), "position"), (("logged_wx", "logged_wy", "logged_wz"), "angtwist")):
        for name, sign, row in zip(names, (1.0, -1.0, -1.0), record[field], strict=True):
            assert np.array_equal(flight.values(name), sign * row), name
    x, y, z, w = record["orientation"]
    for name, expected in zip(("qw", "qx", "qy", "qz"), (w, x, -y, -z), strict=True):
        assert np.array_equal(flight.values(name), expected), name


def test_inputs_get_the_names_of_their_rows(tmp_path: Path) -> None:
    flight, inputs = read(write_coax(tmp_path / "a.mat")), coax_record()["inputs"]
    for row, name in enumerate(("motor_upper", "motor_lower", "servo_roll", "servo_pitch")):
        assert np.array_equal(flight.values(name), inputs[row]), name


def test_provenance_names_the_file_its_hash_and_the_reader(tmp_path: Path) -> None:
    path = write_coax(tmp_path / "a.mat")
    provenance = read(path).provenance
    assert provenance.source == "a.mat"
    assert provenance.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert (provenance.reader, bool(provenance.reader_version)) == ("coax56", True)
    assert not provenance.simulated
    assert any("no battery channel" in note for note in provenance.notes)


def test_the_name_of_the_file_does_not_matter(tmp_path: Path) -> None:
    assert "qw" in read(write_coax(tmp_path / "a.mat").rename(tmp_path / "log.txt"))


@pytest.mark.parametrize("compressed", [True, False])
def test_compression_changes_nothing(tmp_path: Path, compressed: bool) -> None:
    flight = read(write_coax(tmp_path / "a.mat", compressed=compressed))
    assert np.array_equal(flight.values("x"), coax_record()["position"][0])


def test_sign_flips_stay_and_are_counted(tmp_path: Path) -> None:
    orientation = coax_record()["orientation"] * np.where(np.arange(N) >= 5, -1.0, 1.0)
    flight = read(write_coax(tmp_path / "a.mat", orientation=orientation))
    assert flight.values("qw")[4] > 0 > flight.values("qw")[5]
    assert any("flips its sign 1 times" in note for note in flight.provenance.notes)


def test_a_constant_input_is_a_note(tmp_path: Path) -> None:
    inputs = coax_record()["inputs"]
    inputs[2] = 0.25
    notes = read(write_coax(tmp_path / "a.mat", inputs=inputs)).provenance.notes
    assert [note for note in notes if "never moves" in note] == [
        "servo_roll never moves (0.25 throughout): nothing about it can be identified from this record"
    ]


def test_units_can_be_told(tmp_path: Path) -> None:
    record = coax_record()
    path = write_coax(tmp_path / "a.mat", position=1000.0 * record["position"])
    with pytest.raises(UnitError, match="wrong units"):
        read(path)
    assert np.allclose(read(path, units={"position": "mm"}).values("x"), record["position"][0], rtol=1e-15)
    with pytest.raises(UnitError, match=r"expected one of \[m\]"):
        read(path, units={"position": "deg"})
    with pytest.raises(UnitError, match="altitude"):
        read(path, units={"altitude": "m"})


def test_dropping_bad_stamps_is_counted(tmp_path: Path) -> None:
    time = coax_record()["time"].copy()
    time[4], time[7] = time[3], time[2]
    flight = read(write_coax(tmp_path / "a.mat", time=time), bad_stamps="drop")
    assert flight.time("x").size == N - 2
    (said,) = flight.provenance.damage
    assert "2 of 12 samples (16.7 %) are lost" in said
    assert "sample 4" in said


def _time(index: int, source: int) -> np.ndarray:
    time = coax_record()["time"].copy()
    time[index] = time[source]
    return time


def _with_nan(field: str) -> dict[str, Any]:
    values = coax_record()[field].copy()
    values[..., 3] = np.nan
    return {field: values}


BAD = {
    "missing field": ({"inputs": None}, "inputs.*lacks inputs"),
    "one row too few": ({"position": np.ones((2, N))}, r"Data\.position.*shape \(2, 12\), expected \(3, 12\)"),
    "turned": ({"inputs": coax_record()["inputs"].T}, r"Data\.inputs.*shape"),
    "too short": ({"lintwist": np.ones((3, N - 1))}, r"Data\.lintwist.*shape"),
    "text": ({"position": "abc"}, r"Data\.position.*real numbers"),
    "complex": ({"position": 1j * np.ones((3, N))}, r"Data\.position.*real numbers"),
    "empty": ({"time": np.zeros(0)}, r"Data\.time.*empty"),
    "NaN in time": (_with_nan("time"), r"Data\.time.*first at sample 3"),
    "NaN in inputs": (_with_nan("inputs"), r"Data\.inputs.*first at sample 3"),
    "infinite": ({"position": np.full((3, N), np.inf)}, r"Data\.position.*not finite"),
    "duplicated stamp": ({"time": _time(6, 5)}, r"Data\.time.*repeats.*sample 6"),
    "backwards": ({"time": _time(6, 2)}, r"Data\.time.*backwards at sample 6"),
    "zero quaternions": ({"orientation": np.zeros((4, N))}, r"Data\.orientation.*norm"),
    "pulse widths": ({"inputs": 1500.0 + coax_record()["inputs"]}, r"Data\.inputs.*wrong units"),
}


@pytest.mark.parametrize(("changes", "message"), BAD.values(), ids=BAD.keys())
def test_a_bad_record_is_named_with_file_and_field(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(FlightError, match=message) as caught:
        read(write_coax(tmp_path / "bad.mat", **changes))
    assert "bad.mat" in str(caught.value)


def test_one_sample_is_no_flight(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match="one sample"):
        read(write_coax(tmp_path / "one.mat", n=1))


@pytest.mark.parametrize(
    ("variables", "found"),
    [({"fdata": np.eye(3)}, "fdata"), ({"Data": np.eye(3)}, "Data"), ({"in2rpm": {"w0": np.ones(11)}}, r"in2rpm\.w0")],
)
def test_what_another_file_holds_is_named(tmp_path: Path, variables: dict[str, Any], found: str) -> None:
    savemat(tmp_path / "other.mat", variables)
    with pytest.raises(FlightError, match=f"no time column; found {found}.*mapping file"):
        read(tmp_path / "other.mat")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b"time,x\n0,1\n", "not a MATLAB"),
        (b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n", r"damaged MATLAB 7\.3 file"),
        (b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM", "holds nothing"),
        (b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\xff" * 64, "damaged"),
        (b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\x0f\0\0\0\x08\0\0\0notazlib", "does not unpack"),
    ],
)
def test_what_is_no_mat_file_says_so(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "a.mat").write_bytes(content)
    with pytest.raises(FlightError, match=message):
        read(tmp_path / "a.mat")


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match=r"nowhere\.mat: there is no such file"):
        read(tmp_path / "nowhere.mat")
    with pytest.raises(FlightError, match="is a folder"):
        read(tmp_path)


HUGE = 1_250_000_000  # doubles: 10 GB
FORGED = {
    "matrix": (dimensions(3, N), dimensions(3, HUGE), 3),
    "struct": (dimensions(1, 1), dimensions(HUGE, 1), 1),
    "negative": (dimensions(3, N), dimensions(-3, N), 3),
}


@pytest.mark.parametrize(("old", "new", "places"), FORGED.values(), ids=FORGED.keys())
def test_forged_sizes_are_refused_before_memory_is_taken(tmp_path: Path, old: bytes, new: bytes, places: int) -> None:
    path = write_coax(tmp_path / "forged.mat", compressed=False)
    content = path.read_bytes()
    assert content.count(old) == places
    path.write_bytes(content.replace(old, new, 1))
    assert _peak_of_refusal(path, "damaged") < MEGABYTE


def test_forged_element_size(tmp_path: Path) -> None:
    path = write_coax(tmp_path / "forged.mat", compressed=False)
    content = path.read_bytes()
    path.write_bytes(content[:132] + b"\xff\xff\xff\x7f" + content[136:])
    assert _peak_of_refusal(path, "claims 2,147,483,647 bytes") < MEGABYTE


def test_forged_compressed_size(tmp_path: Path) -> None:
    """A small compressed variable whose own tag claims 4 GB, with zeros enough behind it to unpack to 100 MB."""
    packed = zlib.compress(struct.pack("<II", 14, 0xFFFFFF00) + bytes(100 * MEGABYTE), 9)
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (tmp_path / "bomb.mat").write_bytes(header + struct.pack("<II", 15, len(packed)) + packed)
    assert _peak_of_refusal(tmp_path / "bomb.mat", "damaged or forged") < 4 * MEGABYTE


def _peak_of_refusal(path: Path, message: str) -> int:
    """Peak of memory [bytes] while a file is refused with a message."""
    read_once = path.stat().st_size
    tracemalloc.start()
    try:
        with pytest.raises(FlightError, match=message):
            read(path)
        return tracemalloc.get_traced_memory()[1] - read_once
    finally:
        tracemalloc.stop()


def test_all_fields_with_damaged_numbers_are_named_at_once(tmp_path: Path) -> None:
    fields = coax_record()
    position, inputs = fields["position"].copy(), fields["inputs"].copy()
    position[1, 3], inputs[0, 5] = np.nan, np.inf
    with pytest.raises(FlightError, match=r"2 faults: \(1\) Data\.position: 1 of 12 .*\(2\) Data\.inputs: 1 of 12"):
        read(write_coax(tmp_path / "a.mat", position=position, inputs=inputs))
