"""ArduPilot's DataFlash logs, binary and text: what is read, under which name and unit, and what damage costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import swashplate as sp
from made_autopilot_logs import ARDUPILOT, CHIRP, Row, ardupilot_rows, dataflash, dataflash_text, fmt
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers import clocked
from swashplate.flights.readers.dataflash import messages
from swashplate.flights.readers.read import read


def _flight(folder: Path, content: bytes | str, name: str = "a.bin") -> Flight:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read(path)


def test_every_message_becomes_a_stream_at_its_own_rate_in_si(tmp_path: Path) -> None:
    flight = _flight(tmp_path, dataflash(ardupilot_rows()))
    assert flight.rate("p") == pytest.approx(50.0)
    assert flight.rate("phi_slow") == pytest.approx(10.0)
    assert flight.start == 20.0
    assert_allclose(flight.values("phi"), np.deg2rad(2.0 * np.sin(flight.time("phi"))), atol=1e-8)
    assert_allclose(flight.values("psi"), np.pi / 2, rtol=1e-7)
    assert_allclose(flight.values("p"), np.deg2rad(100.0) * flight.values("mixer_roll"), rtol=1e-6, atol=1e-9)
    assert_allclose(flight.values("omega_rotor"), 1500.0 * 2.0 * np.pi / 60.0, rtol=1e-6)
    assert_allclose(flight.values("az"), -9.8, rtol=1e-6)
    assert_allclose(flight.values("az_imu2"), -10.8, rtol=1e-6)
    assert_allclose(np.unique(flight.values("rcin_2")), 1.5e-3 + 1e-6 * np.arange(7), rtol=1e-12)
    assert flight["p_imu"].attrs["units"] == "rad/s"
    assert flight["mixer_collective"].attrs["units"] == "1"


_PID = "TimeUS,Tar,Act,Err,P,I,D,FF,DFF,Dmod,SRate,Flags"


def _loop(seconds: float = 60.0, rate: float = 200.0) -> tuple[list[Row], dict[str, tuple[int, str, str]], np.ndarray]:
    """Rows of a roll loop in gusts: rate = 40 / (s + 3) of the command, P 0.1 and I 0.2, a chirp at the mixer."""
    n, random = round(seconds * rate), np.random.default_rng(5)
    time = 20.0 + np.arange(n) / rate
    chirp = 0.1 * np.sin(2.0 * np.pi * np.cumsum(np.geomspace(0.2, 12.0, n)) / rate)
    p, summed, gust, rows = 0.0, 0.0, 0.0, []
    for k in range(n):
        proportional = -0.1 * p
        summed -= 0.2 * p / rate
        command = proportional + summed + chirp[k]
        us = round(1e6 * float(time[k]))
        rows.append(("RATE", (us, 0.0, np.degrees(p), command, *[0.0] * 8, 0.5 + 1e-4 * (k % 2))))
        rows.append(("PIDR", (us, 0.0, p, -p, proportional, summed, 0.0, 0.0, 0.0, 1.0, 0.0, 0)))
        gust += (-2.0 * gust + 0.5 * random.standard_normal()) / rate
        p += (-3.0 * p + 40.0 * command + gust) / rate
    return rows, {**ARDUPILOT, "PIDR": (80, "QffffffffffB", _PID)}, chirp


def test_terms_of_the_rate_controller_tell_the_loop_at_the_actuator(tmp_path: Path) -> None:
    rows, formats, chirp = _loop()
    flight = _flight(tmp_path, dataflash(rows, formats))
    total = sum(flight.values(f"pid_{term}_roll") for term in ("p", "i", "d", "f", "df"))
    assert_allclose(flight.values("pid_roll"), total, atol=1e-7)
    assert flight["pid_roll"].attrs["units"] == "1"
    channels = {name: flight.values(name) for name in ("mixer_roll", "pid_roll", "p")} | {"injected": chirp}
    log = Flight.from_arrays(flight.time("pid_roll"), channels, units={"injected": "1", "pid_roll": "1"})
    found = sp.respond(log, inputs=("mixer_roll",), outputs=("pid_roll",), references=("injected",), band=(0.4, 8.0))
    loop = sp.combine("negative", found)
    s = 1j * loop.omega
    ratio = loop.response[:, 0, 0] / ((0.1 + 0.2 / s) * 40.0 / (s + 3.0))
    # A sample passes from rate to command, and Euler's steps are half a sample late.
    assert np.max(np.abs(np.log(np.abs(ratio)))) < 0.1
    told = sp.combine("closed", loop)
    assert_allclose(told.response[:, 0, 0], loop.response[:, 0, 0] / (1.0 + loop.response[:, 0, 0]), rtol=1e-12)
    plane = [("MSG", (20_000_000, "ArduPlane V4.5.0")), *rows[:2000]]
    assert "pid_roll" not in _flight(tmp_path, dataflash(plane, formats), name="plane.bin")


def test_second_opinions_get_a_suffix_and_unused_channels_are_left_out(tmp_path: Path) -> None:
    flight = _flight(tmp_path, dataflash(ardupilot_rows()))
    for name in ("phi_slow", "p_imu", "p_imu2", "p_sid", "az_sid", "phi_demand", "p_demand"):
        assert name in flight
    assert "rcin_3" not in flight
    bare = [row for row in ardupilot_rows() if row[0] not in ("ANG", "RATE", "SIDD", "SIDS")]
    flight = _flight(tmp_path, dataflash(bare))
    assert "phi" in flight
    assert "phi_slow" not in flight
    assert flight.stream_of("p") == "inertial"


def test_parameters_events_and_the_sweep_are_kept(tmp_path: Path) -> None:
    provenance = _flight(tmp_path, dataflash(ardupilot_rows())).provenance
    assert provenance.vehicle == "ArduCopter V4.7.0-dev (1234abcd), HELI"
    assert provenance.firmware == provenance.autopilot == "ArduCopter V4.7.0-dev (1234abcd)"
    assert replace(provenance, firmware="").autopilot == "ArduPilot", "the format tells that much"
    assert provenance.parameters == {"SID_AXIS": 10.0, "SCHED_LOOP_RATE": 400.0}
    assert provenance.parameter("SID_AXIS", at=25.0) == 10.0
    assert provenance.parameter("SID_AXIS") == 11.0
    assert provenance.parameter("NONE") is None
    assert [e.text for e in provenance.events if e.kind == "mode"] == ["STABILIZE", "SYSTEMID"]
    (sweep,) = (event for event in provenance.events if event.kind == "sweep")
    assert sweep.details["start"] == pytest.approx(22.0, abs=1e-6)
    assert sweep.details["stop"] == pytest.approx(22.0 + CHIRP.record, abs=1e-3)
    assert sweep.text == "roll mixer, 0.5-8 Hz in 12 s"
    assert any("XYZ1" in note for note in provenance.notes)
    assert provenance.damage == ()


def test_the_provenance_survives_a_file(tmp_path: Path) -> None:
    flight = _flight(tmp_path, dataflash(ardupilot_rows(until=25.0)))
    loaded = Flight.load(flight.save(tmp_path / "a.nc"))
    assert loaded.provenance == flight.provenance
    assert loaded.provenance.damage


def test_the_text_log_says_the_same(tmp_path: Path) -> None:
    rows = ardupilot_rows()
    binary = _flight(tmp_path, dataflash(rows))
    text = _flight(tmp_path, dataflash_text(rows), "a.log")
    assert text.channels == binary.channels
    for name in binary.channels:
        rounding = np.deg2rad(0.005) * 1.01 if name.endswith("_slow") else 1e-6  # ATT comes in hundredths of a degree
        assert_allclose(text.values(name), binary.values(name), rtol=1e-6, atol=rounding, err_msg=name)
    told = [[(e.time, e.kind, e.text) for e in flight.provenance.events] for flight in (text, binary)]
    assert told[0] == told[1]
    assert text.provenance.parameters == binary.provenance.parameters


def test_a_text_log_with_torn_lines_and_words_for_modes(tmp_path: Path) -> None:
    text = dataflash_text(ardupilot_rows()).replace("MODE, 20000000, 0, 0, 2", "MODE, 20000000, STABILIZE, 0, 2")
    lines = text.split("\n")
    lines[400] = lines[400][:20]
    lines[500] = lines[500].replace("0.5", "0.5.5").replace("10.0", "ten")
    lines[-2] = lines[-2][:5]
    flight = _flight(tmp_path, "\n".join(lines[:-1]), "a.log")
    assert any("lines are no whole message" in said for said in flight.provenance.damage)
    assert "the last line is unfinished: not read" in flight.provenance.notes
    assert next(e.text for e in flight.provenance.events if e.kind == "mode") == "STABILIZE"


def test_an_unfinished_last_message_is_ordinary_but_a_log_that_ends_in_flight_is_cut_off(tmp_path: Path) -> None:
    whole = dataflash(ardupilot_rows())
    flight = _flight(tmp_path, whole + dataflash(ardupilot_rows())[-12:-4])
    assert flight.provenance.damage == ()
    assert any("unfinished" in note for note in flight.provenance.notes)
    cut = _flight(tmp_path, whole[: len(whole) // 2])
    said = " ".join(cut.provenance.damage)
    assert "the motors armed since 20.00 s" in said
    assert "the sweep at 22.00 s (roll mixer, 0.5-8 Hz in 12 s) ends after" in said
    assert "the log is cut off" in said
    (sweep,) = (event for event in cut.provenance.events if event.kind == "sweep")
    assert sweep.details["seen"] < sweep.details["stop"]


def test_a_raised_throttle_is_not_the_arming(tmp_path: Path) -> None:
    """AUTO_ARMED (15) comes after a helicopter's run-up; alone it says that it was armed before the log began."""
    for number, before in ((10, 0.5), (15, 0.0)):
        rows = [row for row in ardupilot_rows() if row[0] != "EV" or row[1][1] == 11]
        begun = rows[0][1][0]
        rows[6:6] = [("EV", (begun + 500_000, number)), ("EV", (begun + 700_000, 15))]
        flight = _flight(tmp_path, dataflash(rows), f"{number}.bin")
        told = [(event.kind, event.time) for event in flight.provenance.events if "armed" in event.kind]
        assert [kind for kind, _ in told] == ["armed", "disarmed"]
        assert told[0][1] == pytest.approx(begun / 1e6 + before)


