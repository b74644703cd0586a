"""Which reader a file gets: a mapping of columns is never left aside in silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError

COLUMNS = {"channels": {"time": {"column": "t", "unit": "s"}, "q": {"column": "imu_gyro_y", "unit": "rad/s"}}}


def test_a_mapping_wins_over_a_reader_that_knows_the_head(tmp_path: Path) -> None:
    rows = [f"{0.01 * k},0,1,0,{np.sin(k):.6f}" for k in range(50)]
    (tmp_path / "flight.csv").write_text("\n".join(["t,px,qw,motor_motor_m1,imu_gyro_y", *rows]))
    flight = sp.read(tmp_path / "flight.csv", mapping=COLUMNS)
    assert flight.channels == ("q",)
    np.testing.assert_allclose(flight.values("q"), np.sin(np.arange(50)), atol=1e-6)


def test_a_mapping_of_columns_for_a_file_without_columns_is_refused(tmp_path: Path) -> None:
    (tmp_path / "flight.bin").write_bytes(b"\xa3\x95\x80\x80YFMT" + bytes(range(256)))
    with pytest.raises(FlightError, match=r"flight\.bin: mapping: is no table of text"):
        sp.read(tmp_path / "flight.bin", mapping=COLUMNS)
