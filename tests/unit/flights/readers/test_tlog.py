"""A ground station's telemetry log against pymavlink's own writer: numbers, modes of each vehicle, damage told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pymavlink", reason="the extra `link` is not installed")

import swashplate as sp
from made_telemetry import BOOT, telemetry
from swashplate.errors import FlightError
from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.readers.log_fields import log_fields


@pytest.mark.parametrize("version", [1, 2])
def test_numbers_are_those_that_were_sent_on_the_autopilots_clock(tmp_path: Path, version: int) -> None:
    flight = sp.read(telemetry(tmp_path / "flight.tlog", version=version))
    t = flight.time("phi") - BOOT
    assert t == pytest.approx(0.1 * np.arange(200), abs=2e-3)
    assert flight.values("phi") == pytest.approx(0.2 * np.sin(t), abs=1e-6)
    assert flight.values("p") == pytest.approx(0.2 * np.cos(t), abs=1e-6)
    assert flight.values("p_imu") == pytest.approx(flight.values("p"), abs=6e-4)  # whole mrad/s
    assert flight.values("az_imu") == pytest.approx(-9.80665)
    assert np.degrees(flight.values("latitude")[[0, -1]]) == pytest.approx([47.3, 47.3 + 199e-7])
    assert flight.values("voltage") == pytest.approx(12.6)
    assert flight.time("voltage")[0] == pytest.approx(BOOT, abs=0.03)
    assert flight.values("rcout_1")[:2] == pytest.approx([1.500e-3, 1.501e-3])
    assert "rcout_2" not in flight, "nothing is connected"
    assert flight.provenance.parameters["ATC_RAT_RLL_P"] == pytest.approx(0.11)
    assert flight.provenance.damage == ()
    assert "10 samples a second" in flight.provenance.notes[0]
    assert "too slow for a fit" in flight.provenance.notes[0]


@pytest.mark.parametrize(
    ("kind", "autopilot", "modes", "named", "what"),
    [
        (4, 3, {0.0: 0, 5.0: 5}, ["STABILIZE", "LOITER"], "a helicopter"),
        (1, 3, {0.0: 5, 5.0: 11}, ["FBWA", "RTL"], "a plane"),
        (10, 3, {0.0: 4}, ["HOLD"], "a rover"),
        (11, 3, {0.0: 0}, ["MANUAL"], "a boat"),
        (12, 3, {0.0: 19}, ["MANUAL"], "a submarine"),
        (2, 3, {0.0: 5}, ["LOITER"], "a multirotor with 4 rotors"),
        (2, 12, {0.0: 3 << 16, 4.0: 4 << 16 | 5 << 24}, ["POSCTL", "AUTO RTL"], "a multirotor with 4 rotors"),
    ],
)
def test_every_vehicle_has_its_own_modes_and_is_told_what_it_is(
    tmp_path: Path, kind: int, autopilot: int, modes: dict[float, int], named: list[str], what: str
) -> None:
    flight = sp.read(telemetry(tmp_path / "flight.tlog", kind=kind, autopilot=autopilot, modes=modes))
    assert [event.text for event in flight.provenance.events if event.kind == "mode"] == named
    told = aircraft_kind(flight)
    assert told is not None
    assert told.noun == what
    assert [event.kind for event in flight.provenance.events if "arm" in event.kind] == ["armed"]


def test_the_firmwares_own_message_names_it(tmp_path: Path) -> None:
    flight = sp.read(telemetry(tmp_path / "flight.tlog", said="ArduCopter V4.5.7 (2a3dc4b7)"))
    assert flight.provenance.autopilot == "ArduCopter V4.5.7 (2a3dc4b7)"


def test_a_frame_that_was_damaged_is_left_out_and_told(tmp_path: Path) -> None:
    """One bit of a roll angle: the checksum says it, and no other number changes."""
    path = telemetry(tmp_path / "flight.tlog")
    whole, content = sp.read(path), bytearray(path.read_bytes())
    at = content.index(np.float32(0.2 * np.sin(5.0)).tobytes())
    content[at + 3] ^= 0x40
    path.write_bytes(content)
    flight = sp.read(path)
    assert any("1 of " in text and "wrong checksum" in text for text in flight.provenance.damage)
    assert flight.time("phi").size == whole.time("phi").size - 1
    assert np.max(np.abs(flight.values("phi"))) < 0.21
    path.write_bytes(content[:1000] + b"\x00" * 37 + content[1000:])
    torn = sp.read(path)
    assert any("bytes" in text and "no frame" in text for text in torn.provenance.damage)
    assert torn.time("phi").size >= whole.time("phi").size - 4


def test_a_clock_that_starts_anew_leaves_one_run(tmp_path: Path) -> None:
    first, second = telemetry(tmp_path / "a.tlog", seconds=8.0), telemetry(tmp_path / "b.tlog")
    both = tmp_path / "both.tlog"
    both.write_bytes(first.read_bytes() + second.read_bytes())
    flight = sp.read(both)
    assert flight.duration == pytest.approx(19.9, abs=0.05)
    assert any("the clock starts anew once" in text for text in flight.provenance.damage)


def test_every_field_is_listed_with_its_unit(tmp_path: Path) -> None:
    fields = log_fields(telemetry(tmp_path / "flight.tlog"))
    assert fields is not None
    assert (fields.listed["ATTITUDE.roll"].unit, fields.listed["GPS_RAW_INT.vel"].unit) == ("rad", "cm/s")
    assert "HEARTBEAT.custom_mode" in fields.listed
    time, values = fields.read("ATTITUDE.roll")
    assert values == pytest.approx(0.2 * np.sin(time - BOOT), abs=1e-6)


def test_a_log_in_which_nothing_flew_is_no_flight(tmp_path: Path) -> None:
    path = telemetry(tmp_path / "flight.tlog", seconds=0.05)
    with pytest.raises(FlightError, match=r"holds no flight: no known message has two samples .*HEARTBEAT"):
        sp.read(path)