def test_a_sweep_that_the_pilot_stopped_is_not_blamed_on_the_log(tmp_path: Path) -> None:
    rows = [row for row in ardupilot_rows() if row[0] != "SIDD" or row[1][0] < 26_000_000]
    (said,) = _flight(tmp_path, dataflash(rows)).provenance.damage
    assert said.endswith("ends after 4.0 s: it was stopped")


def test_damaged_bytes_cost_their_own_messages(tmp_path: Path) -> None:
    rows = ardupilot_rows()
    content = bytearray(dataflash(rows))
    whole = _flight(tmp_path, bytes(content))
    for at in range(20_000, 20_040):
        content[at] = 0x55
    flight = _flight(tmp_path, bytes(content))
    (said,) = flight.provenance.damage
    assert "belong to no message (the first at byte" in said
    lost = sum(whole.time(name).size - flight.time(name).size for name in ("p", "phi", "ax", "az_imu2", "sid_target"))
    assert 1 <= lost <= 5
    kept = np.isin(whole.time("p"), flight.time("p"))
    assert_allclose(whole.values("p")[kept], flight.values("p"))


def test_a_damaged_description_costs_only_its_message(tmp_path: Path) -> None:
    content = bytearray(dataflash(ardupilot_rows()))
    letters = content.find(b"QBffffff\0")
    content[letters + 2] = ord("%")
    flight = _flight(tmp_path, bytes(content))
    assert "p" in flight
    assert "az" not in flight or flight.stream_of("az") == "system_identification"


