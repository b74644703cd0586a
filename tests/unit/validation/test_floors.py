"""What a score stands beside: the black box finds what can be predicted and is caught where it cheats."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.time.feedback import AxisExcitation
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation import block_bootstrap
from swashplate.validation.black_box import LEAK, NO_INPUTS, FilteredMotion, ceiling, past_and_inputs
from swashplate.validation.floors import Floor, floors
from swashplate.validation.validation import Score
from swashplate.validation.verdict import verdict

DT, HORIZON = 0.02, 0.5
AHEAD = round(HORIZON / DT)
PHI, P = PREDICTED.index("phi"), PREDICTED.index("p")
A, B, C = 3.0, 6.0, 8.0
"""Roll: p' = -A p - C phi + B u + gust."""


def _roll(
    seed: int, *, inputs: float, gust: float, feedback: float = 0.0, late: float = 0.1, seconds: float = 40.0
) -> FilteredMotion:
    """A body that only rolls, moved by independent inputs, by gusts, and by a controller that answers late."""
    rng = np.random.default_rng(seed)
    n = round(seconds / DT)
    own = np.repeat(rng.standard_normal(n // 10 + 1), 10)[:n] * inputs
    push = np.repeat(rng.standard_normal(n // 10 + 1), 10)[:n] * gust
    phi, p, u = np.zeros(n), np.zeros(n), np.zeros(n)
    for k in range(n - 1):
        seen = max(k - round(late / DT), 0)
        u[k] = own[k] - feedback * (phi[seen] + 0.3 * p[seen])
        p[k + 1] = p[k] + DT * (B * u[k] + push[k] - A * p[k] - C * phi[k])
        phi[k + 1] = phi[k] + DT * p[k + 1]
    pose = 1e-3 * rng.standard_normal((n, 6))
    pose[:, 3] += phi
    truth = 1e-3 * rng.standard_normal((n, 12))
    truth[:, PHI], truth[:, P] = phi, p
    starts = np.arange(round(1.0 / DT), n - AHEAD - 30, 5)
    return FilteredMotion(np.arange(n) * DT, u[:, None], pose, truth, starts)


def _model(record: FilteredMotion, *, gain: float) -> Array:
    """The equations from the true state at each start on, along the inputs, with their gain times `gain`."""
    phi, p = record.truth[record.starts, PHI], record.truth[record.starts, P]
    for k in range(AHEAD):
        p = p + DT * (gain * B * record.inputs[record.starts + k, 0] - A * p - C * phi)
        phi = phi + DT * p
    made = record.truth[record.starts + AHEAD].copy()
    made[:, PHI], made[:, P] = phi, p
    return made


def _floor(record: FilteredMotion, predicted: Array, *, regressors=past_and_inputs) -> Floor:  # type: ignore[no-untyped-def]
    truth, first = record.truth[record.starts + AHEAD], record.truth[record.starts]
    box = ceiling([record], HORIZON, regressors=regressors)
    found = floors(
        PREDICTED,
        HORIZON,
        [record.time[record.starts]],
        {"model": [(predicted - truth) ** 2], "hold": [(first - truth) ** 2]},
        {"model": [(truth - first) ** 2], "hold": [(truth - first) ** 2]},
        expected=np.full(12, 0.01),
        ceilings=[box],
    )
    return found[PHI]


@lru_cache(maxsize=1)
def _moved() -> FilteredMotion:
    return _roll(1, inputs=1.0, gust=0.5)


def test_the_truth_is_at_the_ceiling_and_a_spoilt_model_is_short_of_it() -> None:
    record = _moved()
    good, spoilt = (_floor(record, _model(record, gain=gain)) for gain in (1.0, -0.5))
    assert good.ceiling == spoilt.ceiling > 60.0
    assert good.reached
    assert "The model is as good as the ceiling" in good.summary_text
    assert not spoilt.reached
    assert spoilt.gap_low > 5.0
    assert spoilt.summary_text.endswith(f"The ceiling is {spoilt.ceiling:.0f} %: a better model is possible.")
    assert good.rms < 0.5 * spoilt.rms
    assert good.moved == spoilt.moved


def test_the_inputs_to_come_are_what_the_ceiling_adds_to_the_past() -> None:
    found = _floor(_moved(), _model(_moved(), gain=1.0))
    assert found.ceiling > found.past + 20.0
    assert found.low < found.fit < found.high


@pytest.mark.parametrize("seed", range(6))
def test_independent_inputs_are_no_leak(seed: int) -> None:
    box = ceiling([_roll(seed, inputs=1.0, gust=1.0)], HORIZON)
    assert box.leak is not None
    assert box.leak[PHI] < LEAK
    assert box.leak[P] < LEAK


@pytest.mark.parametrize("seed", range(3))
def test_a_controllers_answers_are_a_leak_and_the_ceiling_is_refused(seed: int) -> None:
    record = _roll(seed, inputs=0.02, gust=1.5, feedback=1.5)
    found = _floor(record, _model(record, gain=1.0))
    assert np.isnan(found.ceiling)
    assert "answer the motion" in found.refused
    assert found.leak > LEAK
    assert found.seen > found.past
    assert "No ceiling" in found.summary_text


def _peeping(record: FilteredMotion, starts: NDArray[np.intp], ahead: int, after: float) -> Array:
    return np.column_stack([past_and_inputs(record, starts, ahead, after), record.pose[starts + ahead // 2, 3]])


def _late(record: FilteredMotion, starts: NDArray[np.intp], ahead: int, after: float) -> Array:
    return past_and_inputs(record, starts, ahead + 3, after)


@pytest.mark.parametrize("cheat", [_peeping, _late])
def test_regressors_that_see_the_future_are_caught(cheat) -> None:  # type: ignore[no-untyped-def]
    found = _floor(_moved(), _model(_moved(), gain=1.0), regressors=cheat)
    assert np.isnan(found.ceiling)
    assert found.refused == "its regressors see the motion after the start"


def test_a_flight_that_nothing_moves_has_a_low_ceiling_and_says_so() -> None:
    record = _roll(2, inputs=0.0, gust=0.0)
    rng = np.random.default_rng(5)
    record.truth[:, PHI] = 1e-3 * rng.standard_normal(record.time.size)
    level = record.truth[record.starts + AHEAD] * 0.0
    found = _floor(record, level)
    assert found.ceiling < 45.0  # the mean of noise is nearer than its last value: 29 %
    assert found.reached
    assert "cannot be predicted from what was recorded: even the ceiling is a fit of" in found.summary_text


def test_a_record_that_is_too_short_has_no_ceiling_and_no_interval() -> None:
    record = _roll(3, inputs=1.0, gust=0.5, seconds=8.0)
    found = _floor(record, _model(record, gain=1.0))
    assert found.refused == "the flights are too short for it"
    assert np.isnan([found.ceiling, found.low, found.high, found.past]).all()


def test_what_the_fit_saw_may_teach_the_box() -> None:
    record, other = _moved(), _roll(9, inputs=1.0, gust=0.5)
    learnt = ceiling([record], HORIZON, training=[other])
    crossed = ceiling([record], HORIZON)
    assert (learnt.how, crossed.how) == ("the flights of the fit", "blocked cross-validation")
    errors = [np.sqrt(box.squares[0][:, PHI].mean()) for box in (learnt, crossed)]
    assert errors[0] == pytest.approx(errors[1], rel=0.2)
    wrong = FilteredMotion(other.time, -other.inputs, other.pose, other.truth, other.starts)  # another aircraft
    misled = ceiling([record], HORIZON, training=[wrong])
    assert np.sqrt(misled.squares[0][:, PHI].mean()) > 1.5 * errors[0]


def test_without_inputs_to_come_the_regression_is_blind_to_them() -> None:
    record = _moved()
    changed = FilteredMotion(record.time, record.inputs.copy(), record.pose, record.truth, record.starts)
    changed.inputs[record.starts[-1] + 1 :] += 1.0
    rows = [past_and_inputs(r, record.starts, AHEAD, NO_INPUTS) for r in (record, changed)]
    np.testing.assert_array_equal(*rows)


def _correlated(rng: np.random.Generator, n: int, seconds: float) -> Array:
    """Noise of size one that is forgotten after some time, samples 0.1 s apart."""
    keep = float(np.exp(-0.1 / seconds))
    made = rng.standard_normal(n)
    for k in range(1, n):
        made[k] = keep * made[k - 1] + np.sqrt(1.0 - keep**2) * made[k]
    return made


def test_the_interval_holds_the_truth_about_as_often_as_it_says() -> None:
    """Errors half as large as the movement, both correlated over 0.5 s, so that single starts would not do."""
    times, inside, widths = [np.arange(400) * 0.1], 0, []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        error, moved = 0.5 * _correlated(rng, 400, 0.5), _correlated(rng, 400, 0.5)
        draws = block_bootstrap.drawn(times, [np.stack([error, moved], axis=1) ** 2], horizon=0.5)
        assert draws is not None
        low, high = block_bootstrap.interval(100.0 * (1.0 - np.sqrt(draws[:, 0] / draws[:, 1])))
        inside += low < 50.0 < high
        widths.append(high - low)
    assert 49 <= inside <= 60  # 95 % of 60 is 57; ten blocks make it a little too narrow
    assert 10.0 < np.median(widths) < 30.0


def test_differences_are_judged_on_the_same_blocks() -> None:
    """Two predictors that err together: the scatter of each is much larger than that of their difference."""
    rng = np.random.default_rng(1)
    error = _correlated(rng, 400, 1.0) * (1.0 + np.arange(400) / 100.0)
    rows = np.stack([error, 1.1 * error], axis=1) ** 2
    draws = block_bootstrap.drawn([np.arange(400) * 0.1], [rows], horizon=0.5)
    assert draws is not None
    size = np.sqrt(draws)
    assert np.std(size[:, 1] - size[:, 0]) < 0.15 * np.std(size[:, 0])
    again = block_bootstrap.drawn([np.arange(400) * 0.1], [rows], horizon=0.5)
    np.testing.assert_array_equal(draws, again)


def test_a_short_flight_has_shorter_blocks_but_not_below_two_horizons() -> None:
    """Three blocks of 4 s hold the truth in 72 % of the cases, six of 2 s in 85 % (300 seeds of this)."""
    times = [np.arange(119) * 0.1]
    assert block_bootstrap.block_of(times, 1.0) == pytest.approx(2.0)
    assert block_bootstrap.block_of(times, 1.5) == pytest.approx(3.0)
    assert block_bootstrap.block_of([np.arange(400) * 0.1], 1.0) == block_bootstrap.BLOCK
    inside = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        error, moved = 0.5 * _correlated(rng, 119, 0.5), _correlated(rng, 119, 0.5)
        draws = block_bootstrap.drawn(times, [np.stack([error, moved], axis=1) ** 2], horizon=1.0)
        assert draws is not None
        low, high = block_bootstrap.interval(100.0 * (1.0 - np.sqrt(draws[:, 0] / draws[:, 1])))
        inside += low < 50.0 < high
    assert inside >= 47  # 80 %; blocks of 4 s: 43


def test_too_few_blocks_tell_no_scatter() -> None:
    rows = np.ones((100, 1))
    assert block_bootstrap.drawn([np.arange(100) * 0.1], [rows], horizon=2.0) is None
    assert np.isnan(block_bootstrap.interval(None)).all()
    assert block_bootstrap.drawn([np.arange(100) * 0.1], [rows], horizon=1.0) is not None
    both = [np.arange(100) * 0.1, np.arange(50) * 0.1]
    assert block_bootstrap.drawn(both, [rows, rows[:50]], horizon=2.0) is not None


def _beside(fit: float, reach: float) -> Floor:
    return Floor(
        "phi", "rad", 1.0, fit, fit - 4, fit + 4, 0.01, 0.02, "hold", fit, fit - 4, fit + 4, 30.0, reach,
        "blocked cross-validation", reach - fit - 4, reach - fit + 4, 1.0, reach, 5.0, "", 8.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("fit", "reach", "level", "words"),
    [
        (12.0, 14.0, "cannot be judged", "even the ceiling is a fit of 14 %"),
        (12.0, 70.0, "poor", "a better model is possible"),
        (36.0, 38.0, "usable", "even the ceiling is a fit of 38 %"),
        (72.0, 74.0, "good", "as good as the ceiling (74 %)"),
    ],
)
def test_the_verdict_says_whether_the_model_or_the_flight_is_poor(
    fit: float, reach: float, level: str, words: str
) -> None:
    scores = [Score("phi", 1.0, name, value, 0.01, 0.3, 100) for name, value in (("model", fit), ("hold", 0.0))]
    excited = AxisExcitation("a", "roll", "servo", 0.5, 0.9, 0.0, 0.1, True, "roll words.")
    (found,) = verdict(scores, [excited], [_beside(fit, reach)])
    assert found.level == level
    assert words in found.words
    assert f"[{fit - 4:.0f} to {fit + 4:.0f}]" in found.words


def test_a_loss_to_the_past_is_no_proof_against_a_model_on_commands_that_answer() -> None:
    lost = replace(_beside(12.0, 70.0), ceiling=float("nan"), past=66.0, leak=14.0, refused="inputs answer")
    assert "The past alone has a fit of 66 %; where a controller's commands answer the motion" in lost.summary_text
    assert "The model is poor" not in lost.summary_text
    assert "The model is poor: the past alone has a fit of 66 %" in replace(lost, leak=3.0).summary_text


def test_a_model_beyond_the_ceiling_is_not_told_that_its_motion_cannot_be_predicted() -> None:
    better = _beside(55.0, 39.0).summary_text
    assert "The model is better than the regression that is the ceiling (39 %)." in better
    assert "cannot be predicted" not in better
    assert "cannot be predicted" in _beside(37.0, 39.0).summary_text
