"""Tables as programs and people write them (`field/` of the real data): what is right for each layout.

All but the last few hold the same 8 s of one roll sweep at 250 Hz, or at 10 Hz, so that the numbers tell whether a
layout was understood: p has a median of 1.339 deg/s.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError

P = 1.339  # deg/s: the median of the roll rate


@dataclass(frozen=True)
class Right:
    """What is right for a layout: the channel of the roll rate, its rate [Hz] and samples, what is lost and noted."""

    p: str = "p"
    scale: float = np.pi / 180.0  # of a deg/s in the channel
    rate: float = 250.0
    samples: int = 2000
    channels: tuple[str, ...] = ("mixer_roll",)
    lost: str = ""
    noted: str = ""
    median: float = P


RAW = 1.0  # a channel that the schema does not know, in deg/s without a unit in the file
LAYOUTS = {
    # The program's own field names are Blackbox's: p from gyroADC[0], in whole degrees a second.
    "01_blackbox_decode.csv": Right(channels=("mixer_roll", "p_demand", "voltage", "current"), median=1.0),
    "02_explorer_export.csv": Right(channels=("mixer_roll", "p_demand"), median=1.0),
    # The topic is not in the file: its parts keep their names, and the time's unit shows in the rate.
    "03_vehicle_angular_velocity_0.csv": Right(p="xyz[0]", channels=("xyz[1]", "xyz[2]"), noted="taken in us"),
    "04_plotjuggler.csv": Right(p="/rates/p", channels=("/controls/roll",), noted="a stream of its own, at 62.5 Hz"),
    "04b_blanks_own_names.csv": Right(noted="1500 of 2000 cells (75 %) are blank: a stream of its own, at 62.5 Hz"),
    "05_decimal_comma.csv": Right(channels=("phi", "mixer_roll"), noted="decimals are written with commas"),
    "05b_utf16_tab_comma.csv": Right(channels=("phi", "mixer_roll"), noted="decimals are written with commas"),
    "06_quoted_comma.csv": Right(channels=("mixer_roll", "Torque, Request")),
    # Its own names; words are left out and said. There is no roll rate in it.
    "07_airdata.csv": Right(
        p="roll", rate=10.0, samples=80, channels=("xSpeed", "voltage"), noted="flycState", median=10.6
    ),
    "08_qgc.csv": Right(p="rollRate", scale=RAW, rate=10.0, samples=80, channels=("pitchRate",), median=0.496),
    "09_euroc_imu.csv": Right(p="w_RS_S_x", channels=("a_RS_S_z",)),
    "10_tum_gt.txt": Right(p="qx", scale=RAW, channels=("tx", "qw"), noted="taken in s", median=0.09226),
    "11_neurobem.csv": Right(p="ang vel x", channels=("mot 1", "vbat"), noted="taken in s"),
    "12_units_row.csv": Right(),
    "13_wrap_us.csv": Right(noted="turned over once"),
    "14_cfclient.csv": Right(p="gyro.x", scale=RAW, channels=("stabilizer.roll",), noted="taken in ms"),
    "15_jsbsim.csv": Right(p="P", channels=("Phi", "Aileron Cmd"), noted="did you mean 'p'?"),
    "16_us_dates.csv": Right(),
    "16b_iso_space.csv": Right(),
    "17_header_again.csv": Right(noted="the header stands again in 1 line (1002)"),
    # From line 1002 on there is a cell more: whose it is nobody knows.
    "18_extra_cells.csv": Right(samples=1000, lost="1000 of 2000 rows (50 %)", median=3.841),
    "20_nan.csv": Right(samples=1980, lost="20 of 2000 rows (1 %)", median=1.352),
}


@pytest.fixture
def field(shared_data: Path) -> Path:
    return shared_data / "field"


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_layout_is_read_right_or_what_is_lost_is_said(field: Path, name: str) -> None:
    right, flight = LAYOUTS[name], sp.read(field / "csv_layouts" / name)
    assert {right.p, *right.channels} <= set(flight.channels)
    assert flight.rate(right.p) == pytest.approx(right.rate, rel=1e-6)
    assert flight.time(right.p).size == right.samples
    assert flight.duration == pytest.approx((right.samples - 1) / right.rate, abs=0.1)
    assert np.median(flight.values(right.p)) == pytest.approx(right.median * right.scale, rel=2e-3)
    assert bool(right.lost) == bool(flight.provenance.damage)
    assert any(right.lost in text for text in (*flight.provenance.damage, ""))
    assert not right.noted or any(right.noted in text for text in flight.provenance.notes)


def test_every_layout_is_in_the_table(field: Path) -> None:
    assert {path.name for path in (field / "csv_layouts").iterdir()} == {*LAYOUTS, "19_time_restarts.csv"}


NUMBERED = {
    "09-wrap-csv/wrap.csv": Right(noted="turned over once"),
    "11-decimal-comma/05_decimal_comma.csv": Right(channels=(), noted="decimals are written with commas"),
    "11-decimal-comma/05b_utf16_tab_comma.csv": Right(channels=(), noted="decimals are written with commas"),
    "12-blackbox-csv/decode.csv": Right(samples=899, channels=("mixer_roll", "p_demand"), median=6.0),
    "12-blackbox-csv/02_explorer_export.csv": Right(channels=("mixer_roll", "p_demand"), median=1.0),
    "12-blackbox-csv/03_vehicle_angular_velocity_0.csv": Right(p="xyz[0]", channels=("xyz[1]", "xyz[2]")),
    "16-euroc-header/09_euroc_imu.csv": Right(p="w_RS_S_x", channels=("a_RS_S_z",)),
    "16-euroc-header/10_tum_gt.txt": Right(p="qx", scale=RAW, channels=("tx", "qw"), median=0.09226),
    "18-units-row/12_units_row.csv": Right(),
}


@pytest.mark.parametrize("name", NUMBERED)
def test_the_tables_of_the_numbered_cases(field: Path, name: str) -> None:
    """Nothing is lost in them, no name stands twice, and the header of EuRoC's form gives units."""
    right, flight = NUMBERED[name], sp.read(field / name)
    assert {right.p, *right.channels} <= set(flight.channels)
    assert flight.rate(right.p) == pytest.approx(right.rate, rel=1e-6)
    assert flight.time(right.p).size == right.samples
    assert np.median(flight.values(right.p)) == pytest.approx(right.median * right.scale, rel=2e-3)
    assert flight.provenance.damage == ()
    assert not any("twice" in text for text in flight.provenance.notes)
    assert any(right.noted in text for text in (*flight.provenance.notes, ""))
    if "euroc_imu" in name:
        assert (flight["w_RS_S_x"].attrs["units"], flight["a_RS_S_z"].attrs["units"]) == ("rad/s", "m/s^2")