def test_lost_blocks_at_the_start_and_erased_flash_at_the_end(tmp_path: Path) -> None:
    content = dataflash(ardupilot_rows())
    flight = _flight(tmp_path, b"\0\1\2" + content + b"\xff" * 500)
    assert flight.time("p").size == 800
    assert any("unused block" in note for note in flight.provenance.notes)


def test_a_clock_that_starts_anew_gives_the_longest_run_and_says_so(tmp_path: Path) -> None:
    short, long = ardupilot_rows(start=100.0, until=104.0, disarm=False), ardupilot_rows(start=20.0)
    for rows in (short + long, long + ardupilot_rows(start=3.0, until=6.0, disarm=False)):
        flight = _flight(tmp_path, dataflash(rows))
        assert (flight.start, flight.time("p").size) == (20.0, 800)
        (said,) = flight.provenance.damage
        assert "the clock starts anew once; only the longest run was read" in said


def test_wild_stamps_cost_only_themselves(tmp_path: Path) -> None:
    rows = ardupilot_rows()
    rates = [i for i, row in enumerate(rows) if row[0] == "RATE"]
    for i, wild in zip(rates[100:400:100], (1, 2**62, 10**10), strict=True):
        rows[i] = ("RATE", (wild, *rows[i][1][1:]))
    flight = _flight(tmp_path, dataflash(rows))
    assert flight.time("p").size == 800 - 3
    (said,) = flight.provenance.damage
    assert said == "rates: 3 of 800 samples (0.375 %) are lost because their time repeats or goes backwards"


