"""The real CoaX-56 flights: sizes, signs checked against physics, and what the inspection says about them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from swashplate.errors import FlightError
from swashplate.flights import datasets
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import inspect
from swashplate.flights.readers.read import read
from swashplate.flights.schema import POSITION, QUATERNION

GRAVITY = 9.81
STEP = 0.01
# In the air: after the August record's tracking glitches, before the July record's crash.
AIRBORNE = {"july": (1.0, 17.0), "august": (5.0, 44.0)}


@pytest.fixture(scope="module")
def flights(flight_july: Path, flight_august: Path) -> dict[str, Flight]:
    return {"july": read(flight_july), "august": read(flight_august)}


def _uniform(flight: Flight, names: tuple[str, ...], window: tuple[float, float]) -> np.ndarray:
    """Channels at 100 Hz, smoothed over 0.5 s, shape (len(names), n)."""
    grid = np.arange(*window, STEP)
    rows = np.stack([np.interp(grid, flight.time(name), flight.values(name)) for name in names])
    return savgol_filter(rows, 51, 2, axis=1)


def _euler(flight: Flight, window: tuple[float, float]) -> np.ndarray:
    """phi, theta, psi [rad] on the same grid, shape (3, n)."""
    angles = Rotation.from_quat(flight.array(QUATERNION), scalar_first=True).as_euler("ZYX")[:, ::-1]
    grid = np.arange(*window, STEP)
    rows = np.stack([np.interp(grid, flight.time("qw"), np.unwrap(angle)) for angle in angles.T])
    return savgol_filter(rows, 51, 2, axis=1)


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a, b)[0, 1])


@pytest.mark.parametrize(("name", "samples", "seconds"), [("july", 2920, 19.673), ("august", 6521, 44.300)])
def test_sizes_and_rates(flights: dict[str, Flight], name: str, samples: int, seconds: float) -> None:
    flight = flights[name]
    assert flight.streams["motion"].sizes["time"] == flight.streams["inputs"].sizes["time"] == samples
    assert flight.duration == pytest.approx(seconds, abs=1e-3)
    assert flight.rate("x") == pytest.approx(150.0, abs=0.5)


@pytest.mark.parametrize("name", AIRBORNE)
def test_above_the_ground_is_negative_and_level_is_level(flights: dict[str, Flight], name: str) -> None:
    flight = flights[name].between(*AIRBORNE[name])
    assert flight.values("z").max() < -0.5
    quaternion = flight.array(QUATERNION)
    assert np.linalg.norm(quaternion, axis=1) == pytest.approx(1.0, abs=1e-12)
    down = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()[:, 2, 2]
    assert np.rad2deg(np.arccos(down.min())) < 12.0


@pytest.mark.parametrize("name", AIRBORNE)
def test_logged_velocity_is_the_position_s_derivative(flights: dict[str, Flight], name: str) -> None:
    window = AIRBORNE[name]
    position = _uniform(flights[name], POSITION, window)
    logged = _uniform(flights[name], ("logged_vx", "logged_vy", "logged_vz"), window)
    for axis, velocity in enumerate(np.gradient(position, STEP, axis=1)):
        assert _correlation(velocity, logged[axis]) > 0.95, POSITION[axis]


@pytest.mark.parametrize("name", AIRBORNE)
def test_gravity_accelerates_towards_the_lower_side(flights: dict[str, Flight], name: str) -> None:
    """In a hover du/dt = -g theta and dv/dt = g phi: wrong signs of attitude or axes would turn one of them round."""
    window = AIRBORNE[name]
    grid = np.arange(*window, STEP)
    rows = np.stack([np.interp(grid, flights[name].time("x"), flights[name].values(axis)) for axis in "xy"])
    north, east = savgol_filter(rows, 51, 3, deriv=2, delta=STEP, axis=1)
    phi, theta, psi = _euler(flights[name], window)
    forward, right = north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
    assert _correlation(forward, -theta) > 0.5
    assert _correlation(right, phi) > 0.5
    if name == "july":  # the record with clean tracking shows g itself
        assert np.polyfit(-theta, forward, 1)[0] == pytest.approx(GRAVITY, rel=0.15)
        assert np.polyfit(phi, right, 1)[0] == pytest.approx(GRAVITY, rel=0.15)


@pytest.mark.parametrize("name", AIRBORNE)
def test_yaw_rate_and_servos_have_the_schema_s_signs(flights: dict[str, Flight], name: str) -> None:
    window = AIRBORNE[name]
    p, q, r = np.gradient(_euler(flights[name], window), STEP, axis=1)
    logged, roll, pitch = _uniform(flights[name], ("logged_wz", "servo_roll", "servo_pitch"), window)
    assert _correlation(r, logged) > 0.9
    assert _correlation(roll, p) > 0.3
    assert _correlation(pitch, -q) > 0.3


def test_the_motors_share_the_load(flights: dict[str, Flight]) -> None:
    """The lower rotor works in the upper one's wake and needs more; both hover near half throttle."""
    for flight in flights.values():
        upper, lower = np.median(flight.values("motor_upper")), np.median(flight.values("motor_lower"))
        assert 0.4 < upper < lower < 0.65


def test_what_is_wrong_with_them_is_said(flights: dict[str, Flight]) -> None:
    july, august = inspect(flights["july"]), inspect(flights["august"])
    assert july.streams[0].longest_gap == pytest.approx(0.153, abs=1e-3)
    assert july.streams[0].jitter < 1e-5 < 5e-4 < august.streams[0].jitter
    assert any("attitude" in problem and "jump" in problem for problem in july.problems)
    assert any(problem.startswith("servo_pitch") for problem in july.problems)
    assert any("flips its sign 14 times" in note for note in august.notes)
    assert not any("flips" in note for note in july.notes)


def test_the_bench_records_are_no_flights(shared_data: Path) -> None:
    with pytest.raises(FlightError, match=r"no time column; found in2rpm\.input"):
        read(shared_data / "coax56" / "bench_input_to_rpm.mat")
    with pytest.raises(FlightError, match="no time column; found SB_ori"):
        read(shared_data / "coax56" / "stabilizer_bar_orientation.mat")


def test_every_file_of_the_data_set_is_here_with_its_hash(shared_data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SWASHPLATE_DATA", str(shared_data))
    assert [row.file for row in datasets.listing() if row.found is None] == []
    august = datasets.locate("coax56/flight_2011-08-01_vertical")
    assert august.name == "flight_2011-08-01_vertical.mat"


def test_a_real_flight_survives_netcdf(flights: dict[str, Flight], tmp_path: Path) -> None:
    flight = flights["august"]
    loaded = Flight.load(flight.save(tmp_path / "a.nc"))
    assert all(loaded.streams[name].identical(data) for name, data in flight.streams.items())
    assert loaded.provenance == flight.provenance


def test_a_table_without_header_from_another_vehicle(shared_data: Path) -> None:
    channels = {"time": {"column": 1, "unit": "s"}, "p": {"column": 3, "unit": "deg/s"}}
    flight = read(shared_data / "x8" / "x8roll.csv", mapping={"header": False, "channels": channels})
    assert flight.duration == pytest.approx(106.0, abs=1.0)
    assert flight.rate("p") == pytest.approx(100.0, rel=0.01)
