"""From a sweep to gains: truth recovered, the copied lines give the same, and what was seen is never called unseen."""

from __future__ import annotations

import functools
import shlex
import time as clock
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import chirp, lsim
from typer.testing import CliRunner

from swashplate.api import fit_linear
from swashplate.cli.app import app
from swashplate.errors import FlightError, SwashError
from swashplate.flights.maneuvers.sweeps import Sweep, sweeps
from swashplate.identification.frequency.transfer_function_forms import suggest
from swashplate.links.logs.code_lines import Read, identified
from swashplate.links.logs.desk import Desk
from swashplate.links.logs.hold_out import hold_out
from swashplate.links.logs.identify_sweep import Identified, identify_sweep
from swashplate.links.logs.job import PageJob
from swashplate.links.logs.sweep_channels import channels_of
from swashplate.models.linear.transfer_function import Form

GAIN, POLE, DELAY = 25.0, 6.0, 0.03


def flown(path: Path, *, further: bool, sense: float = 1.0) -> None:
    """A roll sweep of 40 s on p / mixer_roll = 25 e^(-0.03 s) / (s + 6), and after it doublets where `further`.

    `sense` -1: the stick counts to the left.
    """
    time = np.arange(0.0, 90.0 if further else 44.0, 0.01)
    sweep = np.where((time > 2.0) & (time < 42.0), chirp(time - 2.0, 0.3, 40.0, 8.0, method="logarithmic"), 0.0)
    doublets = np.where(time > 50.0, np.sign(np.sin(2.0 * np.pi * 0.4 * time)), 0.0)
    u = 0.1 * (sweep + doublets)
    late = np.interp(time - DELAY, time, u)
    p = lsim(([GAIN], [1.0, POLE]), late, time)[1] + 0.005 * np.random.default_rng(3).standard_normal(time.size)
    rows = np.stack([time, sense * u, p], axis=1).tolist()
    path.write_text("time [s],mixer_roll [1],p [rad/s]\n" + "\n".join(",".join(map(repr, row)) for row in rows) + "\n")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Desk, dict[str, Any], Path]]:
    """A desk with both logs, what the job made of the first one's sweep, and their folder."""
    folder = tmp_path_factory.mktemp("sweep")
    flown(folder / "flight.csv", further=True)
    flown(folder / "short.csv", further=False)
    desk = Desk([(folder / name, Read(name)) for name in ("flight.csv", "short.csv")])
    desk.read_given()
    desk.drop(2)  # of one log alone first
    with pytest.MonkeyPatch.context() as patch:
        few = functools.partial(suggest, forms=(Form.parse("0/1"), Form.parse("1/2")))
        patch.setattr(fit_linear, "suggest", few)
        patch.chdir(folder)
        desk.identify(1, 0, "", "")
        end = clock.monotonic() + 120.0
        while desk.job.to_document()["state"] == "running":
            assert clock.monotonic() < end
            clock.sleep(0.05)
        state = desk.job.to_document()
        assert state["state"] == "done", state
        yield desk, state["result"], folder
    desk.close()


def test_the_truth_is_recovered_and_gains_are_suggested(made: tuple[Desk, dict[str, Any], Path]) -> None:
    _, document, _ = made
    (result,) = document["axes"]
    assert document["joined"] == ""
    assert (result["input"], result["output"], result["reference"]) == ("mixer_roll", "p", "")
    values = {name: value for name, value, *_ in result["fit"]["rows"]}
    assert result["fit"]["form"] == "0/1"
    assert values["K"] == pytest.approx(GAIN, rel=0.03)
    assert values["pole"] == pytest.approx(POLE, rel=0.06)
    assert values["tau"] == pytest.approx(DELAY, abs=0.003)
    (axis,) = result["gains"]
    suggested = {gain["name"]: gain["suggested"] for gain in axis["gains"]}
    assert suggested["ATC_RAT_RLL_FF"] == pytest.approx(POLE / GAIN, rel=0.05)
    assert axis["flown"] is None, "the log holds no gains"
    assert {gain["flown"] for gain in axis["gains"]} == {None}
    assert axis["suggested"]["phase_margin"][0] > 45.0


