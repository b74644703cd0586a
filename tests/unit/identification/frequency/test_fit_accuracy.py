"""Bounds of fits to responses: against the scatter of many fits, and what they say where they know nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from swashplate.arrays import Array, Complex
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.frequency.fit_accuracy import NO_ERRORS, NOT_SHARED, FitAccuracy, accuracy_of_fit
from swashplate.identification.frequency.response_cost import ResponseCost, Target
from swashplate.identification.responses.shared_errors import ErrorParts, correlation_of_errors

OMEGA = np.geomspace(1.0, 30.0, 20)
TRUTH = {"K": 8.0, "pole": 4.0, "K2": 3.0}
ERROR = 0.05


def outputs(numbers: Array) -> tuple[list[Complex], list[Complex]]:
    """K / (s + pole) and K2 / (s + pole), and the slopes of their logarithms."""
    gain, pole, second = numbers
    below = 1.0 / (1j * OMEGA + pole)
    nothing = np.zeros(OMEGA.size, dtype=np.complex128)
    answers = [gain * below, second * below]
    slopes = [
        np.stack([nothing + 1.0 / gain, -below, nothing], 1),
        np.stack([nothing, -below, nothing + 1 / second], 1),
    ]
    return answers, slopes


def parts(together: float) -> list[ErrorParts]:
    """Two outputs of which the noise has this coherency, a quarter of a turn apart."""
    root = np.linalg.cholesky(np.array([[1.0, -1j * together], [1j * together, 1.0]]))
    one = np.ones((OMEGA.size, 1), dtype=np.complex128)
    return [ErrorParts(one * root[k], one, np.full(OMEGA.size, 2.0)) for k in range(2)]


def fitted(
    shared: Sequence[ErrorParts | None], *, seed: int, truth_shared: Sequence[ErrorParts], size: float = ERROR
) -> tuple[Array, FitAccuracy]:
    """One fit to responses with errors of this kind: how far it ends from the truth, and what it says."""
    random = np.random.default_rng(seed)
    exact = outputs(np.array(list(TRUTH.values())))[0]
    n = OMEGA.size
    root = np.linalg.cholesky(correlation_of_errors([OMEGA] * 2, truth_shared) + 1e-9 * np.eye(2 * n))
    unit = root @ (random.standard_normal(2 * n) + 1j * random.standard_normal(2 * n))
    errors = [size * part * np.exp(-1j * np.angle(h)) for part, h in zip(np.split(unit, 2), exact, strict=True)]
    targets = [
        Target(f"y{k}", "u", OMEGA, h * (1.0 + e), np.full(n, 0.9), error=np.full(n, ERROR), shared=own)
        for k, (h, e, own) in enumerate(zip(exact, errors, shared, strict=True))
    ]
    row = Row(tuple(Entry(name, "parameter", value, value) for name, value in TRUTH.items()))
    cost = ResponseCost(row, targets, outputs)
    at = row.starts()
    for _ in range(4):
        residual, slopes = cost.residuals(at)
        at = at - np.linalg.lstsq(slopes, residual, rcond=None)[0]
    return at * row.scale - np.array(list(TRUTH.values())), accuracy_of_fit(cost, at)


def scatter(shared: Sequence[ErrorParts | None], truth_shared: Sequence[ErrorParts], **how: float) -> Array:
    """Root mean square of errors over their bounds, 200 fits."""
    distances = []
    for seed in range(200):
        error, told = fitted(shared, seed=seed, truth_shared=truth_shared, **how)
        distances.append(error / told.sigma)
    return np.sqrt(np.mean(np.square(distances), axis=0))


@pytest.mark.parametrize("size", [ERROR, 2.0 * ERROR])
def test_errors_that_go_together_scatter_the_fit_as_told(size: float) -> None:
    np.testing.assert_allclose(scatter(parts(0.9), parts(0.9), size=size), 1.0, atol=0.15)


def test_bounds_that_take_each_response_and_line_alone_are_too_narrow() -> None:
    """The mutation: what this module does for, left out."""
    assert np.max(scatter([None, None], parts(0.9))) > 1.4


def test_a_response_beyond_its_errors_counts_by_itself() -> None:
    """The first response is right; the second misses the common pole by half, which no gain makes up for."""
    exact = outputs(np.array([8.0, 4.0, 3.0]))[0]
    other = outputs(np.array([8.0, 9.0, 3.0]))[0][1]
    told = []
    for second in (exact[1], other):
        random = np.random.default_rng(2)
        noise = 1.0 + ERROR * (random.standard_normal((2, OMEGA.size)) + 1j * random.standard_normal((2, OMEGA.size)))
        targets = [
            Target("y", "u", OMEGA, h * e, np.full(OMEGA.size, 0.9), error=np.full(OMEGA.size, ERROR), shared=own)
            for h, e, own in zip((exact[0], second), noise, parts(0.0), strict=True)
        ]
        row = Row(tuple(Entry(name, "parameter", value, value) for name, value in TRUTH.items()))
        told.append(accuracy_of_fit(ResponseCost(row, targets, outputs), row.starts()))
    good, bad = told
    np.testing.assert_allclose(good.misfit, 1.0, atol=0.5)
    assert bad.misfit[1] > 5.0 * good.misfit[1]
    assert bad.misfit[0] == pytest.approx(good.misfit[0], rel=0.1)
    assert bad.sigma[2] > 2.0 * good.sigma[2]
    assert bad.sigma[0] < bad.sigma[2] * TRUTH["K"] / TRUTH["K2"], "the gain of the response that is met"


def test_what_leaves_no_trace_is_infinite_and_what_is_seen_only_together_is_huge() -> None:
    def evaluate(numbers: Array) -> tuple[list[Complex], list[Complex]]:
        """Only a product is seen, and the third number nowhere."""
        first, second, _ = numbers
        answer = first * second / (1j * OMEGA + 4.0)
        one = np.ones(OMEGA.size, dtype=np.complex128)
        return [answer], [np.stack([one / first, one / second, 0.0 * one], axis=1)]

    target = Target(
        "y", "u", OMEGA, evaluate(np.array([2.0, 4.0, 1.0]))[0][0], np.full(20, 0.9), error=np.full(20, 0.05)
    )
    row = Row(tuple(Entry(name, "parameter", value, value) for name, value in zip("abc", (2.0, 4.0, 1.0), strict=True)))
    told = accuracy_of_fit(ResponseCost(row, [target], evaluate), row.starts())
    assert told.sigma[2] == np.inf
    assert np.all(told.sigma[:2] > 1e3)
    assert told.correlation[0, 1] == pytest.approx(-1.0, abs=1e-6)
    assert np.all(told.insensitivity[:2] < 1.0), "each alone would be told"


def test_a_ceiling_tells_no_number() -> None:
    """A response that was not seen says what a gain is not; the gain itself stays untold."""
    exact = outputs(np.array([8.0, 4.0, 3.0]))[0]
    seen = Target("y", "u", OMEGA, exact[0], np.full(20, 0.9), error=np.full(20, ERROR), shared=parts(0.0)[0])
    above = Target("z", "u", OMEGA, 0.5 * np.abs(exact[1]) + 0j, np.ones(20), ceiling=True)
    row = Row(tuple(Entry(name, "parameter", value, value) for name, value in TRUTH.items()))
    told = accuracy_of_fit(ResponseCost(row, [seen, above], outputs), row.starts())
    assert np.isfinite(told.sigma[:2]).all()
    assert told.sigma[2] == np.inf


def test_it_says_what_the_responses_do_not_tell() -> None:
    _, known = fitted(parts(0.5), seed=0, truth_shared=parts(0.5))
    assert known.warnings == ()
    _, unknown = fitted([None, None], seed=0, truth_shared=parts(0.5))
    assert unknown.warnings == (NOT_SHARED,)
    exact = outputs(np.array([8.0, 4.0, 3.0]))[0]
    row = Row(tuple(Entry(name, "parameter", value, value) for name, value in TRUTH.items()))
    wide, narrow = (
        accuracy_of_fit(
            ResponseCost(
                row,
                [Target("y", "u", OMEGA, h * np.exp(miss * np.sin(OMEGA)), np.full(20, 0.9)) for h in exact],
                outputs,
            ),
            row.starts(),
        )
        for miss in (0.1, 0.01)
    )
    assert wide.warnings == narrow.warnings == (NO_ERRORS,)
    np.testing.assert_allclose(wide.sigma / narrow.sigma, 10.0, rtol=1e-6)
