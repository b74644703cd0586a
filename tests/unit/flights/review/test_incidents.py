"""Incidents: each that is made is told with its time, and none on quiet flights."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from made_autopilot_logs import ARDUPILOT, ardupilot_rows, dataflash
from rate_loops import RATE, Loop, flight, gusts, sticks
from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Event, Provenance
from swashplate.flights.readers.read import read
from swashplate.flights.review.incidents import Incident, incidents
from swashplate.flights.review.review import review

SECONDS = 60.0
TIME = np.arange(round(SECONDS * 10)) / 10.0


def told(made: Flight) -> list[Incident]:
    return list(incidents(made, swept=()))


def beside(made: Flight, **channels: Array) -> Flight:
    """A flight with a stream of slow channels beside it."""
    return made.with_streams({**made.streams, "slow": stream(TIME, channels)})


def said(made: Flight, *events: tuple[float, str], **parameters: float) -> Flight:
    happened = tuple(Event(time, kind, kind) for time, kind in events)
    return replace(made, provenance=Provenance(reader="ardupilot", events=happened, parameters=parameters))


@pytest.fixture(scope="module")
def quiet() -> Flight:
    return flight(Loop(), 1, seconds=SECONDS)


def test_ten_quiet_flights_have_none() -> None:
    """Pilots, gusts and noise of ten seeds, well and badly damped, with every channel that could alarm."""
    for seed in range(10):
        loop = Loop() if seed % 2 else Loop(p=0.15, i=0.3)
        made = flight(loop, seed, seconds=SECONDS, gust=1.0 + seed, size=0.3 + 0.1 * seed)
        rng = np.random.default_rng(seed)
        made = beside(
            made,
            vibe_x=5.0 + 3.0 * rng.random(TIME.size),
            clips=np.full(TIME.size, 3.0),
            gps_status=np.full(TIME.size, 4.0),
            voltage_board=5.0 + 0.05 * rng.standard_normal(TIME.size),
            altitude_baro=np.interp(TIME, [0.0, 10.0, 50.0, 60.0], [0.0, 20.0, 20.0, 0.0]),
        )
        assert told(said(made, (0.5, "armed"), (59.5, "disarmed"))) == []


def test_a_loop_that_swings_for_seven_seconds_is_told() -> None:
    """A gain that is too high for 7 s, as the loop itself makes it: 6 Hz."""
    rng, n = np.random.default_rng(4), round(SECONDS * RATE)
    target, gust, noise = 0.3 * sticks(4, SECONDS), gusts(4, SECONDS), 0.02 * rng.standard_normal(n)
    calm, _ = Loop().flown(target, gust, noise)
    wild, _ = Loop(p=0.4).flown(target, gust, noise)
    time = np.arange(n) / RATE
    share = np.clip(np.minimum(time - 30.0, 37.0 - time) / 0.2, 0.0, 1.0)
    swings = calm + share * (wild - calm) / np.std((wild - calm)[(time > 31) & (time < 36)]) * np.deg2rad(26.0)
    made = Flight({"rates": stream(time, {"q": swings, "q_demand": target, "mixer_pitch": 0.0 * time})})
    (found,) = told(made)
    assert found.kind == "oscillation"
    assert (found.start, found.stop) == (pytest.approx(30.0, abs=0.7), pytest.approx(37.0, abs=0.7))
    tone, size = (float(word) for word in re.findall(r"at ([\d.]+) Hz: ([\d.]+) deg/s rms in q", found.text)[0])
    assert (tone, size) == (pytest.approx(6.1, abs=0.3), pytest.approx(28.0, abs=3.0))


def test_a_pilot_who_asks_for_it_does_not_oscillate(quiet: Flight) -> None:
    time = quiet.time("p")
    asked = np.where((time > 20.0) & (time < 30.0), 0.4 * np.sin(2.0 * np.pi * 1.5 * time), 0.0)
    moved = np.gradient(asked) * RATE
    made = quiet.with_channel("p", 0.1 * quiet.values("p") + moved, like="p").with_channel(
        "phi_demand", asked, like="p"
    )
    assert told(made) == []
    unasked = made.with_channel("phi_demand", 0.0 * asked, like="p")
    assert [each.kind for each in told(unasked)] == ["oscillation"]


def test_commands_and_motors_at_their_ends_are_told(quiet: Flight) -> None:
    time = quiet.time("p")
    full = np.where((time > 12.0) & (time < 13.0), 1.0, 0.2)
    (found,) = told(quiet.with_channel("mixer_roll", full, like="p"))
    assert (found.kind, found.start, found.stop) == (
        "saturation",
        pytest.approx(12.0, abs=0.02),
        pytest.approx(13.0, abs=0.02),
    )
    pulses = 1e-6 * np.where((TIME > 40.0) & (TIME < 42.0), 1950.0, 1500.0)
    motor = said(beside(quiet, rcout_3=pulses), SERVO3_FUNCTION=35.0, MOT_PWM_MAX=1950.0, MOT_PWM_MIN=1000.0)
    (found,) = told(motor)
    assert found.text.startswith("rcout_3 stands at the end")
    assert told(said(beside(quiet, rcout_3=pulses), SERVO3_FUNCTION=10.0)) == []  # a camera's shutter
    brief = np.where((time > 12.0) & (time < 12.1), 1.0, 0.2)
    assert told(quiet.with_channel("mixer_roll", brief, like="p")) == []


def test_vibration_and_clipping_are_told(quiet: Flight) -> None:
    shaken = np.where((TIME > 20.0) & (TIME < 27.0), 49.0, 8.0)
    (found,) = told(beside(quiet, vibe_x=0.3 * shaken, vibe_y=0.2 * shaken, vibe_z=shaken))
    assert (found.kind, found.start, found.stop) == (
        "vibration",
        pytest.approx(20.1, abs=0.2),
        pytest.approx(27.0, abs=0.2),
    )
    assert "49 m/s^2 in z" in found.text
    (found,) = told(beside(quiet, clips=np.where(TIME >= 30.0, 14.0, 2.0)))
    assert (found.kind, found.start) == ("clipping", pytest.approx(30.0, abs=0.11))
    assert "12 times" in found.text


def test_gps_and_power_are_told(quiet: Flight) -> None:
    status = np.where((TIME > 15.0) & (TIME < 18.0), 1.0, np.where(TIME < 3.0, 0.0, 4.0))
    (found,) = told(beside(quiet, gps_status=status))  # the first fix is no loss
    assert (found.kind, found.start, found.stop) == ("GPS", pytest.approx(15.1, abs=0.1), pytest.approx(18.0, abs=0.1))
    volts = np.where((TIME > 33.0) & (TIME < 34.0), 4.1, 5.0)
    (found,) = told(beside(quiet, voltage_board=volts))
    assert (found.kind, found.start) == ("power", pytest.approx(33.1, abs=0.1))
    climbs = said(beside(quiet, altitude_baro=np.minimum(TIME, 12.0)), (1.0, "armed"))
    (found,) = told(climbs)
    assert "the log ends armed and 12 m up" in found.text
    assert told(said(climbs, (1.0, "armed"), (59.0, "disarmed"))) == []


def test_gaps_are_told_while_armed_only(quiet: Flight) -> None:
    data = quiet.streams["rates"]
    time = data["time"].values
    cut = Flight({"rates": data.isel(time=np.flatnonzero((time < 22.0) | (time > 23.5)))})
    (found,) = told(cut)
    assert (found.kind, found.start, found.stop) == (
        "gap",
        pytest.approx(22.0, abs=0.01),
        pytest.approx(23.5, abs=0.01),
    )
    assert told(said(cut, (30.0, "armed"), (59.0, "disarmed"))) == []


def test_an_ardupilot_log_tells_its_errors_and_supply(tmp_path: Path) -> None:
    formats = {
        **ARDUPILOT,
        "ERR": (90, "QBB", "TimeUS,Subsys,ECode"),
        "VIBE": (91, "QBfffI", "TimeUS,IMU,VibeX,VibeY,VibeZ,Clip"),
        "GPS": (92, "QBBBfLLf", "TimeUS,I,Status,NSats,HDop,Lat,Lng,Spd"),
        "POWR": (93, "Qff", "TimeUS,Vcc,VServo"),
    }  # fmt: skip
    rows = list(ardupilot_rows())
    for k in range(160):
        us = round(1e6 * (20.0 + 0.1 * k))
        lost = 60 <= k < 80
        rows += [
            ("VIBE", (us, 0, 3.0, 4.0, 5.0, 7)),
            ("GPS", (us, 0, 1 if lost else 4, 11, 0.8, 47.4, 8.5, 0.3)),
            ("POWR", (us, 4.2 if lost else 5.1, 0.0)),
        ]
    errors = ((17, 1), (17, 0), (12, 1), (16, 2), (24, 0), (10, 0), (22, 7))
    rows += [("ERR", (29_000_000 + 1_000_000 * k, *error)) for k, error in enumerate(errors)]
    path = tmp_path / "events.bin"
    path.write_bytes(dataflash(sorted(rows, key=lambda row: row[1][0]), formats))
    made = read(path)
    assert np.degrees(made.values("latitude")[0]) == pytest.approx(47.4)
    found = review(made).incidents
    assert [each.kind for each in found] == ["GPS", "power", *["error"] * 7]
    assert found[0].start == pytest.approx(26.0, abs=0.15)
    assert [str(each).partition(" s: ")[2] for each in found[2:]] == [
        "failsafe of the EKF: began",
        "failsafe of the EKF: over",
        "crash check: a crash was detected",
        "EKF check: the variance is bad",
        "EKF changed its core: core 0",
        "change of mode refused: mode 0",
        "navigation: code 7",
    ]
