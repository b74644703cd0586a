"""Without the extra `model` a log is read, looked at, answered, fitted and drawn; what needs it says the command."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from test_frequency_verbs import log

import swashplate as sp
from swashplate.errors import MissingLibraryError
from swashplate.extras import EXTRA_OF, library, missing

ROOT = Path(__file__).resolve().parents[2]

RUN = """
import json, sys
from importlib.abc import MetaPathFinder

class Absent(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in json.loads(sys.argv[1]):
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)

sys.meta_path.insert(0, Absent())
from typer.testing import CliRunner
from swashplate.cli.app import app

for words in json.loads(sys.argv[2]):
    done = CliRunner().invoke(app, words)
    drawn = "matplotlib" in sys.modules
    print(json.dumps([words[0], done.exit_code, drawn, done.stderr]))

import swashplate as sp
answered = sp.FrequencyResponse.load(sys.argv[3])
flight = sp.read(json.loads(sys.argv[2])[0][1])
for shown in (flight, sp.inspect(flight), answered):
    assert "<div" in shown._repr_html_() and shown.explore().data
try:
    flight.plot()
except ImportError as error:
    assert "swashplate[plot]" in str(error)
from pathlib import Path
from swashplate.links.logs.app import logs_app
try:
    from swashplate.api.verbs.look import Open
    Open("nowhere.bin").answer()
except sp.SwashError as error:
    assert "there is no such file" in str(error), "the verb itself runs without JAX"
from swashplate.links.logs.desk import Desk
desk = Desk()
try:
    logs_app(desk)
    opened = desk.open(Path(json.loads(sys.argv[2])[0][1]))
    drawn = desk.traces([(opened.number, "p", 0.0, 60.0)], bins=200)
    print(json.dumps(["open", opened.state, not len(drawn[0]["values"]), opened.problem]))
finally:
    desk.close()
for name in ("trim", "linearize"):
    try:
        getattr(sp, name)(sp.vehicle("coax"))
    except ImportError as error:
        print(json.dumps([name, type(error).__name__, False, str(error)]))
