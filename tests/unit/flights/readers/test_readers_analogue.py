"""Analogue recorders: volts into engineering units by a calibration file, the same filter on every channel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import butter, freqz

from swashplate.errors import FlightError, UnitError
from swashplate.flights.conditioning.filters import filtered
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read

RATE, N = 50.0, 1000
TIME = np.arange(N) / RATE
ROLL = 20.0 * np.sin(2 * np.pi * 0.5 * TIME)  # deg
STICK = 0.5 * np.sin(2 * np.pi * 0.5 * TIME + 0.7)

CALIBRATION = """
[recorder]
rate = 50
range = [0, 5]

[channels.phi]
column = "AI1"
unit = "deg"
points = [[0.5, -60], [2.5, 0], [4.5, 30]]

[channels.servo_pitch]
column = 2
unit = "1"
range = [-5, 5]
zero = 0.12
gain = 0.25
"""


def _volts() -> np.ndarray[Any, Any]:
    phi = np.interp(ROLL, [-60.0, 0.0, 30.0], [0.5, 2.5, 4.5])
    return np.column_stack([phi, 0.12 + STICK / 0.25])


def _read(folder: Path, calibration: str = CALIBRATION, volts: np.ndarray[Any, Any] | None = None) -> Flight:
    rows = _volts() if volts is None else volts
    table = "\n".join(["AI1,AI2", *(",".join(map(repr, row)) for row in rows.tolist())])
    (folder / "record.csv").write_text(table)
    (folder / "calibration.toml").write_text(calibration)
    return read(folder / "record.csv", mapping=folder / "calibration.toml")


def test_volts_become_units_and_every_channel_goes_through_the_same_filter(tmp_path: Path) -> None:
    flight = _read(tmp_path)
    assert flight.rate("phi") == pytest.approx(RATE)
    assert [step.operation for step in flight.history] == ["calibrate", "lowpass"]
    assert dict(flight.history[1].details) == {"cutoff": 6.0, "order": 2, "zero_phase": True}
    # At 0.5 Hz the filter, run twice, takes 1 / (1 + (0.5 / 6)^4): nothing that can be seen, and no phase.
    inside = slice(50, -50)
    assert_allclose(flight.values("phi")[inside], np.deg2rad(ROLL)[inside], atol=2e-3)
    assert_allclose(flight.values("servo_pitch")[inside], STICK[inside], atol=2e-4)


def test_the_filter_can_be_left_out_or_run_forwards_only(tmp_path: Path) -> None:
    bare = _read(tmp_path, CALIBRATION + "\n[filter]\ncutoff = 0\n")
    assert_allclose(bare.values("phi"), np.deg2rad(ROLL), atol=1e-12)
    causal = _read(tmp_path, CALIBRATION + "\n[filter]\nzero_phase = false\n")
    b, a = butter(2, 6.0, fs=RATE)
    response = freqz(b, a, [0.5], fs=RATE)[1][0]
    expected = np.abs(response) * 0.5 * np.sin(2 * np.pi * 0.5 * TIME + 0.7 + np.angle(response))
    assert_allclose(causal.values("servo_pitch")[100:], expected[100:], atol=1e-6)


def test_run_once_the_corner_is_at_3_db_and_a_constant_passes_unchanged() -> None:
    t = np.arange(4000) / 100.0
    wave = np.sin(2 * np.pi * 6.0 * t)
    once = filtered(wave, rate=100.0, cutoff=6.0, order=2, zero_phase=False)
    assert np.max(np.abs(once[1000:])) == pytest.approx(np.sqrt(0.5), rel=2e-3)
    level = np.full((300, 2), 3.0)
    assert_allclose(filtered(level, rate=100.0, cutoff=6.0, order=3, zero_phase=False), level, rtol=1e-12)


def test_a_time_column_and_samples_at_the_limit(tmp_path: Path) -> None:
    rows = _volts()
    rows[:, 0] = np.clip(rows[:, 0], 0.0, 5.0)
    rows[100:120, 0] = 5.0
    table = "\n".join(
        ["ms;AI1;AI2", *(f"{1000 * t:.3f};{a!r};{b!r}" for t, (a, b) in zip(TIME, rows.tolist(), strict=True))]
    )
    (tmp_path / "record.csv").write_text(table)
    text = CALIBRATION.replace("rate = 50", 'time = {column = "ms", unit = "ms"}').replace(
        "column = 2", 'column = "AI2"'
    )
    (tmp_path / "calibration.toml").write_text(text)
    flight = read(tmp_path / "record.csv", mapping=tmp_path / "calibration.toml")
    assert_allclose(flight.time("phi"), TIME, atol=1e-9)
    assert any("phi: 20 of 1000 samples at the recorder's limit" in note for note in flight.provenance.notes)
    uneven = table.replace("\n2000.000;", "\n2013.000;")
    (tmp_path / "record.csv").write_text(uneven)
    with pytest.raises(FlightError, match="time: its time steps are not even"):
        read(tmp_path / "record.csv", mapping=tmp_path / "calibration.toml")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("rate = 50", "", "needs either rate or time"),
        ("rate = 50", "rate = 0", "rate = 0 is not positive"),
        ("rate = 50", "rates = 50", r"the table \[recorder\] may hold"),
        ("range = [-5, 5]", "range = [0, 5]", r"servo_pitch: \d+ of 1000 samples lie outside of 0 to 5 V"),
        ("range = [-5, 5]", "range = [5]", "is not two voltages"),
        ("range = [-5, 5]", "range = [5, 0]", "does not rise"),
        ("[2.5, 0]", "[0.2, 0]", "phi: the voltages of its points do not rise"),
        ("[2.5, 0]", '["a", 0]', "points = 'a' in the calibration is not a number"),
        ("gain = 0.25", "", "servo_pitch: needs either points, or gain and zero"),
        ('unit = "deg"', "", "phi: needs column, unit"),
        ('column = "AI1"', 'column = "AI9"', "no column 'AI9'"),
        ("[channels.phi]", "[filter]\ncutoff = 30\n[channels.phi]", "does not fit a rate of 50 Hz"),
        ("[channels.phi]", "[filter]\norder = 1.5\n[channels.phi]", "whole order above zero"),
        ("[channels.phi]", "[other]\na = 1\n[channels.phi]", "must have"),
    ],
)
def test_a_wrong_calibration_is_named(old: str, new: str, says: str, tmp_path: Path) -> None:
    assert old in CALIBRATION
    with pytest.raises(FlightError, match=says):
        _read(tmp_path, CALIBRATION.replace(old, new, 1))


def test_a_unit_that_does_not_fit_and_units_beside_the_calibration(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match=r"phi: unit 'm' is a unit of \[m\]"):
        _read(tmp_path, CALIBRATION.replace('unit = "deg"', 'unit = "m"'))
    with pytest.raises(FlightError, match="units belong into the calibration"):
        read(tmp_path / "record.csv", mapping=tmp_path / "calibration.toml", units={"phi": "deg"})


def test_blank_cells_and_rows_of_another_layout(tmp_path: Path) -> None:
    rows = [",".join(map(repr, row)) for row in _volts().tolist()]
    (tmp_path / "calibration.toml").write_text(CALIBRATION)

    def record(lines: list[str]) -> Flight:
        (tmp_path / "record.csv").write_text("\n".join(["AI1,AI2", *lines]))
        return read(tmp_path / "record.csv", mapping=tmp_path / "calibration.toml")

    flight = record([*rows[:800], *[f"{row},1" for row in rows[800:]]])
    assert flight.time("phi").size == 800
    assert "200 of 1000 rows (20 %) are lost: line 802 has 3 cells" in flight.provenance.damage[0]
    with pytest.raises(FlightError, match="servo_pitch: has blank cells where other channels have volts"):
        record([*rows[:500], *[row.partition(",")[0] + "," for row in rows[500:]]])
