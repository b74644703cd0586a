"""Which reader a file gets: a mapping of columns is never left aside in silence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError
from swashplate.flights.schema import CHANNELS, channel

COLUMNS = {"channels": {"time": {"column": "t", "unit": "s"}, "q": {"column": "imu_gyro_y", "unit": "rad/s"}}}


def test_a_mapping_wins_over_a_reader_that_knows_the_head(tmp_path: Path) -> None:
    rows = [f"{0.01 * k},0,1,0,{np.sin(k):.6f}" for k in range(50)]
    (tmp_path / "flight.csv").write_text("\n".join(["t,px,qw,motor_motor_m1,imu_gyro_y", *rows]))
    flight = sp.read(tmp_path / "flight.csv", mapping=COLUMNS)
    assert flight.channels == ("q",)
    np.testing.assert_allclose(flight.values("q"), np.sin(np.arange(50)), atol=1e-6)


def test_a_mapping_of_columns_for_a_file_without_columns_is_refused(tmp_path: Path) -> None:
    (tmp_path / "flight.bin").write_bytes(b"\xa3\x95\x80\x80YFMT" + bytes(range(256)))
    with pytest.raises(FlightError, match=r"flight\.bin: mapping: is no table"):
        sp.read(tmp_path / "flight.bin", mapping=COLUMNS)


# ---- physical limits -------------------------------------------------------------------------------------------------
def _table(folder: Path, header: str, values: np.ndarray[Any, Any]) -> Path:
    rows = [f"{0.01 * k:.2f},{value:.9g}" for k, value in enumerate(values)]
    (folder / "log.csv").write_text("\n".join([f"time [s],{header}", *rows, ""]))
    return folder / "log.csv"


@pytest.mark.parametrize("name", [*CHANNELS, "p_imu", "phi_demand", "motor_3", "omega_2", "rcin_4", "altitude_baro"])
def test_what_nothing_of_a_kind_can_have_is_a_problem(tmp_path: Path, name: str) -> None:
    """Every channel of the schema has a limit; a number below it is not doubted, one above it is told."""
    known = channel(name)
    assert np.isfinite(known.largest)
    usual = np.linspace(-0.9, 0.9, 50) * known.largest
    assert sp.read(_table(tmp_path, f"{name} [{known.unit}]", usual)).provenance.damage == ()
    usual[7] = -1.1 * known.largest
    (said,) = sp.read(_table(tmp_path, f"{name} [{known.unit}]", usual)).provenance.damage
    assert said.startswith(f"{name}: 1 of 50 samples (2 %) are impossible: found up to")


def test_a_body_rate_of_1e5_degrees_a_second_is_never_true(tmp_path: Path) -> None:
    path = _table(tmp_path, "p [deg/s]", 1e5 * np.sin(np.arange(50)))
    (said,) = sp.read(path).provenance.damage
    assert "deg/s, expected 5.73e+03 deg/s at most (roll rate)" in said
    # Remarks once, although the saved flight remembers it and is checked when it is read.
    saved = sp.read(path).save(tmp_path / "log.nc")
    assert sp.read(saved).provenance.damage == (said,)
    assert said in sp.inspect(sp.read(saved)).problems


def test_what_the_schema_does_not_know_has_no_limit(tmp_path: Path) -> None:
    assert sp.read(_table(tmp_path, "counts", 1e9 * np.sin(np.arange(50)))).provenance.damage == ()
