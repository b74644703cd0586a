"""The main job on the real flights: what August taught predicts July, beside the card and naive predictors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp

HORIZONS = (0.5, 1.0, 2.0)
RIVALS = ("published card", "hold", "constant rates")


@pytest.fixture(scope="module")
def fit(flight_august: Path) -> sp.Result:
    return sp.identify(sp.vehicle("coax"), sp.read(flight_august).condition(rate=100.0, cutoff=0.0))


@pytest.fixture(scope="module")
def validation(fit: sp.Result, flight_july: Path) -> sp.Validation:
    july = sp.read(flight_july).condition(rate=100.0, cutoff=0.0)
    return sp.validate(fit, july, horizons=HORIZONS)


def test_every_identified_value_is_physical(fit: sp.Result) -> None:
    assert fit.converged
    assert not fit.failed
    for estimate in fit.estimates:
        parameter = fit.model.card.parameters[estimate.name]
        assert parameter.lower is None or estimate.value >= parameter.lower
        assert parameter.upper is None or estimate.value <= parameter.upper
    values = fit.model.card.values()
    assert values["inertia_zz"] > 0.0
    # An inertia cannot exceed the sum of the other two.
    assert values["inertia_zz"] < values["inertia_xx"] + values["inertia_yy"]


def test_it_says_that_the_air_may_have_moved(fit: sp.Result) -> None:
    assert any(words.startswith("gusts of ") and "--wind" in words for words in fit.problems)


def test_the_tracked_point_is_far_from_the_centre_of_gravity(fit: sp.Result) -> None:
    """0.17 m or more to the right, as the regression of the measured accelerations says independently."""
    levers = {e.name: e.value for e in fit.constants if e.name.startswith("lever")}
    assert np.hypot(levers["lever_x"], levers["lever_y"]) == pytest.approx(0.188, abs=0.03)


@pytest.mark.parametrize("horizon", HORIZONS)
@pytest.mark.parametrize("channel", ["phi", "theta", "p", "q"])
@pytest.mark.parametrize("rival", RIVALS)
def test_the_model_predicts_attitude_and_rates_better(
    validation: sp.Validation, channel: str, horizon: float, rival: str
) -> None:
    assert validation.score(channel, horizon).fit > validation.score(channel, horizon, rival).fit


@pytest.mark.parametrize("channel", ["u", "v"])
@pytest.mark.parametrize("rival", RIVALS)
def test_the_model_predicts_velocity_better_over_half_a_second(
    validation: sp.Validation, channel: str, rival: str
) -> None:
    assert validation.score(channel, 0.5).fit > validation.score(channel, 0.5, rival).fit


def test_what_a_controller_answered_cannot_be_judged(validation: sp.Validation) -> None:
    levels = {verdict.axis: verdict.level for verdict in validation.verdict}
    assert levels["yaw"] == levels["heave"] == "cannot be judged"
    assert levels["roll"] in ("good", "usable")


@pytest.mark.proof
def test_bands_of_a_model_with_a_residual_are_judged_on_another_flight(
    flight_august: Path, flight_july: Path, tmp_path: Path
) -> None:
    """The program's own `--residual` model with draws of its own fit."""
    fit = sp.identify(
        sp.vehicle("coax"),
        [sp.read(flight_august).condition(rate=100.0)],
        free="balanced",
        horizon=(0.25, 1.0),
        residual=True,
        keep_unexcited=True,
    )
    fit.save(tmp_path / "fit.json")
    again = sp.load(tmp_path / "fit.json")
    found = sp.validate(again, [sp.read(flight_july).condition(rate=100.0)], draws=again.draw(39, seed=1))
    assert {band.channel for band in found.bands} >= {"u", "phi", "p", "r"}
    assert "do not trust the 95 % band" in str(found), "learnt in one flight, too narrow in the other"
