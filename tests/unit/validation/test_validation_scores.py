"""Fit, Theil's coefficient, innovations and verdicts on numbers whose answer can be said beforehand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import multivariate_normal

from swashplate.identification.time.feedback import AxisExcitation
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation.bands import Band
from swashplate.validation.prediction import naive
from swashplate.validation.validation import (
    AxisVerdict,
    Score,
    check_innovations,
    fit_percent,
    log_likelihood,
    rms,
    theil,
)
from swashplate.validation.verdict import THRESHOLDS, in_brief, verdict

RNG = np.random.default_rng(1)
START = RNG.standard_normal((500, 3)) + 7.0
TRUTH = START + RNG.standard_normal((500, 3)) * [1.0, 0.1, 10.0]


def test_holding_the_last_value_scores_nothing_and_the_truth_everything() -> None:
    np.testing.assert_allclose(fit_percent(START, TRUTH, START), 0.0, atol=1e-12)
    np.testing.assert_allclose(fit_percent(TRUTH, TRUTH, START), 100.0)
    np.testing.assert_allclose(theil(START, TRUTH, START), 1.0)
    np.testing.assert_allclose(theil(TRUTH, TRUTH, START), 0.0)


@pytest.mark.parametrize("share", [0.25, 0.5, 0.9])
def test_a_prediction_of_part_of_the_change_scores_that_part(share: float) -> None:
    """100 share %, and Theil's coefficient (1 - share) / (1 + share): whatever the level and the unit."""
    predicted = START + share * (TRUTH - START)
    np.testing.assert_allclose(fit_percent(predicted, TRUTH, START), 100.0 * share)
    np.testing.assert_allclose(theil(predicted, TRUTH, START), (1.0 - share) / (1.0 + share))


def test_the_opposite_change_is_worse_than_nothing() -> None:
    opposite = START - (TRUTH - START)
    np.testing.assert_allclose(fit_percent(opposite, TRUTH, START), -100.0)
    np.testing.assert_allclose(theil(opposite, TRUTH, START), 1.0)
    np.testing.assert_allclose(rms(opposite - TRUTH), 2.0 * rms(TRUTH - START))


def test_naive_predictors_are_a_hold_and_a_screw() -> None:
    states = np.zeros((3, 12))
    states[1] = [1.0, 2.0, -3.0, 0.5, 0.1, -0.2, 0.0, 0.0, 3.0, 0.0, 0.0, 0.8]
    starts = np.array([1])
    np.testing.assert_array_equal(naive(states, starts, 50, 0.01, kind="hold"), states[1:2])
    (moved,) = naive(states, starts, 50, 0.01, kind="rates")
    forward = Rotation.from_euler("Z", 3.0).apply([0.5, 0.1, -0.2])
    np.testing.assert_allclose(moved[:3], states[1, :3] + 0.5 * forward, atol=1e-12)
    np.testing.assert_array_equal(moved[3:6], states[1, 3:6])
    assert moved[PREDICTED.index("psi")] == pytest.approx(3.4)  # past half a turn without a jump
    np.testing.assert_array_equal(moved[9:], states[1, 9:])


def test_the_likelihood_is_scipys() -> None:
    rng = np.random.default_rng(2)
    root = rng.standard_normal((3, 3))
    covariance = root @ root.T
    sample = rng.standard_normal((200, 3))
    expected = np.mean(multivariate_normal(np.zeros(3), covariance).logpdf(sample))
    assert log_likelihood(sample, covariance) == pytest.approx(expected, rel=1e-12)


def test_honest_white_innovations_pass_and_others_are_told_apart() -> None:
    rng = np.random.default_rng(3)
    white = rng.standard_normal((4000, 3)) * [1.0, 2.0, 0.01]
    slow = white.copy()
    for k in range(1, 4000):
        slow[k, 1] = 0.6 * slow[k - 1, 1] + 0.8 * white[k, 1]
    honest, coloured, large = check_innovations(slow, np.diag([1.0, 4.0, 1e-4 / 9.0]), ("x", "psi", "z"))
    assert (honest.channel, coloured.channel, large.channel) == ("x", "psi", "z")
    assert honest.consistency == pytest.approx(1.0, abs=0.1)
    assert honest.whiteness < 1.5 * honest.whiteness_bound
    assert coloured.whiteness == pytest.approx(0.6, abs=0.05)
    assert coloured.whiteness_bound == pytest.approx(2.576 / np.sqrt(4000))
    assert large.consistency == pytest.approx(9.0, rel=0.1)
    assert (large.rms, large.expected) == (pytest.approx(0.01, rel=0.05), pytest.approx(0.01 / 3.0))


