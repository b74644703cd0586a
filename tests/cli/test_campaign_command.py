"""`swash campaign`: run, status, report and resume as a user types them, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, swash

from made_campaigns import InProcess
from swashplate.api.campaigns import plan, verbs
from swashplate.api.campaigns.kinds.fleet import FleetKind
from swashplate.cli import console
from swashplate.flights.flight import Flight, stream

FLEET = """
kind = "campaign"
of = "fleet"
folder = "logs"
pattern = "*.nc"
input = "stick"
output = "p"
form = "0/1"
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A campaign's file and two logs, of which nothing is computed: a stand-in says what a fit would."""
    (tmp_path / "logs").mkdir()
    for name in "ab":
        Flight({"log": stream(np.arange(4) * 0.1, {"p": np.zeros(4)}, {})}).save(tmp_path / "logs" / f"{name}.nc")
    (tmp_path / "fleet.toml").write_text(FLEET)
    monkeypatch.setattr(verbs, "_chosen", lambda *_: lambda work, tasks: InProcess(work))
    monkeypatch.setattr(plan, "ProcessPool", lambda work, workers: InProcess(work))
    columns = ("cost", "coherence", "K", "tau", "pole")

    def run(kind: FleetKind, settings: object, portion: object, files: object) -> dict[str, np.ndarray]:
        return {"log": np.array(["a.nc"]), "verdict": np.array(["good"]), **{n: np.array([2.5]) for n in columns}}

    monkeypatch.setattr(FleetKind, "run", run)
    return tmp_path / "fleet.toml"


def test_from_a_dry_run_to_a_report(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dry = swash("campaign", "run", file, "--dry-run")
    assert dry.code == 0, dry.err
    assert dry.out.startswith("fleet: 2 logs in 2 tasks\na task: ")
    assert not (tmp_path / "out").exists()
    monkeypatch.setattr(console, "_STAGES_AFTER", 0.0)
    ran = swash("campaign", "run", file, "-o", tmp_path / "out")
    assert ran.code == 0, ran.err
    assert "fleet: 2 of 2 tasks done\nGood fits: 2 of 2 (100 %;" in ran.out
    assert f"swash campaign replay {tmp_path / 'out'} 0 -o worst-0.json" in ran.out, "a fit is no .nc"
    looked = json.loads(swash("campaign", "status", tmp_path / "out", "--json").out)
    assert (looked["done"], looked["rows"], looked["failed"]) == (2, 2, {})
    assert swash("campaign", "resume", tmp_path / "out", "-q").code == 0
    for name in ("r.html", "t.csv", "t.nc", "t.parquet"):
        assert swash("campaign", "report", tmp_path / "out", "-o", tmp_path / name).code == 0
        assert (tmp_path / name).stat().st_size > 0
    refused = swash("campaign", "report", tmp_path / "out", "-o", tmp_path / "r.pdf")
    assert "ends in '.pdf', expected one of .html, .nc, .csv, .parquet" in one_message(refused)
    assert (tmp_path / "t.csv").read_text().splitlines()[1].endswith(",a.nc,good,2.5,2.5,2.5,2.5,2.5")


def test_a_refused_result_is_said_by_every_look_and_the_exit_code(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert swash("campaign", "run", file, "-o", out).code == 0
    one, other = sorted((out / "results").iterdir())
    other.write_bytes(one.read_bytes())
    for words in (("status", out), ("status", out, "--json"), ("report", out, "-o", tmp_path / "r.html")):
        outcome = swash("campaign", *words)
        assert outcome.code == 2, words
        assert "are refused: " in outcome.err
        assert "it is the result of another task" in outcome.err
    assert "are refused: " in (tmp_path / "r.html").read_text()
    assert swash("campaign", "resume", out).code == 0
    assert swash("campaign", "status", out).code == 0


def test_tasks_that_were_given_up_are_the_exit_code(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = FleetKind.run

    def refusing(kind: FleetKind, settings: object, portion: object, files: object) -> dict[str, np.ndarray]:
        if getattr(portion, "first", 0) == 1:
            raise verbs.CampaignError("cannot be done.")
        return run(kind, settings, portion, files)  # type: ignore[arg-type]

    monkeypatch.setattr(FleetKind, "run", refusing)
    outcome = swash("campaign", "run", file, "-o", tmp_path / "out")
    assert outcome.code == 2
    assert "given up: rows from 1 (seed " in outcome.out
    assert outcome.err.endswith(f"Error: 1 of 2 tasks were given up: swash campaign status {tmp_path / 'out'}\n")


def test_progress_of_a_pipe_has_the_time_left(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter([100.0, 101.0, 112.0])
    monkeypatch.setattr(console.time, "monotonic", lambda: next(clock))
    line = console.Progress(quiet=False, every=10.0)
    line._stages = True
    for k, note in enumerate(("1 of 9 tasks", "2 of 9 tasks, 5 s left", "3 of 9 tasks, 4 s left")):
        line.say("flights", done=k, total=9, note=note)
    line.close()
    assert capsys.readouterr().err.splitlines() == ["... flights: 1 of 9 tasks", "... flights: 3 of 9 tasks, 4 s left"]


def test_what_cannot_be_is_refused(file: Path, tmp_path: Path) -> None:
    for words, said in (
        (("run", file), "--out: is missing. Say where results are kept"),
        (
            ("run", file, "-o", tmp_path / "o", "--settings", "insecure=true"),
            "--scheduler: is missing. Files for TLS and --insecure",
        ),
        (("run", tmp_path / "no.toml", "-o", tmp_path / "o"), "no.toml: there is no such file"),
        (("status", tmp_path), "holds no campaign. Begin one"),
        (("resume", tmp_path / "none"), "holds no campaign"),
        (("report", tmp_path, "-o", tmp_path / "r.html"), "holds no campaign"),
    ):
        assert said in one_message(swash("campaign", *words))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fleet.toml", "logs"]


def test_an_open_scheduler_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    Flight({"log": stream(np.arange(4) * 0.1, {"p": np.zeros(4)}, {})}).save(tmp_path / "logs" / "a.nc")
    file = tmp_path / "fleet.toml"
    file.write_text(FLEET)
    out, open_to_all = tmp_path / "o", ("--scheduler", "tcp://127.0.0.1:9")
    (tmp_path / "begun").mkdir()
    for words in (("run", file, "-o", out), ("resume", tmp_path / "begun")):
        told = one_message(swash("campaign", *words, *open_to_all))
        assert "speaks without TLS: every user of its machine" in told
        assert told.endswith("If everybody who reaches it may do that: --settings insecure=true.")
        assert "tls_cert: is missing" in one_message(
            swash("campaign", *words, "--scheduler", "tls://127.0.0.1:9", "--settings", f"tls_ca_file={file}")
        )
    assert not out.exists()
    assert not any((tmp_path / "begun").iterdir())
