"""`swash reconstruct`: a table, a corrected flight that is read again, and JSON."""

from __future__ import annotations

import json
from pathlib import Path

from commands import swash

import swashplate as sp


def test_a_flight_is_reconstructed_and_written(simulated: Path, tmp_path: Path) -> None:
    out = tmp_path / "corrected.nc"
    done = swash("inspect", simulated, "--reconstruct", "-o", out)
    assert done.code == 0, done.err
    assert f"Written: {out}" in done.out
    flight = sp.read(out)
    assert flight.history[-1].operation == "correct_sensors"
    told = json.loads(swash("inspect", simulated, "--reconstruct", "--json").out)
    assert set(told) == {"biases", "scales", "notes"}
    assert sorted(told["biases"]) == sorted(flight.history[-1].details["biases"])
    assert told["biases"] or any("not measured" in note for note in told["notes"])