def _scores(**fits: dict[str, float]) -> list[Score]:
    """Scores at every horizon; `fits` by channel and predictor."""
    return [
        Score(channel, horizon, predictor.replace("_", " "), fit, 0.1, 0.3, 100)
        for channel, by in fits.items()
        for predictor, fit in by.items()
        for horizon in (0.5, 1.0)
    ]


def _excited(axis: str, *, identifiable: bool) -> AxisExcitation:
    return AxisExcitation("a", axis, "servo", 0.5, 0.9, 0.0, 0.1, identifiable, f"{axis} words.")


@pytest.mark.parametrize(
    ("model", "level"),
    [
        ((70.0, 55.0), "good"),
        ((70.0, THRESHOLDS["good"]), "good"),
        ((70.0, THRESHOLDS["good"] - 0.1), "usable"),
        ((70.0, THRESHOLDS["usable"] - 0.1), "poor"),
        ((10.0, 55.0), "poor"),
    ],
)
def test_an_axis_is_as_good_as_its_worst_channel(model: tuple[float, float], level: str) -> None:
    rival = {"hold": 0.0, "published_card": 5.0}
    scores = _scores(phi={"model": model[0], **rival}, p={"model": model[1], **rival})
    (found,) = verdict(scores, [_excited("roll", identifiable=True)])
    assert (found.axis, found.level) == ("roll", level)
    assert f"phi {model[0]:.0f} % (best rival 5 %)" in found.words


def test_a_model_that_a_rival_beats_is_poor_however_well_it_scores() -> None:
    scores = _scores(
        theta={"model": 90.0, "published_card": 91.0, "hold": 0.0}, q={"model": 80.0, "published_card": 20.0}
    )
    (found,) = verdict(scores, [_excited("pitch", identifiable=True)])
    assert found.level == "poor"
    assert found.words.endswith("Beaten in theta.")


@pytest.mark.parametrize(("held", "ahead", "told"), [(60.0, 0.5, True), (94.0, 0.5, False), (60.0, 2.0, False)])
def test_a_verdict_says_of_its_axis_that_the_band_is_too_narrow(held: float, ahead: float, told: bool) -> None:
    """However well the axis is predicted, and whether draws were given or not; other horizons are no part of it."""
    scores = _scores(psi={"model": 80.0, "hold": 0.0}, r={"model": 80.0, "hold": 0.0})
    band = Band("r", "rad/s", ahead, 95.0, held, held - 3.0, held + 3.0, 0.3, 0.0, 200, 2.8)
    (found,) = verdict(scores, [_excited("yaw", identifiable=True)], bands=[band])
    assert found.level == "good"
    assert (band.warning != "" and band.warning in found.words) == told


def test_an_axis_that_no_record_moves_cannot_be_judged_and_one_that_any_moves_can() -> None:
    scores = _scores(psi={"model": 99.0, "hold": 0.0}, r={"model": 99.0, "hold": 0.0})
    (found,) = verdict(scores, [_excited("yaw", identifiable=False)])
    assert found.level == "cannot be judged"
    assert "psi 99 %" in found.words
    assert found.words.endswith("yaw words.")
    (found,) = verdict(scores, [_excited("yaw", identifiable=False), _excited("yaw", identifiable=True)])
    assert found.level == "good"
    assert verdict([], []) == ()


def test_the_verdict_in_brief_names_every_axis_under_its_level() -> None:
    levels = (("roll", "good"), ("pitch", "cannot be judged"), ("horizontal", "good"), ("yaw", "poor"))
    judged = [AxisVerdict(axis, level, "") for axis, level in levels]
    assert in_brief(judged) == "good: roll, horizontal; poor: yaw; cannot be judged: pitch"
    assert in_brief(judged[:1]) == "good: roll"
