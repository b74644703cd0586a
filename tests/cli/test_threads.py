"""The number of threads changes no bit of a fit."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import swashplate.__main__ as entry
from swashplate.cli import app


def test_commands_do_their_linear_algebra_in_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(name, "2")
    monkeypatch.setattr(app, "main", lambda: None)
    monkeypatch.setattr(entry.gc, "set_threshold", lambda *_: None)
    entry.main()
    assert os.environ["OPENBLAS_NUM_THREADS"] == os.environ["OMP_NUM_THREADS"] == "1"


@pytest.mark.proof
@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core only")
@pytest.mark.parametrize("method", ["output-error", "filter-error"])
def test_identify_is_the_same_to_the_bit_on_one_core_and_on_two(method: str, tmp_path: Path) -> None:
    cores = sorted(os.sched_getaffinity(0))[:2]

    def swash(words: str, chosen: list[int]) -> None:
        many = {**os.environ, "OPENBLAS_NUM_THREADS": str(len(chosen)), "OMP_NUM_THREADS": str(len(chosen))}
        subprocess.run(
            ["taskset", "-c", ",".join(map(str, chosen)), sys.executable, "-m", "swashplate", *words.split()],
            env=many,
            check=True,
            capture_output=True,
        )

    flight = tmp_path / "flight.nc"
    swash(f"simulate --vehicle coax --maneuver multisine:roll+pitch,0.4-4Hz,20s,0.1 --out {flight}", cores)
    asked = f"identify --vehicle coax --flight {flight} --free flight --method {method} --rate 50"
    asked += " --settings iterations=4"
    for name, chosen in (("one", cores[:1]), ("two", cores)):
        swash(f"{asked} --out {tmp_path / name}", chosen)
    assert (tmp_path / "one" / "fit.json").read_bytes() == (tmp_path / "two" / "fit.json").read_bytes()
