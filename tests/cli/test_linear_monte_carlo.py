"""`swash simulate --monte-carlo` on identified linear models: what is drawn, and what such a model cannot fly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commands import swash

import swashplate as sp
from made_results import result
from swashplate.control.draws.variations import draw_models, entries_of, vary_parameters
from swashplate.errors import ControllerError
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure


def fit_of(path: Path, model: StateSpaceModel | None = None, free: tuple[str, str] = ("Lb", "Ma")) -> Path:
    """A fit.json as `swash fit-ss` writes it, of two parameters that are nearly one."""
    model = model or structure("thirteen_state")
    values = {name: model.parameters[name].value for name in free}
    sigma = np.array([0.05 * value for value in values.values()])
    covariance = np.array([[1.0, 0.95], [0.95, 1.0]]) * np.outer(sigma, sigma)
    return result(model, values, covariance).save(path)


def test_draws_keep_the_fits_correlation_and_ties_follow(tmp_path: Path) -> None:
    model = structure("thirteen_state")
    drawn = draw_models(model, fit_of(tmp_path / "fit.json"), count=400, seed=1)
    assert np.corrcoef(drawn["Lb"], drawn["Ma"])[0, 1] == pytest.approx(0.95, abs=0.02)
    assert np.std(drawn["Lb"]) == pytest.approx(0.05 * 166.0, rel=0.1)
    both = vary_parameters(model, {"tau_f": 0.02}, count=400, seed=2, about=drawn)
    few = {name: values[:5] for name, values in both.items()}
    entries = entries_of(model, few, count=5)
    np.testing.assert_allclose(entries["p_by_b"], few["Lb"])
    A = model.with_values({name: float(values[3]) for name, values in few.items()}).explicit()[0]
    a, q = model.states.index("a"), model.states.index("q")
    assert entries["a_by_q"][3] == pytest.approx(A[a, q])
    with pytest.raises(ControllerError, match=r"is of another model: .* has no Lp, Mq"):
        draw_models(model, fit_of(tmp_path / "fit.json", structure("six_dof"), ("Lp", "Mq")), count=2, seed=1)


OBSERVED = ("--sensors", "gyro@50,mocap@50", "--gain", "steady")


@pytest.mark.parametrize("law", [("--method", "lqr"), pytest.param(OBSERVED, marks=pytest.mark.proof)])
def test_linear_models_are_flown_in_many_versions(law: tuple[str, ...], tmp_path: Path) -> None:
    controller, worst = tmp_path / "linear.toml", tmp_path / "worst.nc"
    design = ("control", "design", "thirteen_state", *law, "--rate", "50")
    assert swash(*design, "--out", controller, "--quiet").code == 0
    fly = ("control", "monte-carlo", "--vehicle", "thirteen_state", "--controller", controller, "--out", worst)
    many = (*fly, "--maneuver", "doublet:lateral,0.5s,0.1", "--count", "5")
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
        (("--settings", "tolerances=true"), "has a standard deviation (cramer_rao)"),
        (("--vary", "Mq=5%"), "Mq: is no parameter of the model"),
        (("--fit", worst), "is no text file, expected JSON. `swash identify"),
    ):
        refused = swash(*many, *options)
        assert refused.code == 2
        assert said in refused.err
