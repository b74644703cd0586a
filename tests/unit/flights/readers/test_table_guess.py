"""What columns may be: by names of several languages, by units and by size; and what is left to a person."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.flights.readers.source import Source, open_source
from swashplate.flights.readers.table_guess import Guess, guessed, mapping_of, mapping_text

TIME = np.arange(200) * 0.01
WAVE = np.sin(3.0 * TIME)


def table(header: str, *columns: np.ndarray, mark: str = ",") -> Source:
    rows = zip(TIME.tolist(), *(column.tolist() for column in columns), strict=True)
    text = "\n".join([header, *(mark.join(f"{cell:.6f}" for cell in row) for row in rows)]) + "\n"
    return Source(Path("a.csv"), text.encode())


def guesses_of(header: str, *columns: np.ndarray) -> list[tuple[str, str]]:
    told = guessed(table(header, *columns))
    assert told is not None
    return [(guess.channel, guess.unit) for guess in told[1]]


@pytest.mark.parametrize(
    ("names", "channels"),
    [
        ("rollRate,pitchRate,yawRate", ["p", "q", "r"]),
        ("Rollwinkel,Nickwinkel,Gierwinkel", ["phi", "theta", "psi"]),
        ("Querruder %,Höhenruder %,Seitenruder %", ["mixer_roll", "mixer_pitch", "mixer_yaw"]),
        ("roulis,tangage,lacet", ["phi", "theta", "psi"]),
        ("gyro.x,gyro.y,gyro.z", ["p", "q", "r"]),
        ("gyroADC[0],gyroADC[1],gyroADC[2]", ["p", "q", "r"]),
        ("ang vel x,ang vel y,ang vel z", ["p", "q", "r"]),
        ("a_RS_S_x [m s^-2],w_RS_S_y [rad s^-1],Aileron Cmd (norm)", ["ax", "q", "mixer_roll"]),
        ("qw,quat x,q_y", ["qw", "qx", "qy"]),
        ("vel x,pos y,vbat", ["vx", "y", "voltage"]),
        ("/rates/p,/controls/roll,throttlePct", ["p", "mixer_roll", "mixer_collective"]),
        ("ang acc x,temperature,satellites", ["", "", ""]),
        ("acceleration_x,acceleration_y,angular acceleration z", ["ax", "ay", ""]),
    ],
)
def test_names(names: str, channels: list[str]) -> None:
    told = guesses_of(f"time [s],{names}", WAVE, 0.9 * WAVE, 0.8 * WAVE)
    assert [channel for channel, _ in told] == ["time", *channels]


def test_one_sensor_has_one_unit_by_its_largest_axis() -> None:
    told = guesses_of("time [s],gyro.x,gyro.y,gyro.z", 90.0 * WAVE, 2.0 * WAVE, 0.1 * WAVE)
    assert [unit for _, unit in told] == ["s", "deg/s", "deg/s", "deg/s"]
    told = guesses_of("time [s],gyro.x,gyro.y,gyro.z", 3.0 * WAVE, 2.0 * WAVE, 0.1 * WAVE)
    assert [unit for _, unit in told] == ["s", "rad/s", "rad/s", "rad/s"]


def test_a_name_says_revolutions_and_an_empty_column_is_no_channel() -> None:
    told = guesses_of("time [s],rpm_0,voltage,roll", 300.0 + WAVE, np.full(TIME.size, np.nan), WAVE)
    assert told[1:] == [("omega_rotor", "rpm"), ("", ""), ("phi", "rad")]


def test_pulses_counts_and_a_sensor_on_its_head_are_turned() -> None:
    told = guessed(table("time [s],ail,acc z,rc_elevator", 1500.0 + 400.0 * WAVE, 9.8 + WAVE, 1500.0 + 9.0 * WAVE))
    assert told is not None
    roll, force, pitch = told[1][1:]
    assert (roll.factor, roll.offset, pitch.factor) == (0.002, -3.0, 0.002)
    assert (force.channel, force.factor) == ("az", -1.0)
    assert "at rest" in force.why


def test_a_column_is_no_channel_twice_and_not_against_its_unit() -> None:
    told = guesses_of("time [s],roll [deg],roll angle [deg],pitch [V]", WAVE, WAVE, WAVE)
    assert told == [("time", "s"), ("phi", "deg"), ("", "deg"), ("", "V")]


def test_without_a_header_the_rising_column_is_the_time() -> None:
    told = guessed(table(f"{-0.01:.6f},0.000000,0.000000", WAVE, WAVE))
    assert told is not None
    assert not told[0].header
    assert [guess.channel for guess in told[1]] == ["time", "", ""]


def test_the_mapping_reads_what_the_guesses_say(tmp_path: Path) -> None:
    path = tmp_path / "flug.csv"
    path.write_bytes(table("Zeit;Rollrate (deg/s);Querruder %", 20.0 * WAVE, 50.0 * WAVE, mark=";").content)
    told = guessed(open_source(path))
    assert told is not None
    turned = [Guess(g.index, g.name, g.channel, g.unit, -1.0 if g.channel == "mixer_roll" else 1.0) for g in told[1]]
    mapping = tmp_path / "flug.toml"
    mapping.write_text(mapping_text(mapping_of(turned)))
    flight = sp.read(path, mapping=mapping)
    assert flight.values("p") == pytest.approx(np.radians(20.0 * WAVE), abs=1e-6)
    assert flight.values("mixer_roll") == pytest.approx(-0.5 * WAVE, abs=1e-6)


def test_what_is_no_table_has_no_guesses() -> None:
    assert guessed(Source(Path("a.bin"), b"\xa3\x95\x80" + bytes(200))) is None