def test_two_streams_of_their_own_rates(field: Path) -> None:
    flight = sp.read(field / "17-blanks" / "04b_blanks_own_names.csv")
    assert flight.rate("mixer_roll") == pytest.approx(62.5)
    assert flight.stream_of("p") != flight.stream_of("mixer_roll")


def test_a_clock_that_starts_anew_is_refused_or_cut(field: Path) -> None:
    path = field / "csv_layouts" / "19_time_restarts.csv"
    with pytest.raises(FlightError, match=r"goes backwards at sample 1000 .*\(50 %\).*starts anew there"):
        sp.read(path)
    flight = sp.read(path, bad_stamps="drop")
    assert flight.time("p").size == 1000
    assert "1000 of 2000 samples (50 %) are lost" in flight.provenance.damage[0]


# ---- 08: a sensor was added, the header was not ----------------------------------------------------------------------
@pytest.mark.parametrize("name", ["new_sensor.csv", "new_sensor_bare_numbers.csv"])
def test_shifted_columns_are_never_read(field: Path, name: str) -> None:
    flight = sp.read(field / "08-shifted-columns" / name)
    assert "1500 of 3000 rows (50 %) are lost: line 1502 has 6 cells, the header 5" in flight.provenance.damage[0]
    look = sp.inspect(flight)
    assert [sweep.channel for sweep in look.sweeps] == ["mixer_roll"]
    assert np.ptp(flight.values("mixer_pitch")) == 0.0
    assert flight.provenance.damage[0] in look.problems


