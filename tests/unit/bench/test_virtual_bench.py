"""The virtual bench against hand-made physics, its sensors against their statistics, the record form there and back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.api.verbs.bench import evaluate_bench, simulate_bench
from swashplate.bench.evaluate import evaluate
from swashplate.bench.plan import plan as plan_bench
from swashplate.bench.record import BenchRecord, read_record, write_record
from swashplate.bench.record_files import read_records
from swashplate.bench.virtual_bench import RecordSchedule, Setup, points, repeated, virtual_bench
from swashplate.errors import BenchError, UnitError
from swashplate.models.vehicle import Vehicle

SILENT = Setup(
    force_noise=0.0,
    moment_noise=0.0,
    force_bias=0.0,
    moment_bias=0.0,
    force_drift=0.0,
    moment_drift=0.0,
    force_vibration=0.0,
    moment_vibration=0.0,
    speed_noise=0.0,
    speed_step=1e-9,
    speed_scatter=0.0,
    voltage_noise=0.0,
    airspeed_noise=0.0,
    angle_noise=0.0,
)
HOVER = {"motor_lower": 0.5526, "motor_upper": 0.5386}


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return sp.vehicle("coax")


def _end(record: BenchRecord) -> dict[str, float]:
    return {name: float(values[-1]) for name, values in record.channels.items()}


def test_hover_carries_the_weight_and_does_not_yaw(coax: Vehicle) -> None:
    (record,) = virtual_bench(coax, [points("r", ["thrust"], [HOVER], settle=0.0, hold=4.0)], setup=SILENT)
    end = _end(record)
    # PHYSICS: hover at 238.97 and 226.71 rad/s carries 0.302 kg.
    assert end["omega_lower"] == pytest.approx(238.97, abs=0.05)
    assert end["omega_upper"] == pytest.approx(226.71, abs=0.05)
    assert end["Fz"] == pytest.approx(-0.302 * 9.81, rel=1e-3)
    assert abs(end["Mz"]) < 1e-4
    assert end["Mx"] == end["My"] == 0.0


def test_tilt_torque_is_that_of_figure_6(coax: Vehicle) -> None:
    beta = np.radians(6.0)
    servo = {**HOVER, "servo_pitch": -beta / 0.1355}
    (record,) = virtual_bench(coax, [points("r", ["swashplate"], [servo], settle=0.0, hold=4.0)], setup=SILENT)
    end = _end(record)
    moment, force = np.hypot(end["Mx"], end["My"]), np.hypot(end["Fx"], end["Fy"])
    assert moment == pytest.approx(0.0642, abs=2e-4)  # total at 6 degrees
    assert moment - 0.103 * force == pytest.approx(0.0448, abs=1e-4)  # flapping, eq. 18
    assert end["My"] > 0.0 > end["Fx"]  # a disc that leans aft pulls back and lifts the nose


def test_a_step_of_a_motor_is_a_first_order_lag(coax: Vehicle) -> None:
    schedule = points("r", ["drive_steps"], [{"motor_upper": 0.5}, {"motor_upper": 0.6}], settle=0.0, hold=2.0)
    (record,) = virtual_bench(coax, [schedule], setup=SILENT)
    after = record["time"][200:] - record["time"][200]
    exact = 421.3723 * (0.6 - 0.1 * np.exp(-after / 0.185)) - 0.2555
    np.testing.assert_allclose(record["omega_upper"][200:], exact, atol=2e-2)


def test_the_magnet_deflects_the_upper_rotor_and_a_free_bar_follows_the_fuselage(coax: Vehicle) -> None:
    n = 800
    magnet = points("m", ["bar_linkage"], [{**HOVER, "bar_beta": 0.2}], settle=0.0, hold=3.0)
    free = RecordSchedule("f", ("bar_motion",), {"phi": np.r_[0.0, np.full(n - 1, 0.1)]}, np.ones(n), 100.0, bar="free")
    held, motion = virtual_bench(coax, [magnet, free], setup=SILENT)
    end = _end(held)
    thrust = 2.2607e-5 * end["omega_upper"] ** 2
    assert np.hypot(end["Fx"], end["Fy"]) == pytest.approx(thrust * np.sin(0.613 * 0.2), rel=2e-3)
    # After a ramp of one sample: eta = phi - (what is left), 0.1 (1 - exp(-t / tau)) from the middle of the ramp on.
    after = motion["time"][1:] - 0.005
    np.testing.assert_allclose(motion["eta_bar"][1:], 0.1 * (1.0 - np.exp(-after / 1.6)), atol=1e-6)


def test_a_fan_from_the_front_pushes_back_and_thinner_air_less(coax: Vehicle) -> None:
    blown = points("fan", ["fuselage_drag"], [{"airspeed_x": 2.0, "airspeed_y": -1.0}], settle=0.0, hold=1.0)
    thick, thin = (
        _end(virtual_bench(coax, [blown], setup=Setup(**{**vars(SILENT), "air_density": density}))[0])
        for density in (None, 0.6)
    )
    assert thick["Fx"] == pytest.approx(-0.0129 * 4.0, rel=1e-2)
    assert thick["Fy"] == pytest.approx(0.0129, rel=1e-2)
    assert thin["Fx"] / thick["Fx"] == pytest.approx(0.6 / coax.card.values()["air_density"])


def test_dead_zone_saturation_and_a_rotor_taken_off(coax: Vehicle) -> None:
    settings = [{"motor_upper": u} for u in (0.2, 0.75, 0.9, 0.95)]
    plan = points("r", ["speed_map"], settings, settle=2.0, hold=1.0)
    alone = points("s", ["single_rotor"], [{"motor_upper": 0.5}], settle=2.0, hold=1.0, removed="lower")
    record, single = virtual_bench(coax, [plan, alone], setup=SILENT)
    speeds = [float(record["omega_upper"][record["point"] == i][-1]) for i in (1, 2, 3, 4)]
    assert speeds[0] == 0.0
    assert speeds[2] == pytest.approx(421.3723 * 0.78 - 0.2555, abs=0.1)
    assert speeds[3] == pytest.approx(speeds[2], abs=1e-2)
    end = _end(single)
    assert end["Fz"] == pytest.approx(-1.15 * 2.2607e-5 * end["omega_upper"] ** 2, rel=1e-6)
    assert single.header == {"rotor_removed": "lower"}


def test_sensors_have_the_statistics_that_the_setup_says(coax: Vehicle) -> None:
    schedule = points("r", ["thrust"], [HOVER], settle=0.0, hold=40.0)
    setup = Setup(force_drift=0.0, force_vibration=0.0, speed_scatter=0.0)
    record, same, other = (virtual_bench(coax, [schedule], setup=setup, seed=seed)[0] for seed in (1, 1, 2))
    settled = slice(400, None)
    assert float(np.std(record["Fx"][settled])) == pytest.approx(0.02, rel=0.05)
    assert float(np.std(record["omega_upper"][settled])) == pytest.approx(np.hypot(0.4, 0.5 / 12**0.5), rel=0.05)
    assert np.allclose(np.round(record["omega_upper"] / 0.5), record["omega_upper"] / 0.5)
    np.testing.assert_array_equal(record["Fx"], same["Fx"])
    assert not np.array_equal(record["Fx"], other["Fx"])


def test_points_are_numbered_through_when_repeated() -> None:
    plan = repeated(points("r", ["thrust"], [HOVER, HOVER], settle=0.1, hold=0.2), 3)
    assert sorted(set(plan.point)) == [0, 1, 2, 3, 4, 5, 6]
    assert plan.duration == pytest.approx(3 * 2 * 0.3)


def test_a_record_survives_its_file(coax: Vehicle, tmp_path: Path) -> None:
    schedule = points("r", ["thrust", "speed_map"], [HOVER], settle=0.5, hold=0.5)
    (record,) = virtual_bench(coax, [schedule], setup=Setup(air_density=1.18))
    write_record(record, tmp_path / "r.csv")
    (back,) = read_records(tmp_path)
    assert (back.name, back.procedures, back.header) == (record.name, record.procedures, record.header)
    assert back.number("air_density", 1.0) == 1.18
    assert back.dt == pytest.approx(0.01)
    for name, values in record.channels.items():
        np.testing.assert_allclose(back[name], values, atol=5.1e-4)


_GOOD = ["# swashplate bench record", "# procedure: thrust", "time [s],Fz [N],omega_upper [rpm]"]
_ROWS = [f"{i / 100:.2f},-1.0,955" for i in range(12)]


def test_units_are_converted_and_foreign_columns_ignored(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    rows = [f"{row},1.0" for row in _ROWS]
    path.write_text("\n".join([*_GOOD[:2], "time [s],operator,Mx [N mm],omega_upper [rpm]", *rows]))
    record = read_record(path)
    assert set(record.channels) == {"time", "Mx", "omega_upper"}
    assert record["Mx"][0] == pytest.approx(955e-3)
    assert record["omega_upper"][0] == pytest.approx(2.0 * np.pi * 1.0 / 60.0)
    with pytest.raises(BenchError, match=r"r\.csv: Fz: the column is missing.*thrust needs 'Fz \[N\]'"):
        record["Fz"]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([_GOOD[0], *_GOOD[2:], *_ROWS], "names no procedure"),
        (_GOOD[:2], "nothing after the header"),
        ([*_GOOD, *_ROWS[:3]], "has 3 samples, expected at least 10"),
        ([*_GOOD, *_ROWS[:5], "0.05,hello,955", *_ROWS[6:]], "does not read as a table of numbers from line 4 on"),
        ([*_GOOD, *[f"{row},7" for row in _ROWS]], "numbers a line under"),
        ([*_GOOD, *_ROWS[:5], "0.05,nan,955", *_ROWS[6:]], "Fz: line 9 is not a finite number"),
        ([*_GOOD, *_ROWS[:5], *_ROWS[6:]], "time: is not uniform: 0.02 s after 0.04 s"),
        ([*_GOOD[:2], "clock [s],Fz [N],omega_upper [rpm]", *_ROWS], "time: the column is missing"),
    ],
)
def test_a_record_that_cannot_be_one_is_refused(lines: list[str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(BenchError, match=r"r\.csv") as error:
        read_record(path)
    assert message in str(error.value)


def test_a_wrong_unit_a_wrong_density_and_an_empty_folder_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("\n".join([*_GOOD[:2], "# air_density: thin", "time [s],Fz [m],omega_upper [rpm]", *_ROWS]))
    with pytest.raises(UnitError, match=r"Fz: unit 'm' is a unit of \[m\], expected one of \[N\]"):
        read_record(path)
    path.write_text(path.read_text().replace("[m]", "[N]"))
    with pytest.raises(BenchError, match="air_density: is 'thin'"):
        read_record(path).number("air_density", 1.2)
    path.rename(tmp_path / "r.txt")
    with pytest.raises(BenchError, match=r"holds no \.csv or \.mat file"):
        read_records(tmp_path)
    with pytest.raises(BenchError, match="is not a folder and not a file"):
        read_records(path)


def test_a_table_of_averaged_points_needs_no_time(coax: Vehicle, tmp_path: Path) -> None:
    """One line a point: the speed map of made points comes back, and what needs samples is refused."""
    levels = np.repeat(np.arange(0.4, 0.76, 0.05), 2)
    lines = [f"{u:.2f},{u:.2f},{400 * u:.4f},{430 * u - 2:.4f},12.22" for u in levels]
    heads = "motor_lower [1],motor_upper [1],omega_upper [rad/s],omega_lower [rad/s],voltage [V]"
    path = tmp_path / "map.csv"
    path.write_text("\n".join(["# procedure: speed_map", "# averaged: yes", heads, *lines]))
    (record,) = read_records(path, tmp_path, path)  # named three times, read once
    found = evaluate([record], coax).model.card.values()
    assert (found["k_drive_upper"], found["o_drive_lower"]) == pytest.approx((400.0, -2.0), abs=1e-3)
    with pytest.raises(BenchError, match=r"map\.csv: has no time base: it is a table of points"):
        _ = record.dt
    path.write_text(path.read_text().replace("speed_map", "drive_steps"))
    with pytest.raises(BenchError, match="drive_steps needs samples at a fixed rate"):
        evaluate(read_records(path), coax)


@pytest.mark.parametrize(
    "work", [plan_bench, lambda v: simulate_bench(vehicle=v), lambda v: evaluate_bench((), vehicle=v)]
)
def test_another_vehicle_than_the_bench_measures_is_refused(work: Callable[[Vehicle], object]) -> None:
    with pytest.raises(BenchError, match=r"raptor50: has the inputs theta0, B1, A1, theta0T, expected motor_lower"):
        work(sp.vehicle("raptor50"))
