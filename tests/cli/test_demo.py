"""`swash demo`, as `make demo` runs it: a flight as an object goes through the verb that takes names of logs."""

from __future__ import annotations

import json
from pathlib import Path

from commands import swash

from swashplate.api.asking import called
from swashplate.flights.flight import Flight


def test_the_main_job_leaves_its_files(tmp_path: Path) -> None:
    outcome = swash("demo", "--out", tmp_path / "demo", "--quiet")
    assert outcome.code == 0, outcome.err
    assert {"report.html", "model.toml", "fit.json", "validation.json"} <= {
        f.name for f in (tmp_path / "demo").iterdir()
    }
    assert json.loads((tmp_path / "demo" / "fit.json").read_text())["estimates"]


def test_logs_are_called_what_the_user_calls_them() -> None:
    flight = Flight.from_arrays([0.0, 0.01, 0.02], {"p": [0.0, 0.1, 0.2]})
    assert called("a.bin") == ["a.bin"]
    assert called(("a.bin", Path("b.bin"))) == ["a.bin", "b.bin"]
    assert called(None) == []
    assert called(flight) is None
    assert called([flight, "a.bin"]) is None
