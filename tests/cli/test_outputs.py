"""What a run leaves in its folder: all of it or nothing, and never a model beside a failed fit."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from commands import one_message, swash

import swashplate as sp
from swashplate.api import identification
from swashplate.api.question import VerbQuestion
from swashplate.api.saying import Say, silent
from swashplate.api.verbs.identify import FitVehicle
from swashplate.atomic import folder_when_complete
from swashplate.cli.app import app
from swashplate.cli.console import as_json
from swashplate.cli.generate import checked_endings
from swashplate.cli.run import written, written_text
from swashplate.errors import IdentificationError, SwashError
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Estimate, Result
from swashplate.identification.core.sources import sources_of
from swashplate.identification.time.feedback import FlightDetails
from swashplate.models.vehicle import Vehicle
from swashplate.validation.validation import AxisVerdict, Score, Validation


def _fit(vehicle: Vehicle, flights: list[Flight]) -> Result[Any, Any]:
    one = np.eye(1)
    estimate = Estimate("tau_f_upper", "s", 1.6, 1.3, 0.02, float("nan"))
    return Result(
        method="filter-error",
        solution=vehicle.with_values({"tau_f_upper": 1.3}, status="identified"),
        start=vehicle,
        estimates=(estimate,),
        names=("tau_f_upper",),
        covariance=one,
        covariance_corrected=one,
        correlation=one,
        details=FlightDetails(),
        nuisance=Nuisance(),
        history=(3.0, 1.0),
        data=sources_of(flights),
        seconds=0.5,
    )


def _validation(fit: Result[Any, Any], flights: list[Flight]) -> Validation:
    scores = [
        Score(channel, 1.0, predictor, fit_percent, 0.02, 0.3, 40)
        for channel in ("phi", "theta")
        for predictor, fit_percent in (("model", 81.0), ("published card", 35.0), ("hold", 0.0))
    ]
    return Validation(
        vehicle=fit.model,
        published=fit.start,
        scores=tuple(scores),
        innovations=(),
        log_likelihood={},
        verdict=(AxisVerdict("roll", "good", "Predicts."), AxisVerdict("yaw", "cannot be judged", "Not moved.")),
        thresholds={},
        examples=(),
        records=(),
        measured=(),
        data=sources_of(flights),
        settings={},
    )


class Paged(VerbQuestion[None]):
    """Writes a page and a fit."""

    files = ("report.html", "fit.json")

    def answer(self, say: Say = silent) -> None:
        """Nothing: only where it writes is asked."""


class Work:
    """Stands in for the minutes of computing; a test changes what comes out of it."""

    def __init__(self) -> None:
        self.asked: dict[str, Any] = {}
        self.changes: dict[str, Any] = {}
        self.trouble: BaseException | None = None

    def identify(self, vehicle: Vehicle, flights: list[Flight], *, progress: Any, **asked: Any) -> Result[Any, Any]:
        self.asked = {"vehicle": vehicle, "flights": flights, **asked}
        progress(1, 2.0)
        return replace(_fit(vehicle, flights), **self.changes)

    def validate(self, model: Any, flights: list[Flight], *, progress: Any, **asked: Any) -> Validation:
        progress(0, 1)
        self.asked |= {"model": model, "hold_outs": flights, **asked}
        fit = model if isinstance(model, Result) else _fit(model, flights)
        return _validation(fit, flights)

    def report(self, *results: Any, path: Path, title: str | None = None) -> Path:
        fit = next((one for one in results if isinstance(one, Result)), None)
        if self.trouble is not None:
            raise self.trouble
        Path(path).write_text(f"{'FAILED' if fit and fit.failed else 'fine'} {title}", encoding="utf-8")
        return Path(path)


@pytest.fixture
def work(monkeypatch: pytest.MonkeyPatch) -> Iterator[Work]:
    done = Work()
    for verb in ("validate", "report"):
        monkeypatch.setitem(vars(sp), verb, getattr(done, verb))  # in the dictionary: nothing else is loaded
    monkeypatch.setattr(identification, "identify", done.identify)
    monkeypatch.setattr("swashplate.validation.validate.validate", done.validate)
    monkeypatch.setattr("swashplate.reporting.report.report", done.report)
    monkeypatch.setattr(identification, "report", done.report)
    return done


def _identify(simulated: Path, *extra: str | Path) -> Any:
    return swash("identify", "--vehicle", "coax", "--flight", f"{simulated}@0-6", *extra)


def _names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def test_identify_writes_the_posterior_that_was_asked_for(work: Work, simulated: Path, tmp_path: Path) -> None:
    del work
    outcome = _identify(simulated, "--posterior", "laplace", "--out", tmp_path / "fit")
    assert (outcome.code, outcome.err) == (0, "")
    assert _names(tmp_path / "fit") == ["fit.json", "model.toml", "posterior.nc", "report.html"]
    assert "posterior by laplace" in outcome.out
    fit = sp.load(tmp_path / "fit" / "fit.json")
    assert fit.posterior is not None
    assert fit.posterior.draws.shape == (4, 1000, 1)


def test_a_posterior_that_did_not_converge_ends_with_code_two_and_keeps_the_fit(
    work: Work, simulated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    del work

    def refused(*_: Any, **__: Any) -> Any:
        raise IdentificationError("the posterior did not converge: split-R-hat 1.2.")

    monkeypatch.setattr(identification, "draw_posterior", refused)
    outcome = _identify(simulated, "--posterior", "nuts", "--out", tmp_path / "fit")
    assert outcome.code == 2
    assert "its posterior is not: the posterior did not converge: split-R-hat 1.2" in outcome.err
    assert _names(tmp_path / "fit") == ["fit.json", "model.toml", "report.html"]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (("--posterior", "gibbs"), "'gibbs' is no posterior; there are laplace, nuts"),
        (("--posterior", "nuts", "--horizon", "0.5,1"), "errors ahead are no likelihood"),
    ],
)
def test_a_posterior_that_cannot_be_is_refused_before_the_fit(
    work: Work, simulated: Path, asked: tuple[str, ...], words: str
) -> None:
    outcome = _identify(simulated, *asked)
    assert outcome.code == 2
    assert words in outcome.err
    assert not work.asked


def test_identify_writes_four_files_and_ends_with_its_summary(work: Work, simulated: Path, tmp_path: Path) -> None:
    out = tmp_path / "deep" / "fit"
    outcome = _identify(simulated, "--hold-out", f"{simulated}@6-10", "--out", out)
    assert (outcome.code, outcome.err) == (0, "")
    assert _names(out) == ["fit.json", "model.toml", "report.html", "validation.json"]
    assert _names(tmp_path) == ["deep"]
    assert _names(tmp_path / "deep") == ["fit"]
    assert sp.vehicle(out / "model.toml").card.values()["tau_f_upper"] == 1.3
    assert json.loads((out / "fit.json").read_text())["estimates"][0]["sigma_corrected"] is None  # NaN is not JSON
    last = [line for line in outcome.out.splitlines() if line][-6:]
    assert [line.split(":")[0] for line in last] == ["What", "Fit", "Prediction", "Verdict", "Warnings", "Report"]
    assert "81" in last[2]
    assert "35" in last[2]
    assert "cannot be judged: yaw" in last[3]
    assert last[5].endswith(str(out / "report.html"))
    assert "SIMULATED FLIGHT" in outcome.out


def test_what_the_user_said_reaches_the_identification(work: Work, simulated: Path) -> None:
    said = ("--free", "tau_f_upper,linkage_lower", "--method", "output-error", "--fix", "mass=0.333", "--settings")
    outcome = _identify(
        simulated,
        *said,
        "tie=a_beta_u = a_alpha_v",
        "--prior",
        "tau_f_upper=1.6,0.4",
        "--settings",
        "iterations=7",
        "--rate",
        "50",
    )
    assert outcome.code == 0
    assert work.asked["free"] == ("tau_f_upper", "linkage_lower")
    assert work.asked["method"] == "output-error"
    assert work.asked["fix"] == {"mass": 0.333}
    assert work.asked["tie"] == ("a_beta_u = a_alpha_v",)
    assert work.asked["prior"] == {"tau_f_upper": (1.6, 0.4)}
    assert work.asked["iterations"] == 7
    (flight,) = work.asked["flights"]
    assert flight.rate("phi") == pytest.approx(50.0)
    assert not any(step.operation == "lowpass" for step in flight.history)


def test_a_fit_says_how_far_it_is(work: Work, simulated: Path) -> None:
    """The live page shows the share that is done, and what is left of the usual iterations."""
    said: list[tuple[str, float, float | None]] = []

    def say(what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None:
        said.append((what, done, total))

    FitVehicle("coax", str(simulated)).answer(say)
    assert ("fitting", 1, 60) in said


def test_a_failed_fit_leaves_a_report_that_says_so_and_no_model(work: Work, simulated: Path, tmp_path: Path) -> None:
    out = tmp_path / "fit"
    assert _identify(simulated, "--hold-out", f"{simulated}@6-10", "--out", out).code == 0
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    work.changes = {"failed": True, "problems": ("inertia_xx is negative.",)}
    outcome = _identify(simulated, "--hold-out", f"{simulated}@6-10", "--out", out)
    assert outcome.code == 2
    assert "inertia_xx is negative." in outcome.err
    # The earlier run's model and validation must not lie beside the report of a failed fit; the user's file stays.
    assert _names(out) == ["fit.json", "notes.txt", "report.html"]
    assert (out / "report.html").read_text(encoding="utf-8").startswith("FAILED")


@pytest.mark.parametrize(
    ("trouble", "code"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "report.html"), 2),
        (PermissionError(errno.EACCES, "Permission denied", "report.html"), 2),
        (RuntimeError("a bug"), 1),
        (KeyboardInterrupt(), 130),
    ],
)
def test_trouble_leaves_the_folder_as_it_was(
    trouble: BaseException, code: int, work: Work, simulated: Path, tmp_path: Path
) -> None:
    work.trouble = trouble
    out = tmp_path / "fit"
    outcome = _identify(simulated, "--out", out)
    assert outcome.code == code
    assert outcome.err.count("\n") == 1
    assert "Traceback" not in outcome.err
    assert _names(tmp_path) == []
    out.mkdir()
    (out / "model.toml").write_text("an earlier one", encoding="utf-8")
    assert _identify(simulated, "--out", out).code == code
    assert _names(out) == ["model.toml"]


def test_json_is_all_that_stands_on_standard_output(work: Work, simulated: Path) -> None:
    document = json.loads(_identify(simulated, "--json").out)
    assert document["fit"]["estimates"][0]["name"] == "tau_f_upper"
    assert document["validation"] is None
    assert (
        json.loads(swash("validate", "--vehicle", "coax", "--flight", simulated, "--json").out)["kind"] == "validation"
    )


def test_quiet_is_quiet(work: Work, simulated: Path, tmp_path: Path) -> None:
    outcome = _identify(simulated, "--quiet", "--out", tmp_path / "fit")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")


def test_validate_prints_every_rival_and_the_verdict(work: Work, simulated: Path, tmp_path: Path) -> None:
    out = tmp_path / "validation"
    outcome = swash("validate", "--vehicle", "coax", "--flight", simulated, "--horizons", "0.5,1", "--out", out)
    assert outcome.code == 0, outcome.err
    assert work.asked["horizons"] == (0.5, 1.0)
    for part in ("fit % model", "card", "hold", "rms", "Theil", "81", "35", "cannot be judged"):
        assert part in outcome.out
    assert _names(out) == ["report.html", "validation.json"]


def test_wrong_horizons_are_refused(work: Work, simulated: Path) -> None:
    for text in ("-1,2", "soon"):
        message = one_message(swash("validate", "--vehicle", "coax", "--flight", simulated, f"--horizons={text}"))
        assert "--horizons" in message


def test_json_has_no_nan_and_no_numpy() -> None:
    odd = {"a": float("nan"), "b": np.float64(2.0), "c": np.array([1.0, np.inf]), "d": (1, True, None), "e": Path("x")}
    assert json.loads(as_json(odd)) == {"a": None, "b": 2.0, "c": [1.0, None], "d": [1, True, None], "e": "x"}


def test_a_folder_is_replaced_file_by_file(tmp_path: Path) -> None:
    target = tmp_path / "out"
    target.mkdir()
    for name in ("old", "both", "mine"):
        (target / name).write_text("before", encoding="utf-8")
    with folder_when_complete(target, ours=("old", "both", "new")) as folder:
        for name in ("both", "new"):
            (folder / name).write_text("after", encoding="utf-8")
        assert _names(target)[-3:] == ["both", "mine", "old"]
    assert {name: (target / name).read_text() for name in _names(target)} == {
        "both": "after",
        "mine": "before",
        "new": "after",
    }


def test_an_output_is_a_file_or_a_folder_by_its_ending(tmp_path: Path) -> None:
    asked = Paged()
    with written(asked, tmp_path / "mine.json") as (folder, names):
        assert names == ("mine.json",)
        for name in asked.files:
            (folder / name).write_text(name)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.json"]
    assert (tmp_path / "mine.json").read_text() == "fit.json"
    for folder_named in ("run.json", "v1.2"):
        (tmp_path / folder_named).mkdir()
        with written(asked, tmp_path / folder_named) as (_, names):
            assert names == asked.files
    with pytest.raises(SwashError, match=r"ends in '\.pdf', expected one of \.html, \.json, or a folder for all"):
        checked_endings(asked, [tmp_path / "a.pdf"])
    with pytest.raises(SwashError, match="the folder does not exist"), written(asked, tmp_path / "deep" / "mine.json"):
        pass


def test_a_vehicle_is_an_argument_or_an_option_in_every_verb() -> None:
    one, other = swash("vehicle", "trim", "coax", "--json"), swash("vehicle", "trim", "--json", "--vehicle", "coax")
    assert one.code == 0
    assert json.loads(one.out) == json.loads(other.out)
    assert "Did you mean 'rmax'?" in one_message(swash("vehicle", "trim", "--vehicle=rmaxx"))
    assert "Did you mean 'rmax'?" in one_message(
        swash("simulate", "rmaxx", "--maneuver", "doublet:roll,0.5s,0.2", "-o", "a.nc")
    )
    assert "Did you mean 'rotor_body'?" in one_message(
        swash("identify", "--structure", "rotor_bodi", "--responses", "responses.nc")
    )
    for words in (("validate", "rmaxx"), ("validate", "--vehicle", "rmaxx"), ("validate", "--vehicle=rmaxx")):
        assert "Did you mean 'rmax'?" in one_message(swash(*words, "--flight", "none.nc"))
    assert "Did you mean 'rmax'?" in one_message(swash("maneuver", "design", "--vehicle", "rmaxx", "--unknown", "mass"))
    assert "--vehicle: is given more than once" in one_message(swash("validate", "--vehicle", "a", "--vehicle", "b"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("vehicle trim raptor50 --set mas=3", "Did you mean 'mass'?"),
        ("vehicle trim raptor50 --set bars=true", "Did you mean 'bar'?"),
        ("vehicle trim coax --set mixin=rotation", "Did you mean 'mixing'?"),
        ("vehicle rmaxx", "Did you mean 'rmax'?"),
        ("vehicle lst", "Did you mean 'list'?"),
        ("vehicle structures hybird", "Did you mean 'hybrid'?"),
        ("bench plann", "Did you mean 'plan'?"),
        ("data fetch coax65", "Did you mean 'coax56'?"),
    ],
)
def test_a_name_that_is_nearly_right_is_asked_after(line: str, words: str) -> None:
    done = swash(*line.split())
    assert done.code == 2
    assert words in done.err


def test_the_last_line_names_what_was_written(tmp_path: Path) -> None:
    study = tmp_path / "study"
    study.mkdir()
    (study / "report.html").touch()
    assert written_text([tmp_path / "mine.json"]) == f"Written: {tmp_path / 'mine.json'}"
    assert written_text([study]) == f"Report: {study / 'report.html'}"


def test_what_was_meant_comes_before_a_long_list(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time [s],phi [deg],servo_roll\n" + "".join(f"{k / 100},{k},0.1\n" for k in range(20)))
    told = one_message(swash("inspect", log, "--channels", "servo_rol", "-o", tmp_path / "a.png"))
    assert told.index("Did you mean 'servo_roll'?") < told.index("It has phi, servo_roll.")
    done = swash("inspect", log, "-o", tmp_path / "a.png")
    assert (done.code, (tmp_path / "a.png").is_file()) == (0, True)


def test_every_output_has_its_short_name() -> None:
    """In the help too, so that it need not be guessed."""

    def outputs(command: Any) -> Iterator[tuple[str, Any]]:
        for verb in getattr(command, "commands", {}).values():
            yield from outputs(verb)
        yield from ((command.name, parameter) for parameter in command.params if "--out" in parameter.opts)

    found = list(outputs(typer.main.get_command(app)))
    assert len(found) > 15
    assert [name for name, parameter in found if "-o" not in parameter.opts] == []
