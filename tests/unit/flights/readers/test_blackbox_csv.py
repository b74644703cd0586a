"""Blackbox logs made into tables by other programs: the channels, units and signs that the log itself gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import made_blackbox_logs as made
import swashplate as sp

N = 80
RAMP = np.arange(N)
COLUMNS = {
    "gyroADC[0]": 5 - RAMP, "gyroADC[1]": 2 * RAMP, "setpoint[2]": -RAMP, "mixer[1]": -5 * RAMP, "axisP[0]": RAMP,
    "headspeed": 1800 + RAMP, "motor[0]": 5 * RAMP,
}  # fmt: skip
EXPLORER = ['"firmwareType","Rotorflight"', '"firmwareVersion","4.4.0"', '"looptime","125"', '"rollPID","50,100,20"']


def _table(folder: Path, names, top=(), change=lambda rows: rows) -> Path:
    stamps = {"loopIteration": RAMP, "time": 5_000_000 + 2000 * RAMP}
    rows = np.stack(
        [{**stamps, **COLUMNS, "vbatLatest": 25.2 - 0.01 * RAMP}[n.partition(" (")[0]] for n in names], axis=1
    )
    lines = [
        ", ".join(f"{v:g}" if n.startswith("vbat") else f"{v:.0f}" for n, v in zip(names, row, strict=True))
        for row in rows
    ]
    (folder / "log.csv").write_text("\n".join([*top, ", ".join(names), *change(lines), ""]))
    return folder / "log.csv"


def test_a_table_with_its_header_gives_what_the_log_gives(tmp_path: Path) -> None:
    (tmp_path / "log.bbl").write_bytes(made.rotorflight(COLUMNS))
    log = sp.read(tmp_path / "log.bbl")
    table = sp.read(_table(tmp_path, ["loopIteration", "time", *COLUMNS], EXPLORER))
    assert table.provenance.vehicle == "Rotorflight 4.4.0"
    for name in ("p", "q", "r_demand", "mixer_pitch", "pid_p_roll", "omega_rotor", "motor_1"):
        assert table.values(name) == pytest.approx(log.values(name)), name
        assert table[name].attrs["units"] == log[name].attrs["units"]
    assert table.time("p") == pytest.approx(log.time("p"))


def test_a_table_without_a_header_says_what_is_assumed(tmp_path: Path) -> None:
    names = ["loopIteration", "time (us)", "gyroADC[0]", "motor[0]", "vbatLatest (V)"]
    flight = sp.read(_table(tmp_path, names))
    assert np.rad2deg(flight.values("p")) == pytest.approx(5.0 - RAMP)
    assert flight.values("voltage") == pytest.approx(25.2 - 0.01 * RAMP)  # converted by the program that wrote it
    told = " ".join(flight.provenance.notes)
    for said in ("names no firmware", "does not say whether blackbox_high_resolution"):
        assert said in told
    # The range of the motors is in the header: without it they stay numbers, and are no commands from 0 to 1.
    assert "motor_0" not in flight
    assert flight.values("motor_0_raw") == pytest.approx(5.0 * RAMP)
    assert flight.provenance.damage == ()


def test_rows_of_another_layout_are_never_read(tmp_path: Path) -> None:
    names = ["loopIteration", "time", "gyroADC[0]"]
    flight = sp.read(_table(tmp_path, names, change=lambda rows: [*rows[:60], *[f"{row}, 7" for row in rows[60:]]]))
    assert flight.time("p").size == 60
    assert "20 of 80 rows (25 %) are lost" in flight.provenance.damage[0]


def test_a_mapping_reads_it_as_any_table(tmp_path: Path) -> None:
    path = _table(tmp_path, ["loopIteration", "time (us)", "gyroADC[0]"])
    flight = sp.read(path, mapping={"channels": {"p": {"column": "gyroADC[0]", "unit": "deg/s"}}})
    assert flight.channels == ("p",)
    assert flight.rate("p") == pytest.approx(500.0)
