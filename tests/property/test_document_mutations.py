"""Every kind of document with something wrong in it: it is accepted, or refused by a short error of ours. Nothing else.

In short here; `make proof` does ten thousand of each kind and counts.
"""

from __future__ import annotations

import json
import os
import random
import time
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from made_results import result
from mutations import mutated
from proof_page import leave
from swashplate.control.controller_file import read_controller, save_controller
from swashplate.control.draws.robustness import draw_models
from swashplate.control.laws.autopilot import Autopilot, autopilot
from swashplate.control.laws.observed_autopilot import ObservedAutopilot
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.design import design
from swashplate.errors import SwashError
from swashplate.export.ardupilot_state_space import KEYS, read_ardupilot
from swashplate.export.control_json import control_json, read_linear
from swashplate.export.linear import Linear
from swashplate.filtering.sensor_suite import suite
from swashplate.links.servos import servo_mapping

SIEGE = float(os.environ.get("SWASHPLATE_SIEGE_SECONDS", "60"))
"""Seconds for each kind of document, in the long form."""
MUTANTS = 15  # of each kind, in the short form, which does not look at a clock
LONGEST_MESSAGE, SLOWEST = 2_000, 10.0  # characters, s


@dataclass(frozen=True)
class Kind:
    """A document that works, and what reads it."""

    form: str
    write: Callable[[], str]
    load: Callable[[Path], object]

    @cached_property
    def text(self) -> str:
        return self.write()

    @property
    def document(self) -> dict[str, Any]:
        return tomllib.loads(self.text) if self.form == "toml" else json.loads(self.text)


def _saved(controller: Autopilot | Lqg | ObservedAutopilot, folder: Path) -> str:
    save_controller(controller, folder / "controller.toml")
    return (folder / "controller.toml").read_text()


def _autopilot(folder: Path) -> str:
    coax = sp.vehicle("coax")
    return _saved(autopilot(coax, sp.trim(coax)), folder)


def _lqg(folder: Path) -> str:
    return _saved(design(sp.vehicle("coax"), sensors=suite("gyro@50,mocap@50"), rate=50.0), folder)


def _vehicle_fit() -> str:
    covariance = np.array([[0.01, 0.0008], [0.0008, 0.0001]])
    values, tied = {"tau_f_upper": 1.5, "linkage_lower": 0.13}, {"k_zeta_lower": "linkage_lower"}
    return json.dumps(result(sp.vehicle("coax"), values, covariance, corrected=covariance, ties=tied).to_document())


def _linear_fit() -> str:
    model = sp.structure("thirteen_state").structure
    assert model is not None
    values = {name: model.parameters[name].value for name in ("Lb", "Ma")}
    return json.dumps(result(model, values, 0.25 * np.array([[1.0, 0.9], [0.9, 1.0]])).to_document())


def _linear() -> str:
    eye = np.eye(2)
    names, units = ("p", "q"), {"p": "rad/s", "q": "rad/s"}
    return control_json(Linear("two", "Two", "", -eye, eye, eye, 0 * eye, names, ("a", "b"), names, units, {"a": 0.02}))


