"""The reader of NanoBench flights: frames, units, names, and bad input. Files are written here from their page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from swashplate.errors import FlightError, UnitError
from swashplate.flights.readers.read import read

N = 40
EPOCH = 1772681685.5


def columns() -> dict[str, np.ndarray]:
    """A flight that climbs, rolls right, and turns nose right, in the file's own frames (z up, body y left)."""
    t = np.arange(N) * 0.01
    roll, yaw = 0.5 * t, -0.2 * t  # about x forward: right side down; about z up: negative is to the right
    q = Rotation.from_euler("ZYX", np.stack([yaw, 0.0 * t, roll], axis=1)).as_quat()  # x y z w
    zero = 0.0 * t
    made = {"t": EPOCH + t, "px": 1.0 + t, "py": 2.0 * t, "pz": 1.0 + 0.3 * t}
    made |= {"qx": q[:, 0], "qy": q[:, 1], "qz": q[:, 2], "qw": q[:, 3], "roll": roll, "pitch": zero, "yaw": yaw}
    made |= {"vx": zero + 1.0, "vy": zero + 2.0, "vz": zero + 0.3}
    made |= {"wx_vicon": zero + 0.5, "wy_vicon": zero, "wz_vicon": zero - 0.2}
    made |= {"imu_acc_x": zero, "imu_acc_y": zero + 0.1, "imu_acc_z": zero + 1.0}
    made |= {"imu_gyro_x": zero + 0.5, "imu_gyro_y": zero + 0.05, "imu_gyro_z": zero - 0.2}
    made |= {f"motor_motor_m{i}": zero + 10000.0 * i + t for i in (1, 2, 3, 4)}
    return made | {"pwr_pm_vbat": zero + 3.7}


def write(path: Path, made: Mapping[str, np.ndarray]) -> Path:
    rows = np.stack(list(made.values()), axis=1)
    text = "\n".join(",".join(f"{value:.9f}" for value in row) for row in rows)
    path.write_text(",".join(made) + "\n" + text + "\n")
    return path


def test_frames_units_and_names(tmp_path: Path) -> None:
    made = columns()
    flight = read(write(tmp_path / "a.csv", made))
    assert flight.provenance.reader == "nanobench"
    assert flight.provenance.vehicle == "crazyflie"
    assert flight.time("x")[0] == pytest.approx(0.5, abs=1e-6)  # whole seconds are taken off and kept
    assert flight.epoch == pytest.approx(EPOCH - 0.5)
    assert np.allclose(flight.values("x"), made["px"])
    assert np.allclose(flight.values("y"), -made["py"])
    assert np.allclose(flight.values("z"), -made["pz"])
    attitude = Rotation.from_quat(flight.array(("qw", "qx", "qy", "qz")), scalar_first=True).as_euler("ZYX")
    assert np.allclose(attitude[:, 2], made["roll"], atol=1e-8)  # right side down stays positive
    assert np.allclose(attitude[:, 0], -made["yaw"], atol=1e-8)  # nose right becomes positive
    for name, sign, column in (("p", 1.0, "x"), ("q", -1.0, "y"), ("r", -1.0, "z")):
        assert np.allclose(flight.values(name), sign * made[f"imu_gyro_{column}"]), name
    assert np.allclose(flight.values("az"), -9.80665)
    assert np.allclose(flight.values("ay"), -0.980665)
    assert np.allclose(flight.values("logged_vz"), -0.3)
    for i in (1, 2, 3, 4):
        assert np.allclose(flight.values(f"motor_{i}"), made[f"motor_motor_m{i}"] / 65535.0, atol=1e-12), i
    assert flight["voltage"].attrs["units"] == "V"


@pytest.mark.parametrize("lost", ["imu_acc_z", "pwr_pm_vbat", "motor_motor_m3"])
def test_a_missing_column_is_named(tmp_path: Path, lost: str) -> None:
    made = columns()
    del made[lost]
    with pytest.raises(FlightError, match=lost):
        read(write(tmp_path / "a.csv", made))


@pytest.mark.parametrize(("column", "factor"), [("motor_motor_m1", 10.0), ("pwr_pm_vbat", 1000.0), ("px", 1000.0)])
def test_other_units_are_refused(tmp_path: Path, column: str, factor: float) -> None:
    made = columns()
    made[column] = factor * made[column]
    with pytest.raises(UnitError, match="wrong units") as caught:
        read(write(tmp_path / "a.csv", made))
    assert column in str(caught.value)


def test_numbers_that_are_none_and_times_that_go_back_are_refused(tmp_path: Path) -> None:
    made = columns()
    made["qy"][7] = np.nan
    with pytest.raises(FlightError, match="finite"):
        read(write(tmp_path / "a.csv", made))
    made = columns()
    made["t"][9] = made["t"][5]
    with pytest.raises(FlightError, match="goes backwards"):
        read(write(tmp_path / "b.csv", made))
    assert read(tmp_path / "b.csv", bad_stamps="drop").time("x").size == N - 1


def test_rows_of_another_layout_are_never_read(tmp_path: Path) -> None:
    lines = write(tmp_path / "a.csv", columns()).read_text().splitlines()
    (tmp_path / "b.csv").write_text("\n".join([*lines[:21], *[f"7,{line}" for line in lines[21:]], ""]))
    flight = read(tmp_path / "b.csv")
    assert flight.time("x").size == 20
    assert "20 of 40 rows (50 %) are lost: line 22 has" in flight.provenance.damage[0]


def test_all_columns_that_are_wrong_are_named_at_once(tmp_path: Path) -> None:
    made = columns()
    made["px"][3], made["imu_gyro_z"][5] = np.nan, np.inf
    with pytest.raises(FlightError, match=r"2 faults: \(1\) px: 1 of 40 samples .*\(2\) imu_gyro_z: 1 of 40"):
        read(write(tmp_path / "a.csv", made))
