"""The benchmark beside AircraftIden: what it says where that package is there, is not, or where there is no record."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks import frequency

PEER = """
import time


class Spectrum:
    def __init__(self, seconds):
        self.per_win_time = seconds


class Composite:
    specturmAnallist = [Spectrum(10.0), Spectrum(4.0)]


class FreqIdenSIMO:
    def __init__(self, time_, low, high, x, *y, win_num):
        assert win_num is None and abs(low - 0.5) < 1e-9 and abs(high - 50.0) < 1e-9
        time.sleep(DELAY)
        print("noise on the screen")
        self.composes = [Composite()]

    def get_freq_iden(self, index):
        return [1.0] * 150, None, None, None, None, None


class TransferFunctionParamModel:
    def __init__(self, *parts):
        pass


class TransferFunctionFit:
    def __init__(self, freq, response, coherence, model, nw):
        pass

    def init_omg_list(self, low, high):
        assert abs(low - 2.0) < 1e-9 and abs(high - 20.0) < 1e-9

    def solve(self):
        time.sleep(DELAY)
        return None, 345.6
"""


class Symbol:
    """As much of sympy's algebra as writing down a transfer function takes."""

    def __mul__(self, other: object) -> Symbol:
        return self

    def __add__(self, other: object) -> Symbol:
        return self

    def __pow__(self, other: object) -> Symbol:
        return self


SYMPY = "from test_benchmark_of_x8 import Symbol\n\ndef symbols(text):\n    return [Symbol() for _ in text.split()]\n"


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sweep of 60 s through two lags, where the benchmark looks for the X8's."""
    time = np.arange(6000) / 100.0
    command = np.sin(2.0 * np.pi * (0.05 * time + 0.5 * 0.12 * time**2))
    rate, lag = np.zeros(6000), 0.0
    for k in range(1, 6000):
        lag += 0.01 * 6.0 * (command[k - 1] - lag)
        rate[k] = rate[k - 1] + 0.01 * 20.0 * (lag - rate[k - 1])
    rate += 0.01 * np.random.default_rng(0).standard_normal(6000)
    (tmp_path / "x8").mkdir()
    np.savetxt(tmp_path / "x8" / "x8roll.csv", np.column_stack([time, command, np.degrees(rate)]), delimiter=",")
    monkeypatch.setenv("SWASHPLATE_DATA", str(tmp_path))
    return tmp_path


def _installed(folder: Path, monkeypatch: pytest.MonkeyPatch, *, delay: float) -> None:
    """A package of that name and a symbolic one beside it, for one test."""
    (folder / "AircraftIden").mkdir()
    (folder / "AircraftIden" / "__init__.py").write_text(f"DELAY = {delay}\n{PEER}", encoding="utf-8")
    (folder / "sympy.py").write_text(SYMPY, encoding="utf-8")
    monkeypatch.syspath_prepend(str(folder))
    for name in ("AircraftIden", "sympy"):
        monkeypatch.delitem(sys.modules, name, raising=False)


def test_without_the_peer_only_ours_is_measured(record: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frequency, "find_spec", lambda name: None)
    spans = frequency.x8(repeats=1)
    assert [span.target for span in spans] == [frequency.X8_WITHIN] * 2
    assert all("not installed" in span.note for span in spans)
    assert all(0.0 < span.seconds < 30.0 for span in spans)


def test_beside_the_peer_both_get_its_windows_and_lines(
    record: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _installed(record, monkeypatch, delay=0.3)
    responses, fit = frequency.x8(repeats=1)
    assert responses.name.endswith("2 windows and 150 lines")
    assert responses.target == pytest.approx(0.03, rel=0.5)
    assert responses.met == (responses.seconds <= responses.target)
    assert "AircraftIden takes 0.3" in responses.note
    assert "ends at J 345.6" in fit.note
    assert capsys.readouterr().out == ""
    for name in ("AircraftIden", "sympy"):
        sys.modules.pop(name, None)


def test_without_the_record_nothing_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SWASHPLATE_DATA", str(tmp_path))
    assert frequency.x8(repeats=1) == []
