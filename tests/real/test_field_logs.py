"""Logs as people have them (`field/` of the real data): what each folder's README calls right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError
from swashplate.flights.readers.log_fields import log_fields


@pytest.fixture
def field(shared_data: Path) -> Path:
    return shared_data / "field"


# ---- 02: firmware before 3.1 -----------------------------------------------------------------------------------------
def test_a_log_without_stamps_takes_them_from_the_gps(field: Path) -> None:
    flight = sp.read(field / "02-no-time-old-text-log" / "tradheli_v301.log")
    assert flight.duration == pytest.approx(59.7, abs=0.2)  # 300 fixes, 0.2 s apart
    assert flight.rate("phi") == pytest.approx(10.0, rel=0.3)
    (note,) = (text for text in flight.provenance.notes if "no time stamps" in text)
    assert "too coarse for a fit" in note
    assert "LOG_BITMASK" not in note
    assert flight.provenance.events[0].text == "STABILIZE"


def test_without_a_gps_there_is_no_time(field: Path, tmp_path: Path) -> None:
    text = (field / "02-no-time-old-text-log" / "tradheli_v301.log").read_text()
    bare = tmp_path / "bare.log"
    bare.write_text("\n".join(line for line in text.splitlines() if not line.startswith("GPS")))
    with pytest.raises(FlightError, match=r"no time stamps.*firmware before 3\.1") as told:
        sp.read(bare)
    assert "LOG_BITMASK" not in str(told.value)
    assert "Copy" not in str(told.value)


# ---- 03: modes of other vehicles -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("log", "modes"),
    [
        ("plane", ["MANUAL", "FBWA", "AUTO", "RTL", "LOITER", "STABILIZE", "QLOITER"]),
        ("rover", ["MANUAL", "HOLD", "AUTO", "RTL", "GUIDED"]),
        ("sub", ["MANUAL", "STABILIZE", "ALT_HOLD", "SURFACE", "POSHOLD"]),
    ],
)
def test_modes_of_planes_rovers_and_subs(field: Path, log: str, modes: list[str]) -> None:
    events = sp.read(field / "03-plane-modes" / f"{log}.bin").provenance.events
    assert [event.text for event in events if event.kind == "mode"] == modes


# ---- 05: stamps in ROS bags ------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("log", "what"), [("plane", "a plane"), ("rover", "a rover"), ("sub", "a submarine")])
def test_a_vehicle_that_is_no_helicopter_is_told_what_is_made_for_it(field: Path, log: str, what: str) -> None:
    notes = sp.inspect(sp.read(field / "03-plane-modes" / f"{log}.bin")).notes
    (told,) = (text for text in notes if text.startswith(what))
    assert "plotted" in told
    assert "for helicopters and multirotors only" in told


@pytest.mark.parametrize(
    ("bag", "lost"), [("duplicate", 50.0), ("restart", 50.0), ("disorder", 2.0), ("ok_mcap", 0.0), ("ok_sqlite", 0.0)]
)
def test_what_a_bag_loses_is_a_problem_with_its_share(field: Path, bag: str, lost: float) -> None:
    pytest.importorskip("rosbags")
    flight = sp.read(field / "05-ros" / bag)
    assert bool(flight.provenance.damage) == (lost > 0.0)
    if lost:
        assert f"({lost:g} %) are lost" in flight.provenance.damage[0]
        assert flight.provenance.damage[0] in sp.inspect(flight).problems


@pytest.mark.parametrize("bag", ["ok_mcap", "ok_sqlite", "zero_stamp"])
def test_every_field_of_a_bag_is_listed_on_the_flights_clock(field: Path, bag: str) -> None:
    pytest.importorskip("rosbags")
    path = field / "05-ros" / bag
    flight, fields = sp.read(path), log_fields(path)
    assert fields is not None
    assert flight.provenance.damage == ()
    assert {"imu.angular_velocity.x", "imu.orientation.w", "pose.pose.position.z"} <= set(fields.listed)
    assert not any("covariance" in name for name in fields.listed)
    time, rate = fields.read("imu.angular_velocity.x")
    assert time - flight.epoch == pytest.approx(flight.time("p"), abs=1e-6)
    assert rate == pytest.approx(flight.values("p"))


# ---- 19: another firmware's Blackbox ---------------------------------------------------------------------------------
def test_an_inav_log(field: Path) -> None:
    flight = sp.read(field / "19-inav" / "inav.bbl")
    assert {"p", "phi", "theta", "vbat", "navPos_0", "navPos_2"} <= set(flight.channels)
    assert np.median(flight.values("altitude_baro")) == pytest.approx(1.2)
    assert flight["vbat"].attrs["units"] == ""
    assert flight.provenance.damage == ()