def test_a_sweep_that_carries_no_gains_says_why_and_offers_no_file(tmp_path: Path) -> None:
    """The stick to the left: the page shows the reason and its remedy, and nothing to fly is there to take away."""
    flown(tmp_path / "left.csv", further=False, sense=-1.0)
    opened = Desk([(tmp_path / "left.csv", Read("left.csv"))])
    opened.read_given()
    log = opened.log(1)
    (sweep,) = sweeps(log.ready)
    chosen = channels_of(log.ready, sweep)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit_linear, "suggest", functools.partial(suggest, forms=(Form.parse("0/1"),)))
        result = identify_sweep(log, sweep, chosen, others=[], folder=tmp_path, tell=lambda what, share: None)
    (axis,) = result.document["axes"]
    assert axis["gains"] == []
    assert axis["no_gains"].startswith("RLL: none: a positive mixer_roll turns p negative")
    assert any("wrong sign" in text and "--unit mixer_roll=-1" in text for text in axis["warnings"])
    assert "gains.param" not in result.files
    assert "report.html" in result.files
    opened.close()


def test_it_is_verified_on_the_doublets_that_the_fit_has_not_seen(made: tuple[Desk, dict[str, Any], Path]) -> None:
    _, result, _ = made
    seen = result["axes"][0]["verification"]
    assert seen["unseen"]
    assert seen["on"].startswith("another part of the log, 4")
    assert min(seen["time"]) > 42.0
    error = np.asarray(seen["flight"]) - np.asarray(seen["model"])
    assert np.std(error) < 0.1 * np.std(seen["flight"])
    assert not any("NOT A HOLD-OUT" in text for text in seen["warnings"])


def test_the_copied_lines_give_the_same(made: tuple[Desk, dict[str, Any], Path]) -> None:
    _, result, _ = made
    names: dict[str, Any] = {}
    exec(result["code"]["python"], names)
    wanted = {name: value for name, value, *_ in result["axes"][0]["fit"]["rows"]}
    found = {row.name: row.value for row in names["study"].fit.estimates}
    assert found == pytest.approx(wanted, rel=1e-6)
    (suggestion,) = names["study"].material.gains
    suggested = {g["name"]: g["suggested"] for g in result["axes"][0]["gains"][0]["gains"]}
    assert suggestion.parameters == pytest.approx(suggested, rel=1e-6)


@pytest.mark.proof
def test_the_copied_commands_give_the_same(made: tuple[Desk, dict[str, Any], Path]) -> None:
    _, result, folder = made
    suggested = {g["name"]: g["suggested"] for g in result["axes"][0]["gains"][0]["gains"]}
    for line in result["code"]["shell"].splitlines():
        done = CliRunner().invoke(app, shlex.split(line)[1:])
        assert done.exit_code == 0, done.output
    assert f"{suggested['ATC_RAT_RLL_P']:.4f}" in done.output
    assert (folder / "study" / "report.html").is_file()


def test_every_file_is_made_when_it_is_asked_for(made: tuple[Desk, dict[str, Any], Path]) -> None:
    desk, result, _ = made
    assert {"gains.param", "report.html", "model.toml", "sweep.csv", "responses.nc"} <= set(result["files"])
    for name in result["files"]:
        path = desk.job.file(name)
        assert path is not None
        assert path.stat().st_size > 50
    parameters = desk.job.file("gains.param")
    assert parameters is not None
    assert parameters.read_text().startswith("ATC_RAT_RLL_FF,0.2")
    for name in ("../flight.csv", "/etc/passwd", "nothing", ""):
        assert desk.job.file(name) is None


def test_without_another_part_it_says_that_nothing_was_verified(made: tuple[Desk, dict[str, Any], Path]) -> None:
    _, _, folder = made
    desk = Desk([(folder / name, Read(name)) for name in ("short.csv", "flight.csv")])
    desk.read_given()
    short, long = desk.log(1), desk.log(2)
    assert short.inspection is not None
    sweep = short.inspection.sweeps[0]
    alone = hold_out(short, sweep, "mixer_roll", "p", [])
    assert not alone.unseen
    assert "NO verification" in alone.description
    other = hold_out(short, sweep, "mixer_roll", "p", [long])
    assert other.unseen
    assert other.flight is long.flight
    desk.close()


