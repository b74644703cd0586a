"""Blackbox logs of known content: every predictor and encoding, damage, lying headers, signs and units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import made_blackbox_logs as made
import swashplate as sp
from made_blackbox_logs import Field
from swashplate.errors import FlightError
from swashplate.flights.readers.blackbox_frames import find_frames
from swashplate.flights.readers.blackbox_header import Header, read_header
from swashplate.flights.readers.blackbox_values import Main, main_frames

RNG = np.random.default_rng(7)


def decoded(content: bytes) -> tuple[Header, Main]:
    header = read_header(content, 0, len(content), where="a.bbl")
    return header, main_frames(find_frames(content, header, stop=len(content), where="a.bbl"), header)


def saved(folder: Path, content: bytes, name: str = "a.bbl") -> Path:
    (folder / name).write_bytes(content)
    return folder / name


# --- the encoder itself, against the examples that the documentation prints ---
@pytest.mark.parametrize(
    ("value", "bits"),
    [
        (0, "1"), (1, "0100"), (3, "01100"), (7, "00100000"), (15, "001010000"), (225, "00010001100010"),
        (4294967292, "000001000001111111111111111111111111111101"),
        (4294967294, "0000010000011111111111111111111111111111110"),
        (4294967295, "0000010000011111111111111111111111111111111"),
    ],
)  # fmt: skip
def test_elias_delta_as_printed(value, bits):
    assert made.elias(value) == bits


def test_other_encodings_as_printed():
    assert made.vb(23456) == bytes([0xA0, 0xB7, 0x01])
    assert made.svb(-2147483648) == made.vb(4294967295)
    assert made.tag8_4s16([13, 0, 4, 2]) == bytes([0b01010010, 0x0D, 0x42])
    assert made.written([0, 0, 2, 0, 4], [6] * 5) == bytes([0b00010100, 0x04, 0x08])  # zig-zag doubles
    assert made.tag2([1, -2, 0], variable=False) == bytes([0b00011000])


# --- all encodings and predictors ---
_SPANS = {
    0: 2**31 - 1,
    1: 2**31 - 1,
    3: 8000,
    4: 2**31 - 1,
    5: 2**31 - 1,
    6: 2**31 - 1,
    7: 2**31 - 1,
    8: 30000,
    10: 2**30,
}


@pytest.mark.parametrize("encoding", sorted(_SPANS))
@pytest.mark.parametrize("count", [1, 2, 3, 4, 9])
def test_every_encoding_reads_back(encoding, count):
    """Numbers of every size, in groups of every size, behind and before others."""
    fields = [
        Field("loopIteration", 0, (0, 1), (6, 9)),
        Field("time", 0, (0, 1), (2, 0)),
        *(Field(f"x[{i}]", 1, (0, encoding), (0, encoding)) for i in range(count)),
        Field("last", 1, (0, 0), (0, 0)),
    ]
    n = 120
    size = np.exp(RNG.uniform(0.0, np.log(_SPANS[encoding]), (n, count)))
    values = np.rint(size * RNG.choice([-1.0, 0.0, 1.0], (n, count))).astype(np.int64)
    rows = np.column_stack([np.arange(n), 1000 + 500 * np.arange(n), values, RNG.integers(-9, 9, n)])
    content = made.header(fields, interval=8, share="1/1", more={}) + b"".join(made.frames(fields, rows, interval=8))
    _, main = decoded(content + made.END)
    assert main.damage == ()
    for i, field in enumerate(fields):
        assert np.array_equal(main.columns[field.name], rows[:, i]), field.name


@pytest.mark.parametrize("seed", range(30))
def test_any_mixture_of_encodings_and_predictors_reads_back(seed):
    """Elias delta bits run on over signed and unsigned fields, and over fields that write nothing."""
    rng = np.random.default_rng(seed)
    n, interval = 60, int(rng.choice([1, 4, 16]))
    fields = [Field("loopIteration", 0, (0, 1), (6, 9)), Field("time", 0, (0, 1), (2, 0)),
              Field("motor[0]", 0, (4, 1), (3, 0))]  # fmt: skip
    columns = [np.arange(n), 5000 + 1000 * np.arange(n), rng.integers(1100, 2000, n)]
    while len(fields) < 12:
        encoding, intra = int(rng.choice([0, 1, 4, 4, 5, 5, 6, 7, 9, 10])), int(rng.choice([0, 4, 5, 8, 9, 11]))
        group = int(rng.integers(1, 5)) if encoding not in (7, 10) else 3
        inter = 1 if encoding == 9 else int(rng.choice([0, 1, 2, 3, 4, 5, 8, 9, 11]))
        for _ in range(group):
            ours = rng.integers(-(2**20), 2**20, n) if encoding != 9 else np.full(n, 77)
            first = int(rng.choice([4, 5])) if encoding == 9 else encoding
            fields.append(Field(f"x[{len(fields)}]", 1, (intra, first), (inter, encoding)))
            columns.append(ours)
    rows = np.column_stack(columns)
    content = made.header(fields, interval=interval, share="1/1", more={})
    _, main = decoded(content + b"".join(made.frames(fields, rows, interval=interval)) + made.END)
    assert main.damage == ()
    for i, field in enumerate(fields):
        assert np.array_equal(main.columns[field.name], rows[:, i]), field


def test_where_the_header_is_silent_constants_are_those_of_the_firmwares_own_tools():
    fields = [Field("time", 0, (0, 1), (1, 0)), *(Field(f"x{k}", 1, (k, 0), (1, 0)) for k in (4, 9, 11))]
    rows = np.column_stack([1000 * np.arange(1, 9), *np.zeros((3, 8), dtype=np.int64)])
    content = made.header(fields, interval=4, share="1/1", more={})
    for line in (b"H minthrottle:1070\n", b"H vbatref:420\n", b"H motorOutput:158,2047\n"):
        content = content.replace(line, b"")
    _, main = decoded(content + b"".join(made.frames(fields, rows, interval=4)) + made.END)
    found = [int(main.columns[f"x{k}"][0]) for k in (4, 9, 11)]
    assert found == [1150 - made.MINTHROTTLE, 4095 - made.VBATREF, 1150 - made.LOWEST]


@pytest.mark.parametrize("predictor", [0, 1, 2, 3, 4, 5, 8, 9, 11])
@pytest.mark.parametrize("interval", [1, 4, 2000])
@pytest.mark.parametrize("signed", [0, 1])
def test_every_predictor_reads_back(predictor, interval, signed):
    intra = predictor if predictor in (0, 4, 5, 8, 9, 11) else 0
    fields = [
        Field("loopIteration", 0, (0, 1), (6, 9)),
        Field("time", 0, (0, 1), (1, 0)),
        Field("x", signed, (intra, 0), (predictor, 0)),  # before motor[0], from which it may be predicted
        Field("motor[0]", 0, (4, 0), (3, 0)),
    ]
    n = 1500
    x = np.cumsum(RNG.integers(-40, 41, n)) if signed else RNG.integers(0, 2**32, n)
    rows = np.column_stack([np.arange(n), 7 + 500 * np.arange(n), x, RNG.integers(1000, 2000, n)])
    content = made.header(fields, interval=interval, share="1/1", more={})
    content += b"".join(made.frames(fields, rows, interval=interval)) + made.END
    _, main = decoded(content)
    assert main.damage == ()
    for i, field in enumerate(fields):
        assert np.array_equal(main.columns[field.name], rows[:, i]), field.name


@pytest.mark.parametrize("share", ["1/1", "1/4", "2/3", "4"])
def test_iterations_follow_the_intervals(share):
    """The pattern that the documentation prints: which loops of 32 are logged."""
    top, bottom = {"1/1": (1, 1), "1/4": (1, 4), "2/3": (2, 3), "4": (1, 4)}[share]
    logged = [j for j in range(128) if j % 32 == 0 or (j % 32 + top - 1) % bottom < top]
    row_of_frames = len([j for j in logged if j < 32])
    fields = [Field("loopIteration", 0, (0, 1), (6, 9)), Field("time", 0, (0, 1), (1, 1))]
    rows = np.array([[j, 1000 * j + 1] for j in logged])
    content = made.header(fields, interval=32, share=share, more={})
    content += b"".join(made.frames(fields, rows, interval=row_of_frames)) + made.END
    _, main = decoded(content)
    assert main.columns["loopIteration"].tolist() == logged
    assert main.notes == ()


def test_without_a_line_signed_the_encodings_say_it(tmp_path):
    """Gyros below zero were read as 4.3e9 deg/s, "problems: none". Times above 2^31 stay what they are."""
    ramp = np.arange(64)
    content = made.rotorflight(
        {"gyroADC[0]": 5 - ramp, "accADC[1]": -ramp, "mixer[1]": -ramp, "motor[0]": -ramp}, start_us=3_000_000_000
    )
    line = next(line for line in content.split(b"\n") if line.startswith(b"H Field I signed"))
    told = sp.read(saved(tmp_path, content))
    untold = sp.read(saved(tmp_path, content.replace(line + b"\n", b"")))
    assert untold.streams["blackbox"].identical(told.streams["blackbox"])
    assert untold.provenance.damage == ()
    assert np.rad2deg(untold.values("p").min()) == pytest.approx(-58.0)
    # A header that lies about it is not believed in silence.
    lie = sp.read(saved(tmp_path, content.replace(line, line.replace(b"1", b"0"))))
    (said,) = [text for text in lie.provenance.damage if text.startswith("p:")]
    assert "p: 58 of 64 samples (90.6 %) are impossible: found up to 4.29e+09 deg/s, expected 5.73e+03" in said


# --- what a pilot sees ---
def test_rotorflight_channels_signs_and_units(tmp_path):
    n = 64
    ramp = np.arange(n)
    content = made.rotorflight(
        {
            "gyroADC[0]": ramp, "gyroADC[1]": 2 * ramp, "gyroADC[2]": 3 * ramp, "setpoint[1]": -ramp,
            "mixer[0]": 10 * ramp,
            "mixer[1]": -5 * ramp, "mixer[2]": ramp, "mixer[3]": -4 * ramp, "accADC[2]": np.full(n, 2048),
            "headspeed": 1800 + ramp, "servo[1]": 1500 + ramp, "vbatLatest": 2520 - ramp, "motor[0]": 5 * ramp,
        }
    )  # fmt: skip
    flight = sp.read(saved(tmp_path, content))
    degree = np.deg2rad(1.0)
    for name, expected in {
        "p": ramp * degree, "q": -2 * ramp * degree, "r": -3 * ramp * degree, "q_demand": ramp * degree,
        "mixer_roll": 0.01 * ramp, "mixer_pitch": 0.005 * ramp, "mixer_yaw": -0.001 * ramp,
        "mixer_collective": -0.004 * ramp, "az": np.full(n, -9.80665), "omega_rotor": (1800 + ramp) * np.pi / 30,
        "rcout_2": 1.5e-3 + 1e-6 * ramp, "voltage": 25.2 - 0.01 * ramp, "motor_1": 0.005 * ramp,
    }.items():  # fmt: skip
        assert flight.values(name) == pytest.approx(expected), name
    assert flight.time("p") == pytest.approx(5.0 + 0.002 * ramp)
    assert flight.provenance.vehicle == "Trex Rotorflight 4.4.0 (abc1234) STM32F745"
    assert flight.provenance.parameter("rollPID_1") == 100.0
    assert flight.provenance.parameter("gyro_scale") == 1.0
    assert flight.provenance.damage == ()


def test_attitude_height_and_gains_of_newer_firmware(tmp_path):
    """Angles in 0.1 deg: pitch nose down positive, yaw a heading; gains by the names of the command line."""
    fields = (*made.ROTORFLIGHT, *(Field(f"attitude[{i}]", 1, (0, 0), (1, 7)) for i in range(3)),
              Field("altitude", 1, (0, 0), (1, 6)), Field("Vbat", 0, (9, 3), (1, 0)))  # fmt: skip
    rows = np.zeros((40, len(fields)), dtype=np.int64)
    rows[:, 1] = 1000 * np.arange(1, 41)
    rows[:, -5:] = [105, 52, 2701, 1250, 2400]
    more = {**made.RF_HEADER, "rollPID": "50,100,20,80,10", "rollBW": "50,15,20"}
    content = made.header(fields, interval=8, share="1/1", more=more)
    content += b"".join(made.frames(fields, rows, interval=8)) + made.END
    flight = sp.read(saved(tmp_path, content))
    angles = [np.rad2deg(flight.values(name)[0]) for name in ("phi", "theta", "psi")]
    assert angles == pytest.approx([10.5, -5.2, 270.1])
    assert flight.values("altitude_baro")[0] == pytest.approx(12.5)
    told = {name: flight.provenance.parameter(name) for name in ("roll_p_gain", "roll_f_gain", "roll_gyro_cutoff")}
    assert told == {"roll_p_gain": 50.0, "roll_f_gain": 80.0, "roll_gyro_cutoff": 50.0}
    assert flight.provenance.parameter("pitch_p_gain") is None


def test_a_tail_that_is_a_motor_has_no_yaw_command(tmp_path):
    fields = (*made.ROTORFLIGHT, Field("motor[1]", 1, (0, 0), (3, 0)))
    rows = np.zeros((40, len(fields)), dtype=np.int64)
    rows[:, 1] = 1000 * np.arange(1, 41)
    content = made.header(fields, interval=8, share="1/1", more=made.RF_HEADER)
    content += b"".join(made.frames(fields, rows, interval=8)) + made.END
    flight = sp.read(saved(tmp_path, content))
    assert "mixer_yaw" not in flight
    assert "tail_throttle" in flight
    assert any("not a yaw command" in note for note in flight.provenance.notes)


@pytest.mark.parametrize(
    ("more", "corner"),
    [({}, 50.0), ({"dterm_lpf2_static_hz": 0}, 75.0), ({"dterm_lpf2_type": 1}, None), ({"d_max": None}, None)],
)
def test_betaflights_own_gains_where_their_loop_is_known(tmp_path, more, corner):
    """Two low-passes of first order are late together as one; other filters, and D before 2025.12, are not told."""
    known = {"rollPID": "45,80,30", "pitchPID": "47,84,34", "yawPID": "45,80,0", "d_max": "40,46,0",
             "dterm_lpf1_type": 0, "dterm_lpf1_dyn_hz": "75,150", "dterm_lpf2_type": 0,
             "dterm_lpf2_static_hz": 150} | more  # fmt: skip
    fields = (Field("loopIteration", 0, (0, 1), (6, 9)), Field("time", 0, (0, 1), (2, 0)),
              Field("gyroADC[0]", 1, (0, 0), (3, 0)))  # fmt: skip
    rows = np.zeros((20, len(fields)), dtype=np.int64)
    rows[:, 0], rows[:, 1] = np.arange(20), 900 + 125 * np.arange(20)
    told = {"Firmware type": "Betaflight", "Firmware revision": "Betaflight 2026.12.0-alpha SITL"}
    told |= {name: value for name, value in known.items() if value is not None}
    content = made.header(fields, interval=8, share="1/1", more=told)
    content += b"".join(made.frames(fields, rows, interval=8)) + made.END
    log = sp.read(saved(tmp_path, content)).provenance
    assert log.parameter("dterm_lpf") == (None if corner is None else pytest.approx(corner))
    assert log.parameter("d_pitch") == (None if corner is None else 34.0)


def test_betaflight_units_by_version_and_resolution(tmp_path):
    fields = (
        Field("loopIteration", 0, (0, 1), (6, 9)), Field("time", 0, (0, 1), (2, 0)),
        *(Field(f"axis{t}[0]", 1, (0, 0), (1, 0)) for t in "PIDF"),
        Field("gyroADC[0]", 1, (0, 0), (3, 0)), Field("setpoint[0]", 1, (0, 0), (1, 0)),
        Field("setpoint[3]", 1, (0, 0), (1, 0)), Field("vbatLatest", 0, (9, 3), (1, 6)),
        Field("motor[0]", 0, (11, 1), (3, 0)), Field("eRPM[0]", 0, (0, 1), (1, 0)),
        Field("debug[0]", 1, (0, 0), (1, 0)),
    )  # fmt: skip
    n = 20
    rows = np.zeros((n, len(fields)), dtype=np.int64)
    rows[:, 0], rows[:, 1] = np.arange(n), 900 + 125 * np.arange(n)
    rows[:, 2:] = [40, 10, -5, 3, 1234, 500, 420, 415, 1000, 200, -7]

    def flight(revision: str, **more: object) -> sp.Flight:
        top = made.header(
            fields, interval=4, share="1/1", more={"Firmware revision": revision, "motor_poles": 14, **more}
        )
        return sp.read(saved(tmp_path, top + b"".join(made.frames(fields, rows, interval=4)) + made.END))

    new = flight("Betaflight 4.5.1 (x)", blackbox_high_resolution=1)
    assert np.rad2deg(new.values("p")) == pytest.approx(np.full(n, 123.4))
    assert np.rad2deg(new.values("p_demand")) == pytest.approx(np.full(n, 50.0))
    assert new.values("mixer_collective") == pytest.approx(np.full(n, 0.42))
    assert new.values("mixer_roll") == pytest.approx(np.full(n, 0.048))
    assert new.values("voltage") == pytest.approx(np.full(n, 4.15))
    assert new.values("motor_1") == pytest.approx(np.full(n, (1000 - 158) / (2047 - 158)))
    assert new.values("omega_motor_1") == pytest.approx(np.full(n, 20_000 / 7 * np.pi / 30))
    assert new.values("debug_0") == pytest.approx(np.full(n, -7.0))
    old = flight("Betaflight 3.5.7 (x)")
    assert old.values("voltage") == pytest.approx(np.full(n, 41.5))
    assert np.rad2deg(old.values("p")) == pytest.approx(np.full(n, 1234.0))


def test_events_slow_frames_and_gps(tmp_path):
    extra = (
        "H Field S name:flightModeFlags,failsafePhase\nH Field S signed:0,0\nH Field S predictor:0,0\n"
        "H Field S encoding:1,1\nH Field H name:GPS_home[0],GPS_home[1]\nH Field H signed:1,1\n"
        "H Field H predictor:0,0\nH Field H encoding:0,0\n"
        "H Field G name:time,GPS_numSat,GPS_coord[0],GPS_coord[1]\nH Field G signed:0,0,1,1\n"
        "H Field G predictor:10,0,7,7\nH Field G encoding:1,1,0,0\n"
    )
    fields = made.ROTORFLIGHT[:2]
    rows = np.column_stack([np.arange(60), 1000 * np.arange(60) + 1000])
    home = b"H" + made.svb(500_000_000) + made.svb(80_000_000)
    between = {
        3: b"S" + made.vb(1) + made.vb(0) + made.event(0, 4000),
        10: home + b"G" + made.vb(250) + made.vb(9) + made.svb(100) + made.svb(-50),
        20: b"S" + made.vb(5) + made.vb(0) + made.adjustment(7, 0.5),
        30: b"G" + made.vb(0) + made.vb(9) + made.svb(200) + made.svb(-60) + b"E\x65\x05hello",
        40: made.event(30, 5, 1) + made.event(15, 2),
    }
    content = made.header(fields, interval=8, share="1/1", more={}, extra=extra)
    content += b"".join(made.frames(fields, rows, interval=8, between=between)) + made.END
    with pytest.raises(FlightError, match="holds no flight"):
        sp.read(saved(tmp_path, content))  # loop counts and times alone are no flight
    fields = (*made.ROTORFLIGHT[:2], Field("gyroADC[0]", 1, (0, 0), (3, 0)))
    rows = np.column_stack([rows, np.arange(60)])
    content = made.header(fields, interval=8, share="1/1", more={}, extra=extra)
    content += b"".join(made.frames(fields, rows, interval=8, between=between)) + made.END
    flight = sp.read(saved(tmp_path, content))
    assert flight.provenance.damage == ()
    assert flight.time("latitude") == pytest.approx([0.010250, 0.030])
    assert np.rad2deg(flight.values("latitude")) == pytest.approx([50.00001, 50.00002])
    told = [(event.kind, event.text) for event in flight.provenance.events]
    assert ("mode", "flightModeFlags 5") in told
    assert ("message", "sync beep 4000") in told
    assert ("message", "adjustment 7 0.5") in told
    assert ("message", "hello") in told
    assert ("disarmed", "disarmed 2") in told


# --- several logs, time, damage ---
def log_of(n: int, **how) -> bytes:
    ramp = np.arange(n)
    return made.rotorflight({"gyroADC[0]": ramp % 700, "mixer[0]": 3 * ramp % 997}, **how)


def test_of_several_logs_the_longest_or_the_one_asked_for(tmp_path):
    path = saved(tmp_path, b"noise" + log_of(40) + b"\xff" * 99 + log_of(90) + log_of(20))
    assert len(sp.read(path).values("p")) == 90
    assert [len(sp.read(path, log=k).values("p")) for k in (1, 2, 3)] == [40, 90, 20]
    assert any("3 logs" in note and "number 2" in note for note in sp.read(path).provenance.notes)
    assert sp.read(path, log=3).provenance.source == "a.bbl#3"
    with pytest.raises(FlightError, match="log 4 is asked for; the file holds 3"):
        sp.read(path, log=4)


def test_an_end_that_says_why(tmp_path):
    flight = sp.read(saved(tmp_path, log_of(20, end=b"E\xffEnd of log (disarm reason:4)\0")))
    assert flight.provenance.damage == ()
    assert not any("end mark" in note for note in flight.provenance.notes)


def test_frames_that_stand_twice_or_go_back_cost_nothing_else(tmp_path):
    """A stretch written again, and an I frame of another time: the clock goes on behind them."""
    n = 320
    rows = np.zeros((n, 3), dtype=np.int64)
    rows[:, 0], rows[:, 1], rows[:, 2] = np.arange(n), 5_000_000 + 2000 * np.arange(n), np.arange(n) % 700
    fields = (*made.ROTORFLIGHT[:2], Field("gyroADC[0]", 1, (0, 0), (3, 0)))
    pieces = made.frames(fields, rows, interval=16)
    top = made.header(fields, interval=16, share="1/1", more={})
    wild = b"I" + made.vb(9) + made.vb(2_000_000) + made.svb(5)
    for changed in ([*pieces[:100], *pieces[80:]], [*pieces[:160], wild, *pieces[160:]]):
        flight = sp.read(saved(tmp_path, top + b"".join(changed) + made.END))
        index = np.rint((flight.time("p") - 5.0) / 0.002).astype(int)
        assert len(index) >= n - 2 * 16
        assert np.all(np.diff(index) > 0)
        assert np.rint(np.rad2deg(flight.values("p"))).astype(int).tolist() == index.tolist()
        assert flight.provenance.damage


def test_the_frame_before_lost_bytes_may_be_two_halves(tmp_path):
    """Cut where the rest of another frame fits: it ends at a letter by chance, and is left out."""
    n = 64
    rows = np.zeros((n, 3), dtype=np.int64)
    rows[:, 0], rows[:, 1] = np.arange(n), 5_000_000 + 2000 * np.arange(n)
    fields = (*made.ROTORFLIGHT[:2], Field("gyroADC[0]", 1, (0, 0), (3, 0)))
    pieces = made.frames(fields, rows, interval=16)
    pieces[20] = pieces[20][:-1] + made.svb(60)  # the end of another frame
    pieces[21] = pieces[21][:1] + b"\xff" * 40
    top = made.header(fields, interval=16, share="1/1", more={})
    flight = sp.read(saved(tmp_path, top + b"".join(pieces) + made.END))
    assert any("may be spliced" in line for line in flight.provenance.damage)
    assert np.all(flight.values("p") == 0.0)
    assert len(flight.values("p")) == n - 12


def test_a_clock_that_turns_over(tmp_path):
    flight = sp.read(saved(tmp_path, log_of(200, start_us=2**32 - 150_000)))
    assert np.diff(flight.time("p")) == pytest.approx(np.full(199, 0.002))
    assert flight.provenance.damage == ()


def test_a_pause_is_no_damage(tmp_path):
    one = np.arange(64)
    time = 1_000_000 + 2000 * one + np.where(one >= 32, 60_000_000, 0)
    resume = made.event(14, 32, int(time[32]))
    content = made.rotorflight({"gyroADC[0]": one, "time": time}, between={32: resume})
    flight = sp.read(saved(tmp_path, content))
    assert flight.provenance.damage == ()
    assert np.diff(flight.time("p")).max() == pytest.approx(60.002)
    silent = sp.read(saved(tmp_path, content.replace(resume, b"")))  # the same leap, unannounced
    assert "clock leaps" in silent.provenance.damage[0]
    assert len(silent.values("p")) == 32


def _true(flight: sp.Flight, n: int) -> np.ndarray:
    """Which frames the samples are, by their time; that their values are those that were written."""
    index = np.rint((flight.time("p") - 5.0) / 0.002).astype(int)
    assert index.min() >= 0
    assert index.max() < n
    assert np.rint(np.rad2deg(flight.values("p"))).astype(int).tolist() == (index % 700).tolist()
    assert np.rint(1e3 * flight.values("mixer_roll")).astype(int).tolist() == (3 * index % 997).tolist()
    return index


@pytest.mark.parametrize("seed", range(40))
def test_lost_bytes_cost_little_and_no_sample_is_wrong(tmp_path, seed):
    n = 640
    content = log_of(n)
    rng = np.random.default_rng(seed)
    body = content.index(b"H gyro_lpf1_static_hz:100\n") + 26
    start = int(rng.integers(body + 40, len(content) - 60))
    damaged = content[:start] + content[start + int(rng.integers(1, 60)) :]
    flight = sp.read(saved(tmp_path, damaged))
    index = _true(flight, n)
    assert len(index) >= n - 3 * 16
    assert flight.provenance.damage or len(index) == n  # nothing is lost in silence


def test_frames_that_vanish_as_a_whole_are_missed(tmp_path):
    """Bytes from one frame's beginning to another's: what is left reads well, and P frames behind are wrong."""
    n = 160
    rows = np.zeros((n, 3), dtype=np.int64)
    rows[:, 0], rows[:, 1], rows[:, 2] = np.arange(n), 5_000_000 + 2000 * np.arange(n), np.arange(n) % 700
    fields = (*made.ROTORFLIGHT[:2], Field("gyroADC[0]", 1, (0, 0), (3, 0)))
    pieces = made.frames(fields, rows, interval=16)
    del pieces[70:73]
    top = made.header(fields, interval=16, share="1/1", more={})
    flight = sp.read(saved(tmp_path, top + b"".join(pieces) + made.END))
    index = np.rint((flight.time("p") - 5.0) / 0.002).astype(int)
    assert index.tolist() == [k for k in range(n) if not 64 < k < 80]
    assert np.rint(np.rad2deg(flight.values("p"))).astype(int).tolist() == index.tolist()
    assert "1 of 9 rows of frames lack some" in flight.provenance.damage[0]


def test_a_log_cut_anywhere(tmp_path):
    """Every place of the cut: a flight that is a part of the truth, or an error that names the log."""
    content = log_of(40)
    read = unnamed = 0
    for cut in [*range(1, len(content), 37), len(content) - 1]:
        path = saved(tmp_path, content[:cut], "cut.bbl")
        try:
            flight = sp.read(path)
        except FlightError as error:
            unnamed += "cut.bbl" not in str(error)
            continue
        index = _true(flight, 40)
        assert index.tolist() == list(range(len(index)))
        read += 1
    assert read > 10
    assert not unnamed


# --- headers that lie ---
@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        (b"H Field I predictor:0,0,", b"H Field I predictor:0,", "Field I predictor: has 26 numbers for 27 fields"),
        (b"H Field P encoding:9,0,", b"H Field P encoding:9,2,", "says '2' of field 'time'"),
        (b"H Field I encoding:1,1,", b"H Field I encoding:1,77,", "says '77' of field 'time'"),
        (b"H Field I predictor:0,0,", b"H Field I predictor:0,1,", "only P frames can"),
        (b"H Field I signed:0,0,", b"H Field I signed:0,5,", "Field I signed: says '5'"),
        (b"loopIteration,time,", b"loopIteration,clock,", "no field of the main frames is called 'time'"),
        (b"loopIteration,time,", b"time,time,", "'time' twice"),
        (b"H Data version:2", b"H Data version:1", "is of version '1'"),
        (b"H Field I name:", b"H Field X name:", "does not name the fields of frame I"),
        (b"H Field I name:", b"H Field I name:" + b"a," * 65_534, "defines 65,561 fields"),
    ],
)
def test_headers_that_lie_are_named(tmp_path, old, new, match):
    content = log_of(20)
    assert content.count(old) == 1
    with pytest.raises(FlightError, match=match) as caught:
        sp.read(saved(tmp_path, content.replace(old, new)))
    assert "a.bbl" in str(caught.value)


def test_frames_of_no_bytes_do_not_fill_the_memory(tmp_path):
    """P frames that write nothing: a megabyte of them would be a thousand times as many numbers."""
    fields = [
        Field("time", 0, (0, 1), (1, 9)),
        *(Field(f"x{i}", 1, (0, 0), (1, 9)) for i in range(500)),
    ]
    rows = np.zeros((1, 501), dtype=np.int64)
    content = made.header(fields, interval=32, share="1/1", more={})
    content += made.frames(fields, rows, interval=1)[0] + b"P" * 60_000
    with pytest.raises(FlightError, match="claims"):
        sp.read(saved(tmp_path, content))


def test_only_blackbox_files_hold_several_logs(tmp_path):
    (tmp_path / "a.csv").write_text("time [s],p [deg/s]\n0,1\n1,2\n")
    with pytest.raises(FlightError, match="one log only"):
        sp.read(tmp_path / "a.csv", log=1)


def test_a_mapping_has_no_meaning(tmp_path):
    with pytest.raises(FlightError, match="no meaning for a Blackbox log"):
        sp.read(saved(tmp_path, log_of(20)), mapping={"rate": 50})


def test_a_given_unit_stands_in_place_of_the_logs(tmp_path):
    path = saved(tmp_path, log_of(20))
    assert sp.read(path, units={"p": "-rad/s"}).values("p").tolist() == (-sp.read(path).values("p")).tolist()