# ---- 13: a transmitter's log -----------------------------------------------------------------------------------------
def test_date_and_time_in_two_columns(field: Path) -> None:
    flight = sp.read(field / "13-edgetx" / "edgetx_10hz.csv")
    assert flight.rate("Roll") == pytest.approx(10.0)
    assert flight.duration == pytest.approx(59.9)
    assert flight.epoch + flight.start == 1772720580.0  # 2026-03-05T14:23:00Z
    assert flight["Roll"].attrs["units"] == "rad"
    assert any("GPS, FM hold no numbers" in note for note in flight.provenance.notes)


# ---- 06, 14: MATLAB --------------------------------------------------------------------------------------------------
MAPPED = {
    "named": {"time": {"column": "time", "unit": "s"}, "p": {"column": "p", "unit": "rad/s"}},
    "own_struct": {"time": {"column": "log.time", "unit": "s"}, "p": {"column": "log.p", "unit": "rad/s"}},
    "sysid_toolbox_style": {"time": {"column": "t", "unit": "s"}, "p": {"column": "y(:,1)", "unit": "rad/s"}},
}


@pytest.mark.parametrize("name", MAPPED)
def test_matlab_files_of_any_layout_are_read_with_a_mapping(field: Path, name: str) -> None:
    loadmat = pytest.importorskip("scipy.io").loadmat
    path = field / "06-mat" / f"{name}.mat"
    flight = sp.read(path, mapping={"channels": MAPPED[name]})
    raw: Any = loadmat(path, simplify_cells=True)
    raw = raw.get("log", raw)
    truth = raw["p"] if "p" in raw else raw["y"][:, 0]
    np.testing.assert_array_equal(flight.values("p"), np.ravel(truth))
    np.testing.assert_array_equal(flight.time("p"), np.ravel(raw["time"] if "time" in raw else raw["t"]))


def test_version_7_3_is_read(field: Path) -> None:
    flight = sp.read(field / "06-mat" / "v73.mat", units={"p": "rad/s", "mixer_roll": "1"})
    assert flight.values("p").size == 1000
    assert flight.rate("p") == pytest.approx(50.0)


def test_a_healthy_file_with_an_object_is_not_called_damaged(field: Path) -> None:
    path = field / "14-opaque-mat" / "with_timeseries.mat"
    with pytest.raises(FlightError, match=r"rec \(a MATLAB object of class timeseries\)") as told:
        sp.read(path)
    assert "damaged" not in str(told.value)
    assert "opy it again" not in str(told.value)
    flight = sp.read(path, units={"time": "s", "p": "rad/s"})
    assert flight.time("p").tolist() == list(range(10))
    assert flight.provenance.damage == ()


# ---- a person's own table --------------------------------------------------------------------------------------------
def test_a_german_table_is_read_with_a_mapping(field: Path) -> None:
    """p' = -8 p + 60 u(t - 40 ms) is in it, with u the stick after its sign is turned."""
    channels = {
        "p": {"column": "Rollrate"}, "phi": {"column": "Roll Winkel"},
        "mixer_roll": {"column": "Querruder", "factor": -1.0},
    }  # fmt: skip
    flight = sp.read(field / "flug1_roll.csv", mapping={"channels": channels})
    assert "of 10728 rows (0.112 %) are lost: a number is missing in p (5), phi (3), mixer_roll (4)" in " ".join(
        flight.provenance.damage
    )
    assert flight.epoch + flight.start == pytest.approx(1718000000.0008, abs=1e-6)
    grid = np.arange(flight.start + 1.0, flight.stop - 1.0, 0.005)
    p, stick = (lambda t, n=name: np.interp(t, flight.time(n), flight.values(n)) for name in ("p", "mixer_roll"))
    # Both sides are integrated over 0.1 s, so that the noise of a derivative does not count.
    change, fits = p(grid)[20:] - p(grid)[:-20], {}
    for delay in np.arange(0.0, 0.081, 0.002):
        sums = [np.convolve(signal, np.full(20, 0.005), "valid")[:-1] for signal in (p(grid), stick(grid - delay))]
        found, left, *_ = np.linalg.lstsq(np.stack(sums, axis=1), change, rcond=None)
        fits[float(left[0])] = (delay, *found)
    delay, damping, power = fits[min(fits)]
    assert delay == pytest.approx(0.040, abs=0.006)  # a stick that is held between samples is half of one later
    assert (damping, power) == pytest.approx((-8.0, 60.0), rel=0.05)
