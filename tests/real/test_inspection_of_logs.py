"""Healthy real logs have no jumps and no gaps; those of the CoaX have both, as their notes say."""

from __future__ import annotations

from pathlib import Path

import pytest

from swashplate.flights.flight import Flight
from swashplate.flights.inspect import inspect
from swashplate.flights.jumps import jumps
from swashplate.flights.readers.read import read


def healthy(data: Path) -> list[Path]:
    paths = [*data.glob("ardupilot_firmware/*.BIN"), *data.glob("ardupilot_sitl/*.BIN"), *data.glob("nanobench/*.csv")]
    return sorted(
        [*paths, data / "logs" / "2016-07-14_06_53_11.px4log", data / "field" / "10-bf-chirp" / "chirp_small.bbl"]
    )


def test_no_healthy_log_has_jumps_or_gaps(shared_data: Path) -> None:
    paths = healthy(shared_data)
    assert len(paths) >= 18
    for path in paths:
        flight = read(path)
        told = inspect(flight)
        assert jumps(flight) == {}, path.name
        assert [stream.name for stream in told.streams if stream.gaps] == [], path.name
        assert not any("jump" in text or "gap" in text for text in told.problems), path.name


def test_a_message_of_one_mode_pauses_in_the_others(shared_data: Path) -> None:
    told = inspect(read(shared_data / "ardupilot_firmware" / "raptor50_three_sweeps.BIN"))
    (stream,) = (each for each in told.streams if each.name == "system_identification")
    assert (stream.gaps, stream.pause) == (0, pytest.approx(7.03, abs=0.02))
    assert any("system_identification: written in some modes only" in note for note in told.notes)
    assert not any("omega_rotor" in text for text in told.problems)  # it is governed


def spoilt(flight: Flight, name: str, at: float, by: float) -> Flight:
    """The flight with a glitch of one sample."""
    values = flight.values(name).copy()
    values[flight.time(name).searchsorted(at)] += by
    return flight.with_channel(name, values, like=name)


@pytest.mark.parametrize(
    ("file", "name", "by"),
    [
        ("ardupilot_firmware/raptor50_three_sweeps.BIN", "p", 3.0),
        ("ardupilot_firmware/raptor50_three_sweeps.BIN", "az", 30.0),
        ("ardupilot_firmware/coax_roll_yaw_sweeps.BIN", "mixer_yaw", 1.0),
        ("nanobench/B2_circle_fast_rep2.csv", "z", 0.3),
        ("nanobench/B2_circle_fast_rep2.csv", "ax", 40.0),
    ],
)
def test_a_glitch_in_a_healthy_log_is_told(shared_data: Path, file: str, name: str, by: float) -> None:
    flight = read(shared_data / file)
    assert jumps(spoilt(flight, name, flight.start + 0.4 * flight.duration, by)) == {name: 2}


def test_tracking_of_the_coax_has_outliers_and_gaps(flight_july: Path, flight_august: Path) -> None:
    for path, gaps, longest in ((flight_july, 2, 0.153), (flight_august, 23, 0.051)):
        flight = read(path)
        told = inspect(flight)
        motion = next(stream for stream in told.streams if stream.name == "motion")
        assert (motion.gaps, motion.longest_gap) == (gaps, pytest.approx(longest, abs=0.001))
        assert jumps(flight)["attitude"] > 0
    assert {"x", "logged_vx", "logged_vy", "logged_vz", "logged_wz"} <= jumps(flight).keys()