def coupled(path: Path, axis: str, *, doublets: bool = False) -> None:
    """A sweep of 20 s in one of two coupled axes that rate loops hold in gusts, then perhaps doublets in roll."""
    time, random = np.arange(0.0, 60.0, 0.01), np.random.default_rng(5)
    sweep = np.where((time > 2.0) & (time < 22.0), chirp(time - 2.0, 0.3, 20.0, 6.0, method="logarithmic"), 0.0)
    moved = {"roll": 0.0 * time, "pitch": 0.0 * time} | {axis: 0.1 * sweep}
    if doublets:
        moved["roll"] = moved["roll"] + 0.1 * np.where(time > 30.0, np.sign(np.sin(2.0 * np.pi * 0.4 * time)), 0.0)
    rates, angles, u, rows = np.zeros(2), np.zeros(2), np.zeros(2), []
    gust = np.zeros(2)
    for k in range(time.size):
        gust = 0.98 * gust + 0.02 * random.standard_normal(2)
        u = np.array([moved["roll"][k], moved["pitch"][k]]) - 0.1 * rates - 0.3 * angles
        rows.append([time[k], *u, *(rates + 1e-3 * random.standard_normal(2))])
        rates = rates + 0.01 * (-POLE * rates + GAIN * (u + 0.4 * u[::-1]) + gust)
        angles = angles + 0.01 * rates
    head = "time [s],mixer_roll [1],mixer_pitch [1],p [rad/s],q [rad/s]"
    path.write_text("\n".join([head, *(",".join(map(repr, map(float, row))) for row in rows)]) + "\n")


def test_a_part_in_which_only_another_input_was_moved_verifies_nothing(tmp_path: Path) -> None:
    """In the log of the pitch sweep the roll command moves a lot, as its loop's answer to the coupling."""
    coupled(tmp_path / "roll.csv", "roll")
    coupled(tmp_path / "pitch.csv", "pitch")
    coupled(tmp_path / "both.csv", "pitch", doublets=True)
    desk = Desk([(tmp_path / name, Read(name)) for name in ("roll.csv", "pitch.csv", "both.csv")])
    desk.read_given()
    roll, pitch, both = (desk.log(k) for k in (1, 2, 3))
    assert roll.inspection is not None
    assert pitch.flight is not None
    sweep = Sweep(2.0, 22.0, "roll", 0.3, 6.0, "mixer_roll", "signal")
    assert np.std(pitch.flight.values("mixer_roll")) > 0.1 * np.std(roll.ready.values("mixer_roll"))
    found = hold_out(roll, sweep, "mixer_roll", "p", [pitch])
    assert not found.unseen
    assert "mixer_roll moved from outside" in found.description
    assert hold_out(roll, sweep, "mixer_roll", "p", [pitch, both]).flight is both.flight
    desk.close()