def test_numbers_that_are_none_are_left_out_and_counted(tmp_path: Path) -> None:
    rows = ardupilot_rows()
    i = [k for k, row in enumerate(rows) if row[0] == "RATE"][7]
    rows[i] = ("RATE", (*rows[i][1][:2], float("nan"), *rows[i][1][3:]))
    flight = _flight(tmp_path, dataflash(rows))
    assert np.isfinite(flight.values("p")).all()
    assert any("rates: 1 of 800 samples (0.125 %) are lost because a number" in t for t in flight.provenance.damage)


def test_a_log_without_a_flight_and_needless_options_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match=r"a\.bin: holds no flight: no known message has two samples"):
        _flight(tmp_path, dataflash(ardupilot_rows(until=20.0)))
    (tmp_path / "b.bin").write_bytes(dataflash(ardupilot_rows()))
    with pytest.raises(FlightError, match="a mapping has no meaning"):
        read(tmp_path / "b.bin", mapping={"rate": 50})


def test_a_forged_description_is_not_believed() -> None:
    bad: list[bytes] = [
        fmt(50, 200, "LONG", "Qf", "TimeUS,Foo"),
        fmt(51, 2, "TINY", "B", "A"),
        fmt(52, 11, "BAD", "Q", "TimeUS,Foo"),
        fmt(128, 10, "FMT", "Q", "TimeUS"),
        fmt(ARDUPILOT["RATE"][0], 3, "RATE", "", ""),
    ]
    rows: list[Row] = [("RATE", (1_000_000 * k, *range(12))) for k in range(5)]
    content = dataflash(rows)
    found = messages(content[:89] + b"".join(bad[:4]) + content[89:] + bad[4])
    assert set(found.tables) == {"RATE"}
    assert len(found.tables["RATE"]) == 5


@pytest.mark.parametrize(
    ("times", "kept"),
    [
        ([1, 2, 3], [1, 2, 3]),
        ([1, 9, 2, 3], [1, 2, 3]),
        ([5, 1, 6, 7], [5, 6, 7]),
        ([1, 1, 2, 2, 3], [1, 2, 3]),
        ([], []),
        ([float("nan"), 1, 2], [1, 2]),
    ],
)
def test_the_longest_increasing_stamps_are_kept(times: list[float], kept: list[float]) -> None:
    stamps = np.asarray(times, dtype=np.float64)
    found = stamps[clocked.longest_increasing(stamps)]
    assert len(found) == len(kept)
    assert np.all(np.diff(found) > 0)


def test_the_autopilots_own_filters_and_a_missing_rate_message_are_said(tmp_path: Path) -> None:
    rows = ardupilot_rows(until=25.0)
    corner = ("PARM", (rows[0][1][0], "INS_GYRO_FILTER", 20.0, 20.0))
    notes = _flight(tmp_path, dataflash([corner, *rows])).provenance.notes
    # sqrt(2) / (2 pi 20 Hz): the phase of a second-order Butterworth at low frequency.
    assert any("p q r of rates and inertial have passed INS_GYRO_FILTER, 20 Hz: 11.3 ms" in note for note in notes)
    assert not any("no RATE message" in note or "INS_ACCEL" in note for note in notes)
    bare = _flight(tmp_path, dataflash([row for row in rows if row[0] != "RATE"]))
    assert any("no RATE message" in note and "LOG_BITMASK" in note for note in bare.provenance.notes)


