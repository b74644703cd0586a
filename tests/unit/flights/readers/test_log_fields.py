"""Every field of every message is listed with its unit, and read at the times of the flight."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import made_autopilot_logs as made
import swashplate as sp
from swashplate.errors import FlightError
from swashplate.flights.readers.log_fields import LogFields, log_fields

FORMATS = {
    **made.ARDUPILOT,
    "UNIT": (40, "QbZ", "TimeUS,Id,Label"),
    "MULT": (41, "Qbd", "TimeUS,Id,Mult"),
    "FMTU": (42, "QBNN", "TimeUS,FmtType,UnitIds,MultIds"),
    "VIBE": (43, "QBfH", "TimeUS,IMU,VibeX,Clip"),
}
ABOUT = [
    ("UNIT", (1, ord("o"), "m/s^2")), ("UNIT", (1, ord("s"), "s")), ("UNIT", (1, ord("-"), "")),
    ("MULT", (1, ord("-"), 0.0)), ("MULT", (1, ord("B"), 0.01)), ("MULT", (1, ord("F"), 1e-6)),
    ("FMTU", (1, 43, "s#o-", "F--B")),
]  # fmt: skip


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """The usual flight with two sensors of vibration, of which the second counts three times as much."""
    rows = [*ABOUT, *made.ardupilot_rows()]
    times = np.arange(21_000_000, 30_000_000, 200_000).tolist()
    rows += [("VIBE", (t, i, (1.0 + 2.0 * i) * 1e-6 * t, 7)) for t in times for i in (0, 1)]
    path = tmp_path / "flight.bin"
    path.write_bytes(made.dataflash(rows, FORMATS))
    return path


def fields(path: Path) -> LogFields:
    found = log_fields(path)
    assert found is not None
    return found


def test_what_the_schema_does_not_know_is_there_with_its_unit_and_instance(log: Path) -> None:
    found = fields(log)
    assert {"VIBE[0].VibeX", "VIBE[1].Clip", "XYZ1.Foo", "RATE.RDes", "IMU[1].AccZ"} <= found.listed.keys()
    field = found.listed["VIBE[1].VibeX"]
    assert (field.unit, field.samples, field.rate) == ("m/s^2", 45, 5.0)
    time, values = found.read("VIBE[1].VibeX")
    assert values == pytest.approx(3.0 * time, rel=1e-6)
    assert found.read("VIBE[0].Clip")[1] == pytest.approx(0.07), "the log's own factor"
    assert not {"VIBE[0].IMU", "PARM.Value"} & found.listed.keys(), "which sensor, and what is no measurement"


def test_a_known_field_is_the_flights_channel(log: Path) -> None:
    flight, found = sp.read(log), fields(log)
    time, values = found.read("RATE.R")
    assert time == pytest.approx(flight.time("p"))
    assert values == pytest.approx(np.degrees(flight.values("p")), abs=1e-5)


def test_stamps_that_go_back_are_left_out_and_no_runs_are_joined(tmp_path: Path) -> None:
    rows = [("XYZ1", (t, 1.0, 2.0)) for t in (10, 20, 15, 30, 40)]
    late = [("XYZ1", (1_000_000 * t, 5.0, 2.0)) for t in range(100, 130)]
    again = [("XYZ1", (1_000_000 * t, 9.0, 2.0)) for t in range(3)]
    path = tmp_path / "x.bin"
    path.write_bytes(made.dataflash([*rows, *late, *again]))
    time, values = fields(path).read("XYZ1.Foo")
    assert (np.diff(time) > 0.0).all()
    assert 9.0 not in values


def test_a_file_that_was_written_anew_is_not_read_at_old_places(log: Path) -> None:
    found = fields(log)
    log.write_bytes(log.read_bytes() + bytes(10))
    with pytest.raises(FlightError, match="has changed"):
        found.read("XYZ1.Foo")
    with pytest.raises(FlightError, match="no field"):
        found.read("XYZ1.Nothing")


def test_text_logs_and_ulogs_list_their_messages(tmp_path: Path) -> None:
    text, ulog = tmp_path / "a.log", tmp_path / "a.ulg"
    text.write_text(made.dataflash_text(made.ardupilot_rows()))
    assert fields(text).read("XYZ1.Bar")[1] == pytest.approx(2.0)
    pytest.importorskip("pyulog")
    ulog.write_bytes(made.ulog())
    assert fields(ulog).read("strange_topic.foo")[1] == pytest.approx(1.0)


def test_early_px4_takes_the_time_of_the_message_before(tmp_path: Path) -> None:
    path = tmp_path / "a.px4log"
    path.write_bytes(made.dataflash(made.px4_rows(), made.PX4LOG))
    time, values = fields(path).read("FOO.Bar")
    assert time == pytest.approx(5.0 + 0.2 * np.arange(6))
    assert values == pytest.approx(1.0)


def test_a_table_has_nothing_beside_its_channels(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time,p\n0,1\n")
    assert log_fields(path) is None
    torn = tmp_path / "torn.ulg"
    torn.write_bytes(made.ulog()[:20] + struct.pack("<I", 9))
    assert log_fields(torn) is None or not log_fields(torn).listed  # type: ignore[union-attr]