def test_sweeps_of_two_axes_in_two_logs_are_estimated_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each axis shows what its input alone would have been worth: off, where the other command moved along."""
    coupled(tmp_path / "roll.csv", "roll")
    coupled(tmp_path / "pitch.csv", "pitch")
    monkeypatch.chdir(tmp_path)
    desk = Desk([(tmp_path / name, Read(name)) for name in ("roll.csv", "pitch.csv")])
    desk.read_given()
    roll, pitch = desk.log(1), desk.log(2)
    for log, axis in ((roll, "roll"), (pitch, "pitch")):
        sweep = Sweep(2.0, 22.0, axis, 0.3, 6.0, f"mixer_{axis}", "signal")
        assert log.inspection is not None
        log.inspection = replace(log.inspection, sweeps=(sweep,))
    one = roll.inspection.sweeps[0]  # type: ignore[union-attr]
    chosen = channels_of(roll.ready, one)
    monkeypatch.setattr(fit_linear, "suggest", functools.partial(suggest, forms=(Form.parse("0/1"),)))
    made = identify_sweep(roll, one, chosen, others=[pitch], folder=tmp_path, tell=lambda what, share: None)
    result = made.document
    assert [(axis["input"], axis["output"]) for axis in result["axes"]] == [("mixer_roll", "p"), ("mixer_pitch", "q")]
    assert "of 2 logs (roll.csv, pitch.csv)" in result["joined"]
    for axis in result["axes"]:
        values = {name: value for name, value, *_ in axis["fit"]["rows"]}
        assert values["K"] == pytest.approx(GAIN, rel=0.08)
        assert axis["alone"]["decibels"] > 0.3
        assert "alone gives J" in axis["alone"]["words"]
        (off,) = axis["off"]
        assert off["output"] == {"p": "q", "q": "p"}[axis["output"]]
        share = off["share"][np.isfinite(off["share"])]
        assert share.size > 5
        assert np.median(share) == pytest.approx(20.0 * np.log10(0.4), abs=1.0)
        assert f"moves {off['output']} by at most" in off["words"]
    assert {"report-p.html", "report-q.html", "sweep-q.csv"} <= set(made.files)
    names: dict[str, Any] = {}
    exec(result["code"]["python"], names)
    for k, axis in enumerate(result["axes"], 1):
        values = {name: value for name, value, *_ in axis["fit"]["rows"]}
        again = {row.name: row.value for row in names[f"study_{k}"].fit.estimates}
        assert again == pytest.approx(values, rel=1e-6)
    own = identify_sweep(
        roll, one, chosen, others=[pitch], folder=tmp_path / "own", tell=lambda what, share: None, alone_only=True
    )
    assert len(own.document["axes"]) == 1
    desk.close()


@pytest.mark.parametrize("unseen", [True, False])
def test_the_lines_say_whether_the_fit_has_seen_the_stretch(unseen: bool) -> None:
    log = Read("flight.csv")
    stretch = (log, 1.0, 23.0, unseen)
    code = identified(
        [(log, 1.0, 23.0)], [("mixer_roll", "p", "")], [], (0.3, 6.0), [stretch], [("0/1", (0.3, 6.0), True)]
    )
    for text in (code.python, code.shell):
        assert ("# The fit has seen this stretch: it verifies nothing." in text) is not unseen
    assert ("unseen = " in code.python) is unseen
    assert ("hold_out=unseen" in code.python) is unseen
    compile(code.python, "lines", "exec")


@pytest.mark.parametrize(
    ("axis", "channel", "wanted"),
    [("roll mixer", "sid_target", ("mixer_roll", "p")), ("roll", "mixer_roll", ("mixer_roll", "p"))],
)
def test_channels_follow_from_the_axis(
    made: tuple[Desk, dict[str, Any], Path], axis: str, channel: str, wanted: tuple[str, str]
) -> None:
    flight = made[0].log(1).ready
    sweep = Sweep(0.0, 10.0, axis, 0.1, 10.0, channel, "log")
    assert channels_of(flight, sweep)[:2] == wanted
    with pytest.raises(FlightError, match="no output is known for a sweep of 'pitch'"):
        channels_of(flight, Sweep(0.0, 10.0, "pitch", 0.1, 10.0, "mixer_roll", "signal"))
    with pytest.raises(FlightError, match="no input is known"):
        channels_of(flight, sweep, input="nosuch")


def until(job: PageJob, state: str) -> dict[str, Any]:
    for _ in range(400):
        told = job.to_document()
        if told["state"] == state:
            return told
        clock.sleep(0.01)
    raise AssertionError(job.to_document())


def test_work_is_stopped_and_nothing_of_it_is_kept(tmp_path: Path) -> None:
    job, ended = PageJob(), []

    def endless(_: Path, tell: Any) -> Identified:
        try:
            while True:
                tell("working", 0.5)
                clock.sleep(0.01)
        finally:
            ended.append(True)

    job.start(endless)
    assert until(job, "running")["doing"] in ("starting", "working")
    with pytest.raises(SwashError, match="another identification is running"):
        job.start(endless)
    job.cancel()
    until(job, "cancelled")
    job.start(lambda *_: Identified({"a": 1}, {}))
    assert until(job, "done")["result"] == {"a": 1}
    for _ in range(400):
        if ended:
            break
        clock.sleep(0.01)
    assert ended == [True], "the thread itself has ended"
    job.close()


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (SwashError("is too short.", channel="p", hint="Fly longer."), "p: is too short."),
        (ZeroDivisionError("by nought"), "This went wrong inside swash (ZeroDivisionError: by nought)."),
    ],
)
def test_what_fails_is_told_in_words(error: Exception, words: str) -> None:
    job = PageJob()

    def broken(*_: Any) -> Identified:
        raise error

    job.start(broken)
    assert until(job, "failed")["problem"] == words
    job.close()