# ---- names of modes --------------------------------------------------------------------------------------------------
def _modes(folder: Path, said: Sequence[Row], formats: Mapping[str, tuple[int, str, str]] = ARDUPILOT) -> list[str]:
    rows = [*said, *[("MODE", (1_000_000 * k, number, number, 1)) for k, number in enumerate((0, 5, 9, 11, 19, 99))]]
    flown = [row for row in ardupilot_rows(start=10.0) if row[0] not in ("MSG", "MODE")]
    flight = _flight(folder, dataflash([*rows, *flown], formats))
    return [event.text for event in flight.provenance.events if event.kind == "mode"]


@pytest.mark.parametrize(
    ("firmware", "expected"),
    [
        ("ArduCopter V4.7.0-dev (abc)", ["STABILIZE", "LOITER", "LAND", "DRIFT", "AVOID_ADSB", "mode 99"]),
        ("APM:Copter V3.2.1 (abc)", ["STABILIZE", "LOITER", "LAND", "DRIFT", "AVOID_ADSB", "mode 99"]),
        ("ArduPlane V4.5.7 (abc)", ["MANUAL", "FBWA", "mode 9", "RTL", "QLOITER", "mode 99"]),
        ("ArduRover V4.5.7 (abc)", ["MANUAL", "LOITER", "CIRCLE", "RTL", "mode 19", "mode 99"]),
        ("Rover V4.2.3 (abc)", ["MANUAL", "LOITER", "CIRCLE", "RTL", "mode 19", "mode 99"]),
        ("ArduSub V4.1.2 (abc)", ["STABILIZE", "mode 5", "SURFACE", "mode 11", "MANUAL", "mode 99"]),
        ("AntennaTracker V1.1.0 (abc)", ["MANUAL", "mode 5", "mode 9", "mode 11", "mode 19", "mode 99"]),
        ("Blimp V4.2.0 (abc)", ["mode 0", "mode 5", "mode 9", "mode 11", "mode 19", "mode 99"]),
        ("no firmware says this", ["mode 0", "mode 5", "mode 9", "mode 11", "mode 19", "mode 99"]),
    ],
)
def test_modes_have_the_names_of_their_own_firmware(tmp_path: Path, firmware: str, expected: list[str]) -> None:
    assert _modes(tmp_path, [("MSG", (0, firmware))]) == expected


def test_the_firmware_is_in_ver_too(tmp_path: Path) -> None:
    formats = {**ARDUPILOT, "VER": (180, "QZ", "TimeUS,FWS")}
    assert _modes(tmp_path, [("VER", (0, "ArduPlane V4.5.7 (abc)"))], formats)[:2] == ["MANUAL", "FBWA"]


def test_a_log_without_time_stamps_is_refused_with_the_reason(tmp_path: Path) -> None:
    formats = {"ATT": (72, "cc", "Roll,Pitch"), "MSG": (33, "Z", "Message")}
    rows: list[Row] = [("MSG", ("ArduCopter V3.0.1",)), *[("ATT", (1.0, 0.01 * k)) for k in range(200)]]
    with pytest.raises(FlightError, match=r"time: .*no time stamps \(found ATT, .*firmware before 3\.1"):
        _flight(tmp_path, dataflash(rows, formats))


def test_speed_controllers_tell_the_speeds_of_their_motors(tmp_path: Path) -> None:
    formats = {**ARDUPILOT, "ESC": (90, "QBffff", "TimeUS,Instance,RPM,RawRPM,Volt,Curr")}
    rows = [
        *ardupilot_rows(),
        *(
            ("ESC", (20_000_000 + 100_000 * k, i, 2460.0 + 10.0 * i, 2460.0, 12.0, 5.0))
            for k in range(20)
            for i in (0, 1)
        ),
    ]
    (tmp_path / "a.bin").write_bytes(dataflash(sorted(rows, key=lambda row: row[1][0]), formats))
    flight = read(tmp_path / "a.bin")
    assert_allclose(flight.values("omega_motor_1"), 2460.0 * 2.0 * np.pi / 60.0)
    assert_allclose(flight.values("omega_motor_2"), 2470.0 * 2.0 * np.pi / 60.0)
    assert flight["omega_motor_1"].attrs["units"] == "rad/s"
    assert "omega_motor_3" not in flight
