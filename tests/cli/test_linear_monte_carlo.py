"""`swash simulate --monte-carlo` on identified linear models: what is drawn, and what such a model cannot fly."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import swash

import swashplate as sp
from swashplate.control.linear_draws import draw_parameters, entries_of, vary_parameters
from swashplate.errors import ControllerError
from swashplate.identification.state_space_file import structure


def fit_of(path: Path, **changes: object) -> Path:
    """A fit.json as `swash fit-ss` writes it, of two parameters that are nearly one."""
    model = structure("thirteen_state")
    free = ("Lb", "Ma")
    document = {
        "kind": "state-space-fit",
        "model": model.name,
        "free": list(free),
        "correlation": [[1.0, 0.95], [0.95, 1.0]],
        "parameters": [
            {"name": n, "value": model.parameters[n].value, "cramer_rao": 0.05 * model.parameters[n].value}
            for n in free
        ],
    }
    path.write_text(json.dumps(document | changes))
    return path


def test_draws_keep_the_fits_correlation_and_ties_follow(tmp_path: Path) -> None:
    model = structure("thirteen_state")
    drawn = draw_parameters(model, fit_of(tmp_path / "fit.json"), count=400, seed=1)
    assert np.corrcoef(drawn["Lb"], drawn["Ma"])[0, 1] == pytest.approx(0.95, abs=0.02)
    assert np.std(drawn["Lb"]) == pytest.approx(0.05 * 166.0, rel=0.1)
    both = vary_parameters(model, {"tau_f": 0.02}, count=400, seed=2, about=drawn)
    few = {name: values[:5] for name, values in both.items()}
    entries = entries_of(model, few, count=5)
    np.testing.assert_allclose(entries["p_by_b"], few["Lb"])
    A = model.with_values({name: float(values[3]) for name, values in few.items()}).explicit()[0]
    a, q = model.states.index("a"), model.states.index("q")
    assert entries["a_by_q"][3] == pytest.approx(A[a, q])
    with pytest.raises(ControllerError, match=r"is of another model: .* has no Mq"):
        draw_parameters(model, fit_of(tmp_path / "fit.json", free=["Mq"]), count=2, seed=1)
    with pytest.raises(ControllerError, match="found 'time-fit', expected 'state-space-fit'"):
        draw_parameters(model, fit_of(tmp_path / "fit.json", kind="time-fit"), count=2, seed=1)


def test_linear_models_are_flown_in_many_versions(tmp_path: Path) -> None:
    controller, worst = tmp_path / "linear.toml", tmp_path / "worst.nc"
    design = ("control", "design", "thirteen_state", "--sensors", "gyro@50,mocap@50", "--rate", "50")
    assert swash(*design, "--gain", "steady", "--out", controller, "--quiet").code == 0
    fly = ("simulate", "--vehicle", "thirteen_state", "--controller", controller, "--out", worst)
    many = (*fly, "--maneuver", "doublet:lateral,0.5s,0.1", "--monte-carlo", "5")
    outcome = swash(*many, "--fit", fit_of(tmp_path / "fit.json"), "--vary", "Xu=20%")
    assert outcome.code == 0, outcome.err
    assert "5 flights, 0 lost" in outcome.out
    assert "the maneuver moves its inputs" in outcome.err
    flight = sp.read(worst)
    assert 0.05 < np.max(np.abs(flight.values("lateral"))) < 1.0
    drawn = next(step for step in flight.history if step.operation == "drawn").details["parameters"]
    assert drawn["p_by_b"] != pytest.approx(166.0, rel=1e-4)
    assert drawn["u_by_u"] != pytest.approx(-0.05, rel=1e-4)
    for options, said in (
        (("--gusts", "indoor", "--payload", "0.1"), "--gusts, --payload: a linear model has no equations for wind"),
        (("--tolerances",), "no number of the file has a Cramér-Rao bound"),
        (("--vary", "Mq=5%"), "Mq: is no parameter of the model"),
        (("--fit", worst), "cannot be read as a fit"),
    ):
        refused = swash(*many, *options)
        assert refused.code == 2
        assert said in refused.err
