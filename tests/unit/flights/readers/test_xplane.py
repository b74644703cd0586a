"""X-Plane's Data.txt: its channels, its other columns, a header that stands again, and names that stand twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp

HEADER = (
    "   _real,_time |  _totl,_time |  Vtrue,_ktas |  pitch,__deg |  _roll,__deg |  hding,_true |  ____Q,rad/s |  "
    "____P,rad/s |  ____R,rad/s |  __lat,__deg |  __lon,__deg |  elev1,_cmnd |  elev1,_cmnd | "
)


def written(path: Path) -> Path:
    rows = []
    for t in (0.05 * np.arange(200)).tolist():
        roll, rate = 10.0 * np.sin(t), np.radians(10.0) * np.cos(t)
        cells = (3 + t, 30 + t, 100, 2 + t, roll, 90, 0.1 * t, rate, t, 47.3 + 1e-5 * t, 8.5, 0.1 * t, -0.1 * t)
        rows.append(" | ".join(f"{cell:12.6f}" for cell in cells) + " | ")
    path.write_text("\n".join(["", "", HEADER, *rows[:100], HEADER, *rows[100:], ""]))
    return path


def test_data_txt_is_read_with_its_own_names(tmp_path: Path) -> None:
    flight = sp.read(written(tmp_path / "Data.txt"))
    t = flight.time("phi") - 3.0 + flight.epoch
    assert t.size == 200
    assert np.degrees(flight.values("phi")) == pytest.approx(10.0 * np.sin(t), abs=1e-5)
    assert flight.values("p") == pytest.approx(np.radians(10.0) * np.cos(t), abs=1e-6)
    assert flight.values("airspeed") == pytest.approx(51.4444, abs=1e-4)
    assert np.degrees(flight.values("latitude")[0]) == pytest.approx(47.3)
    assert flight.values("elev1 _cmnd_2") == pytest.approx(-flight.values("elev1 _cmnd"))
    assert flight.provenance.damage == ()


def test_a_row_that_is_torn_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "Data.txt")
    lines = path.read_text().splitlines()
    lines[50] = lines[50][:60]
    path.write_text("\n".join(lines))
    assert "1 of 200 rows" in sp.read(path).provenance.damage[0]
