"""PX4 logs, ULog and the older px4log, in files that the tests write themselves."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from made_autopilot_logs import PX4LOG, dataflash, px4_rows, ulog
from swashplate.errors import FlightError, MissingLibraryError
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read


def _flight(folder: Path, content: bytes, name: str) -> Flight:
    (folder / name).write_bytes(content)
    return read(folder / name)


def test_a_ulog_becomes_a_flight_with_the_times_of_measurement(tmp_path: Path) -> None:
    flight = _flight(tmp_path, ulog(), "a.ulg")
    k = np.arange(100)
    assert_allclose(flight.time("p"), 2.0 + 4e-3 * k - 1e-3, rtol=1e-12)  # measured 1 ms before it was published
    assert_allclose(flight.time("mixer_roll"), 2.0 + 4e-3 * k, rtol=1e-12)
    assert_allclose(flight.values("p"), 0.5 * np.sin(2 * np.pi * k / 25), atol=1e-7)
    assert_allclose(flight.values("mixer_collective"), 0.6, rtol=1e-6)
    assert flight.time("qw")[0] == 2.0  # a sample time of zero is none
    assert flight.rate("az") == pytest.approx(125.0)
    assert_allclose(flight.values("servo_3"), 0.3, rtol=1e-6)
    assert "servo_4" not in flight
    provenance = flight.provenance
    assert provenance.vehicle == "PX4"
    assert provenance.parameters == pytest.approx({"MC_ROLLRATE_P": 0.15, "MAV_TYPE": 4.0})
    assert provenance.parameter("MC_ROLLRATE_P") == pytest.approx(0.2)
    assert {(e.kind, e.text) for e in provenance.events} >= {("message", "Armed by RC"), ("armed", "armed")}
    assert any("strange_topic (10)" in note for note in provenance.notes)
    assert provenance.damage == ()


def test_dropouts_and_a_cut_are_said(tmp_path: Path) -> None:
    damage = _flight(tmp_path, ulog(dropout=True)[:-7], "a.ulg").provenance.damage
    assert any("1 dropouts: the logger lost 0.12 s in all" in said for said in damage)
    assert any("cut off" in said for said in damage)


def test_a_damaged_ulog_gives_what_is_left(tmp_path: Path) -> None:
    content = bytearray(ulog(400))
    middle = len(content) // 2
    content[middle : middle + 30] = b"\xee" * 30
    flight = _flight(tmp_path, bytes(content), "a.ulg")
    assert flight.time("p").size > 100
    assert flight.provenance.damage


def test_a_ulog_without_known_topics_or_with_forged_arrays_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match=r"a\.ulg: holds no flight"):
        _flight(tmp_path, ulog(1), "a.ulg")
    forged = ulog().replace(b"_sample;float[3] xyz", b"_sa;float[99999] xyz")  # as long as before
    with pytest.raises(FlightError, match="damaged or forged"):
        _flight(tmp_path, forged, "a.ulg")
    with pytest.raises(FlightError, match="does not read as a ULog file"):
        _flight(tmp_path, ulog()[:12], "a.ulg")


def test_without_pyulog_the_error_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyulog", None)
    monkeypatch.setitem(sys.modules, "pyulog.core", None)
    with pytest.raises(MissingLibraryError, match=r"needs the library pyulog,.*pip install 'swashplate\[logs\]'"):
        _flight(tmp_path, ulog(), "a.ulg")


def test_a_px4log_is_stamped_by_its_time_messages(tmp_path: Path) -> None:
    flight = _flight(tmp_path, dataflash(px4_rows(), PX4LOG), "a.px4log")
    assert_allclose(flight.time("az"), 5.0 + 0.02 * np.arange(60), rtol=1e-12)
    assert_allclose(flight.time("phi"), 5.0 + 0.04 * np.arange(30), rtol=1e-12)
    assert_allclose(flight.values("p"), 0.02 * np.arange(30), atol=1e-7)
    assert_allclose(flight.values("rcout_1"), 1.5e-3)
    assert "rcout_3" not in flight
    provenance = flight.provenance
    assert (provenance.reader, provenance.vehicle) == ("px4log", "PX4FMU_V2 abcdef")
    assert provenance.parameters == {"MC_ROLL_P": 6.5}
    assert [event.text for event in provenance.events] == ["state 0", "state 2"]
    assert any("mixer_pitch never moves" in note for note in provenance.notes)
    assert any("FOO (6)" in note for note in provenance.notes)


def test_a_px4log_whose_clock_starts_anew(tmp_path: Path) -> None:
    rows = [*px4_rows(20), *px4_rows(60)]
    flight = _flight(tmp_path, dataflash(rows, PX4LOG), "a.px4log")
    # It falls back by 0.4 s only: stamps that overlap are left out.
    assert "attitude: 10 of 40 samples (25 %) are lost because their time" in flight.provenance.damage[0]
    rows = [*[row if row[0] != "TIME" else ("TIME", (row[1][0] + 60_000_000,)) for row in px4_rows(20)], *px4_rows(60)]
    flight = _flight(tmp_path, dataflash(rows, PX4LOG), "a.px4log")
    assert flight.time("az").size == 60
    assert "clock starts anew" in flight.provenance.damage[0]


def test_a_px4log_with_nothing_in_it_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match="holds no flight"):
        _flight(tmp_path, dataflash(px4_rows(1), PX4LOG), "a.px4log")
