"""Controllers by public calls: each returns an object that prints, becomes JSON, and makes a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.api.verbs.simulate import Simulate
from swashplate.control.kinds import CONTROLLERS, PLAIN, ControllerKind, kind_of, load_controller, save_controller
from swashplate.errors import ControllerError, SwashError
from swashplate.json_text import as_json
from swashplate.simulation.controller import Step, StepController
from swashplate.simulation.wind import INDOOR


def told(result: Any, tmp_path: Path) -> str:
    """What a result prints; its JSON and page are made on the way."""
    assert json.loads(as_json(result.to_document()))
    page = sp.report(result, path=tmp_path / "page.html", title="A title of its own")
    assert "A title of its own" in page.read_text(encoding="utf-8")
    return repr(result)


def test_a_decoupled_autopilot_from_design_to_many_flights(tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    made = sp.decouple(coax, mode="place")
    lag = next(line for line in repr(made).splitlines() if "phase lag taken out" in line)
    assert lag.split()[-2:] == ["17.01", "deg"]
    with pytest.raises(SwashError, match="has no flown step to report"):
        sp.report(made, path=tmp_path / "page.html")
    again = sp.load_controller(made.save(tmp_path / "place.toml"))
    assert again == made.controller
    many = sp.monte_carlo(coax, again, maneuver="doublet:pitch,1s,0.1", count=8, gusts=INDOOR, seed=3)
    assert many.lost == 0
    assert "8 flights, 0 lost" in told(many, tmp_path)
    flown = Simulate(coax, "doublet:pitch,1s,0.1", controller=tmp_path / "place.toml", pilot=True).answer()
    assert np.max(np.abs(flown.truth.values("x"))) > 0.05
    assert "Flight" in told(flown, tmp_path)
    with pytest.raises(ControllerError, match="is for 'coax', not for 'conventional'"):
        sp.check_controller(sp.vehicle("raptor50"), again)


def test_a_linear_quadratic_design(tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    made = sp.design_controller("coax", method="lqr")
    assert "LQR of coax, 100 Hz" in told(made, tmp_path)
    assert kind_of(made.controller) is CONTROLLERS["lqg"]
    with pytest.raises(SwashError, match="expected one of lqg, lqr"):
        sp.design_controller(coax, method="pid")  # type: ignore[arg-type]


def test_axes_of_a_linear_model(tmp_path: Path) -> None:
    made = sp.decouple(sp.structure("hybrid"))
    assert "matrix made at 3 rad/s" in told(made, tmp_path)
    assert json.loads(made.save(tmp_path / "d.json").read_text())["kind"] == "decoupling"


class Still(StepController):
    """A controller of somebody's own: the trim's inputs, whatever happens."""

    type = "still"
    rate = 100.0
    memory = np.zeros(1)

    def __init__(self, inputs: Any) -> None:
        self.gains = np.asarray(inputs, dtype=np.float64)

    @property
    def step(self) -> Step:
        return still_step


def still_step(memory: Any, measured: Any, reference: Any, gains: Any, xp: Any) -> tuple[Any, Any]:
    return memory, gains


class StillKind(ControllerKind[Still]):
    takes_stick = False

    def to_document(self, controller: Still) -> dict[str, Any]:
        return {"kind": "controller", "type": "still", "inputs": controller.gains.tolist()}

    def from_document(self, document: dict[str, Any], path: str) -> Still:
        return Still(document["inputs"])


STILL = StillKind()


def test_a_kind_of_another_package_is_saved_and_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONTROLLERS._own, "still", f"{__name__}:STILL")
    coax = sp.vehicle("coax")
    save_controller(Still(sp.trim(coax).inputs), tmp_path / "still.toml")
    again = sp.load_controller(tmp_path / "still.toml")
    np.testing.assert_array_equal(again.gains, sp.trim(coax).inputs)
    with pytest.raises(ControllerError, match="has no C"):
        kind_of(again).traced(again)


@pytest.mark.proof
def test_a_kind_of_another_package_is_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONTROLLERS._own, "still", f"{__name__}:STILL")
    coax = sp.vehicle("coax")
    again = Still(sp.trim(coax).inputs)
    many = sp.monte_carlo(coax, again, maneuver="doublet:pitch,0.5s,0.1", count=4, battery=(12.2, 9.0))
    assert many.spread.lost_by["height"] == many.lost == 4  # nobody makes up for the battery, and it says so
    assert many.remarks


def test_a_controller_that_says_nothing_of_itself_is_plain(tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    hold = sp.hover_hold(coax, sp.trim(coax))
    assert kind_of(hold) is PLAIN
    with pytest.raises(ControllerError, match="Hold: has no file"):
        save_controller(hold, tmp_path / "hold.toml")
    (tmp_path / "other.toml").write_text('kind = "controller"\ntype = "pid"\n')
    with pytest.raises(ControllerError, match="type: is 'pid', expected ardupilot, autopilot, lqg"):
        load_controller(tmp_path / "other.toml")
