"""Real logs with rates and attitude: none is accused, and each is when a rate is in degrees, reversed or exchanged."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest

from swashplate.flights.consistency import consistency
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read

_TREX = {"time": "s", **dict.fromkeys(("phi", "theta", "psi"), "rad"), **dict.fromkeys("pqr", "rad/s")}


def _nanobench(path: Path, *, attitude: tuple[str, str, str] = ("roll", "pitch", "yaw")) -> Flight:
    """A Crazyflie's log in our axes: forward-left-up to forward-right-down. Its angles are radians."""
    left: dict[str, Any] = {"factor": -1.0}
    channels = {
        "time": {"column": "t", "unit": "s"},
        "phi": {"column": attitude[0], "unit": "rad"},
        "theta": {"column": attitude[1], "unit": "rad", **left},
        "psi": {"column": attitude[2], "unit": "rad", **left},
        "p": {"column": "imu_gyro_x", "unit": "rad/s"},
        "q": {"column": "imu_gyro_y", "unit": "rad/s", **left},
        "r": {"column": "imu_gyro_z", "unit": "rad/s", **left},
        "x": {"column": "px", "unit": "m"},
        "y": {"column": "py", "unit": "m", **left},
        "z": {"column": "pz", "unit": "m", **left},
        "vx": {"column": "vx", "unit": "m/s"},
        "vy": {"column": "vy", "unit": "m/s", **left},
        "vz": {"column": "vz", "unit": "m/s", **left},
        "az": {"column": "imu_acc_z", "unit": "g", **left},
    }
    return read(path, mapping={"channels": channels})


@lru_cache(maxsize=1)
def _logs(data: Path) -> dict[str, Flight]:
    found = {"trex550": read(data / "trex550" / "trex550_flight.csv", units=_TREX)}
    found |= {path.stem: read(path) for path in sorted(data.glob("ardupilot_*/*.BIN"))}
    found |= {path.stem: _nanobench(path) for path in sorted((data / "nanobench").glob("*.csv"))}
    found |= {path.name: read(path) for path in sorted((data / "logs").iterdir()) if path.is_file()}
    found |= {path.stem: read(path) for path in sorted((data / "coax56").glob("flight_*.mat"))}
    return found


def test_no_real_log_is_accused(shared_data: Path) -> None:
    logs = _logs(shared_data)
    assert len(logs) >= 22
    assert {name: [str(f) for f in consistency(flight)] for name, flight in logs.items()} == {name: [] for name in logs}


@pytest.mark.parametrize("name", ["trex550", "heli_sid_roll_mix", "B3_figure8_fast_rep1"])
def test_a_spoilt_rate_is_found(shared_data: Path, name: str) -> None:
    flight = _logs(shared_data)[name]
    for rate in ("p", "q"):
        for factor, words in ((57.29578, "looks like deg/s"), (-1.0, "has the other sign")):
            spoilt = flight.with_channel(rate, factor * flight.values(rate), like=rate)
            (finding,) = consistency(spoilt)
            assert (finding.channel, finding.decisive) == (rate, True)
            assert words in finding.text
    exchanged = flight.with_channel("p", flight.values("q"), like="p").with_channel("q", flight.values("p"), like="q")
    assert {finding.channel for finding in consistency(exchanged)} == {"p", "q"}


@pytest.mark.parametrize(
    ("name", "rates"),
    [
        ("trex550", "pqr"),
        ("heli_sid_roll_mix", "pq"),
        ("heli_sid_pitch_mix", "pq"),
        ("heli_sid_coll_mix", "pqr"),
        ("coax_roll_yaw_sweeps", "pqr"),
        ("raptor50_three_sweeps", "pqr"),
        ("dataflash_reference.bin", "q"),
    ],
)
def test_a_wrong_scale_is_found_where_the_axis_moves(shared_data: Path, name: str, rates: str) -> None:
    flight = _logs(shared_data)[name]
    for rate in rates:
        for factor in (1.25, 0.8):
            (finding,) = consistency(flight.with_channel(rate, factor * flight.values(rate), like=rate))
            assert finding.channel == rate
            assert finding.scale is not None
            assert finding.scale[0] == pytest.approx(factor, rel=0.035)  # the logs' own sensors are off by up to 3 %
            assert not finding.decisive


def test_the_crazyflies_own_pitch_counts_the_other_way(shared_data: Path) -> None:
    """Its estimate of pitch is nose-up positive already; turned once more, it is found out."""
    path = shared_data / "nanobench" / "B2_circle_fast_rep2.csv"
    onboard = ("att_stateEstimate_roll", "att_stateEstimate_pitch", "att_stateEstimate_yaw")
    flight = _nanobench(path, attitude=onboard)  # and these are degrees
    texts = " ".join(str(finding) for finding in consistency(flight))
    assert "theta: reaches" in texts
    assert "q: has the other sign" in texts
