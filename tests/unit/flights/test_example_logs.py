"""Logs that ship to be tried: small, readable, and each with what its card promises."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.flights import datasets
from swashplate.flights.example_logs import EXAMPLES, FOLDER, example

SWEEPS = {
    "helicopter_sweeps.bin": ["roll mixer", "pitch mixer"],
    "ordinary_flight.bin": [],
    "coax_flight.bin": ["yaw mixer"],
}


def test_they_are_small_and_all_of_them_have_a_card() -> None:
    there = sorted(path.name for path in FOLDER.iterdir())
    assert there == sorted(SWEEPS) == sorted(one.file for one in EXAMPLES)
    assert sum(one.path.stat().st_size for one in EXAMPLES) <= 2_000_000


@pytest.mark.parametrize("file", SWEEPS)
def test_each_is_read_without_a_problem_and_has_its_sweeps(file: str) -> None:
    flight = sp.read(f"examples/{Path(file).stem}")
    found = sp.inspect(flight)
    assert not found.problems
    assert [sweep.axis for sweep in found.sweeps] == SWEEPS[file]


def test_the_ordinary_flight_oscillates_in_pitch_when_it_says() -> None:
    flight = sp.read("examples/ordinary_flight.bin")

    def louder(name: str) -> float:
        time, steps = flight.time(name)[1:], np.diff(flight.values(name))
        return float(np.std(steps[(time > 101.0) & (time < 106.0)]) / np.std(steps[time < 99.0]))

    assert louder("q") > 2.5
    assert louder("p") < 1.5


def test_a_file_of_the_user_wins_and_other_names_are_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert datasets.locate("examples/nothing.bin") == Path("examples/nothing.bin")
    assert example("../datasets.py") is None
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples" / "coax_flight.bin").write_bytes(b"mine")
    assert datasets.locate("examples/coax_flight.bin") == Path("examples/coax_flight.bin")