"""
COMMAND = "Install it with: pip install 'swashplate[model]'"


def test_the_light_verbs_do_without_what_the_others_name(tmp_path: Path) -> None:
    """One cold process in which the extras' libraries cannot be imported."""
    flown, unseen = (
        log(tmp_path / f"{name}.csv", seed=seed, swept=swept, seconds=seconds)
        for name, seed, swept, seconds in (("flown", 1, True, 120.0), ("unseen", 2, False, 20.0))
    )
    answers, model = tmp_path / "responses", tmp_path / "model"
    light: list[list[object]] = [
        ["inspect", flown],
        ["vehicle", "list"],
        ["maneuver", "sweep:roll,0.5-8Hz,30s,0.1", "--out", tmp_path / "sweep.csv"],
        ["respond", flown, "--inputs", "mixer_roll,mixer_pitch", "--outputs", "p,q", "--band", "0.5-8", "-o", answers],
        [
            "identify",
            "--responses",
            answers,
            "--input",
            "mixer_roll",
            "--outputs",
            "p",
            "--form",
            "1/2",
            "-o",
            tmp_path / "tf",
        ],
        [
            "identify",
            "--structure",
            "rotor_body",
            "--responses",
            answers,
            "--gains",
            "-o",
            model,
            "--settings",
            "starts=1",
        ],
        [
            "identify",
            "--structure",
            "rotor_body,rotor_body",
            "--responses",
            answers,
            "--search",
            "-o",
            tmp_path / "search",
        ],
        ["identify", "--structure", "rotor_body", "--flight", flown, "-o", tmp_path / "in time"],
        ["validate", "--vehicle", model / "model.toml", "--flight", unseen, "-o", tmp_path / "validation"],
        ["inspect", flown, "-o", tmp_path / "flown.html"],
    ]
    heavy: list[list[object]] = [
        ["vehicle", "trim", "coax"],
        ["identify", "--vehicle", "coax", "--flight", flown],
        ["demo"],
        ["live", "coax"],
        ["export", "coax", "--format", "control"],
        ["inspect", flown, "-o", tmp_path / "flown.svg"],
    ]
    words = json.dumps([[str(word) for word in verb] for verb in light + heavy])
    ran = subprocess.run(
        [sys.executable, "-c", RUN, json.dumps(sorted(EXTRA_OF)), words, str(answers / "responses.nc")],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    told = [json.loads(line) for line in ran.stdout.splitlines()]
    assert [(verb, code) for verb, code, *_ in told[: len(light)]] == [(verb[0], 0) for verb in light], told
    assert not any(drawn for _, _, drawn, _ in told), "matplotlib is for pictures on paper only"
    assert all((tmp_path / out / "report.html").is_file() for out in ("responses", "tf", "model", "validation"))
    for verb, code, _, err in told[len(light) : len(light) + len(heavy)]:
        assert (code, err.count("\n")) == (2, 1), err
        assert " needs the library " in err, (verb, err)
        assert f"Install it with: pip install 'swashplate[{'plot' if verb == 'inspect' else 'model'}]'" in err
    assert ran.returncode == 0, ran.stderr
    assert told[len(light) + len(heavy)] == ["open", "ready", False, ""]
    late = told[len(light) + len(heavy) + 1 :]
    assert [(name, kind) for name, kind, *_ in late] == [
        (name, "MissingLibraryError") for name in ("trim", "linearize")
    ]
    assert all(COMMAND in words for *_, words in late)


def test_a_log_with_attitude_is_inspected_without_what_is_slow_to_import(tmp_path: Path) -> None:
    """Of a cold start SciPy's rotations took half a second, and dask, where it is installed, more than one."""
    time = np.arange(3000) / 100.0
    rows = np.column_stack([time, *(np.sin(time * rate) for rate in (0.3, 0.2, 0.1)), time, time, time])
    head = "time [s],phi [rad],theta [rad],psi [rad],u [m/s],v [m/s],w [m/s]"
    np.savetxt(tmp_path / "turned.csv", rows, delimiter=",", header=head, comments="")
    code = (
        "import sys\nfrom typer.testing import CliRunner\nfrom swashplate.cli.app import app\n"
        "print([CliRunner().invoke(app, ['inspect', name]).exit_code for name in sys.argv[1:]])\n"
        "slow = ('scipy', 'dask.base', 'h5py', 'jax', 'matplotlib', 'plotly')\n"
        "print([name for name in slow if name in sys.modules])\n"
        "import scipy.signal, dask.base\n"
        "print([name for name in ('scipy', 'dask.base') if name in sys.modules])"
    )
    words = [
        sys.executable,
        "-c",
        code,
        log(tmp_path / "flown.csv", seed=1, seconds=20.0),
        str(tmp_path / "turned.csv"),
    ]
    ran = subprocess.run(words, capture_output=True, text=True, check=True, timeout=300)
    assert ran.stdout.splitlines() == ["[0, 0]", "[]", "['scipy', 'dask.base']"]


def test_the_extras_that_messages_name_are_the_projects() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    assert extras["cuda"] == ["swashplate[model]", "jax[cuda12]>=0.6"]
    others = {extra: names for extra, names in extras.items() if extra != "cuda"}
    brought = {name.replace("-", "_"): extra for extra, names in others.items() for name in _plain(names)}
    assert {name: EXTRA_OF[name] for name in brought} == brought
    assert set(EXTRA_OF) - set(brought) == {"jax"}, "of the extra for a card"
    assert not set(_plain(project["dependencies"])) & set(EXTRA_OF)
    (every,) = extras["all"]
    assert sorted(every[len("swashplate[") : -1].split(",")) == sorted(set(extras) - {"all", "compiler", "cuda"})


def _brought_by(requirements: list[str]) -> set[str]:
    """Names of all distributions that these requirements bring with them here, extras left out."""
    found: set[str] = set()
    open_ = [Requirement(line).name for line in requirements]
    while open_:
        name = open_.pop().lower().replace("_", "-")
        if name not in found:
            found.add(name)
            wants = map(Requirement, metadata.requires(name) or ())
            open_ += [want.name for want in wants if want.marker is None or want.marker.evaluate({"extra": ""})]
    return found


def _megabytes(names: set[str]) -> float:
    """What the files of distributions take on the disk by their own records; compiled Python has none."""
    return sum(file.size or 0 for name in names for file in metadata.files(name) or ()) / 1e6


def test_the_plain_package_brings_less_than_350_megabytes() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    plain = _brought_by(project["dependencies"])
    assert {"numpy", "scipy", "pandas", "xarray"} <= plain
    assert not {"jax", "jaxlib", "matplotlib", "dask", "casadi"} & plain
    own = sum(path.stat().st_size for path in (ROOT / "src").rglob("*") if path.suffix != ".pyc" and path.is_file())
    assert 200.0 < _megabytes(plain) + own / 1e6 < 350.0
    assert _megabytes(plain | _brought_by(["casadi", "matplotlib"])) > 350.0, "it can say no"


def _plain(requirements: list[str]) -> list[str]:
    return [line.partition(">=")[0] for line in requirements if not line.startswith("swashplate[")]


def test_a_library_that_is_missing_is_both_errors() -> None:
    with pytest.raises(ImportError, match="pip install no_such_library") as told:
        library("no_such_library.part", what="drawing")
    assert isinstance(told.value, sp.SwashError)
    assert isinstance(missing("casadi"), MissingLibraryError)
    assert "drawing needs the library no_such_library, which is not installed here." in str(told.value)