MAPPING = """
delimiter = ","
[channels]
time = {column = "t", unit = "ms"}
phi = {column = "roll", unit = "deg", factor = -1.0}
x = {column = 3, unit = "mm"}
"""
RECORDER = """
[recorder]
rate = 50
range = [0, 5]
[filter]
order = 2
cutoff = 6.0
zero_phase = true
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


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Kind]:
    folder = tmp_path_factory.mktemp("documents")
    coax, raptor, model = sp.vehicle("coax"), sp.vehicle("raptor50"), sp.structure("thirteen_state").structure
    rows = [f"{20 * k},{np.sin(k)},{k % 7}" for k in range(100)]
    (folder / "table.csv").write_text("\n".join(["t,roll,x", *rows]))
    (folder / "volts.csv").write_text("\n".join(["AI1,AI2", *(f"{2.5 + np.sin(k)},{np.cos(k)}" for k in range(100))]))

    def flown(path: Path) -> object:
        mapping = servo_mapping(path, raptor)
        return mapping.inputs([1500.0] * 16, 0.01)

    def packaged(package: str, name: str) -> Callable[[], str]:
        return lambda: (resources.files("swashplate") / package / name).read_text(encoding="utf-8")

    return {
        "card of a coaxial": Kind("toml", packaged("models/data", "coax.toml"), sp.vehicle),
        "card of a helicopter": Kind("toml", packaged("models/data", "raptor50.toml"), sp.vehicle),
        "structure": Kind("toml", packaged("models/linear/structures", "thirteen_state.toml"), sp.structure),
        "autopilot": Kind("toml", lambda: _autopilot(folder), read_controller),
        "LQG": Kind("toml", lambda: _lqg(folder), read_controller),
        "servo map": Kind("toml", packaged("links/mappings", "raptor50.toml"), flown),
        "CSV map": Kind("toml", lambda: MAPPING, lambda path: sp.read(folder / "table.csv", mapping=path)),
        "recorder": Kind("toml", lambda: RECORDER, lambda path: sp.read(folder / "volts.csv", mapping=path)),
        "fit.json of a vehicle": Kind("json", _vehicle_fit, lambda path: draw_models(coax, path, count=3, seed=0)),
        "fit.json of a model": Kind("json", _linear_fit, lambda path: draw_models(model, path, count=3, seed=0)),
        "linear model": Kind("json", _linear, read_linear),
        "ArduPilot model": Kind("json", lambda: json.dumps(dict.fromkeys(KEYS, 0.5)), read_ardupilot),
    }


def _outcomes(
    kind: Kind, path: Path, *, seeds: Iterator[int], seconds: float = np.inf, slowest: float = np.inf
) -> tuple[Counter[str], list[str]]:
    """How often a kind was accepted, refused, or ended otherwise; and the first ones of the last."""
    document, counts, bad = kind.document, Counter[str](), []
    end = time.monotonic() + seconds
    for seed in seeds:
        text = mutated(document, random.Random(seed), form=kind.form)
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        begin = time.monotonic()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                kind.load(path)
            outcome = "accepted"
        except SwashError as error:
            outcome = "refused" if len(str(error)) <= LONGEST_MESSAGE else "message too long"
        except Exception as error:
            outcome = f"{type(error).__name__}: {error}"[:200]
        if time.monotonic() - begin > slowest:
            outcome = "slow"
        counts["other" if outcome not in ("accepted", "refused") else outcome] += 1
        if outcome not in ("accepted", "refused"):
            bad.append(f"seed {seed}: {outcome}")
        if time.monotonic() > end:
            break
    return counts, bad


NAMES = (
    "card of a coaxial", "card of a helicopter", "structure", "autopilot", "LQG", "servo map", "CSV map", "recorder",
    "fit.json of a vehicle", "fit.json of a model", "linear model", "ArduPilot model",
)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_a_document_with_something_wrong_is_accepted_or_refused(
    name: str, kinds: dict[str, Kind], tmp_path: Path
) -> None:
    kind = kinds[name]
    (tmp_path / "whole").write_text(kind.text)
    kind.load(tmp_path / "whole")
    counts, bad = _outcomes(kind, tmp_path / f"mutant.{kind.form}", seeds=iter(range(MUTANTS)))
    assert not bad
    assert counts["refused"] > 0


@pytest.mark.proof
def test_many_documents_with_something_wrong(kinds: dict[str, Kind], tmp_path: Path) -> None:
    rows, everything = [], []
    for name in NAMES:
        seeds = iter(range(1_000, 11_000))
        counts, bad = _outcomes(
            kinds[name],
            tmp_path / f"mutant.{kinds[name].form}",
            seeds=seeds,
            seconds=SIEGE,
            slowest=SLOWEST,
        )
        rows.append([name, counts.total(), counts["accepted"], counts["refused"], counts["other"]])
        everything += [f"{name}, {text}" for text in bad]
    leave(
        "siege-documents",
        {
            "title": "Documents with something wrong in them",
            "text": "Entries left out, doubled, renamed, exchanged, of another type, huge, not finite, nested, and "
            "texts that are cut or damaged; at most a minute a kind. Other: any end but acceptance or an error of "
            f"swashplate's of at most {LONGEST_MESSAGE:,} characters within {SLOWEST:g} s.",
            "columns": ["document", "mutants", "accepted", "refused", "other"],
            "rows": rows,
            "passed": not everything,
        },
    )
    assert not everything, everything[:20]
