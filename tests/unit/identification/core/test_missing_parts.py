"""Parts that a model leaves out: their step, the bound that holds it, and words where the errors show one."""

from __future__ import annotations

import numpy as np

from swashplate.identification.core.missing_parts import MissingParts, Shifts, shifts_by

NONE = np.zeros((2, 2))


def step_of(random: np.random.Generator, size: float) -> tuple[np.ndarray, np.ndarray, Shifts]:
    """A regression of two numbers (truth 0) without a part of some size: their error, plain bound and the step."""
    S = random.standard_normal((2, 2000, 1))
    Z = 0.05 * (0.8 * S[:1] + 0.6 * random.standard_normal((1, 2000, 1)))  # 2 sigmas of a part that is seen alone
    white = random.standard_normal((2000, 1)) + size * Z[0]
    bound = np.linalg.inv(np.einsum("pnm,qnm->pq", S, S))
    error = -bound @ np.einsum("pnm,nm->p", S, white)  # slopes are of the errors: measured less foretold
    left = white + np.einsum("pnm,p->nm", S, error)
    return error, bound, shifts_by(MissingParts(("a lag",), (Z,)), bound, NONE, [left], [S], lags=50)


def test_the_mean_square_about_the_estimate_is_what_the_bound_says() -> None:
    random = np.random.default_rng(1)
    steps = [step_of(random, random.standard_normal()) for _ in range(400)]
    square = np.mean([error[0] ** 2 for error, _, _ in steps])
    held = np.mean([shifts.mean_square[0, 0] for _, _, shifts in steps])
    plain = np.mean([bound[0, 0] for _, bound, _ in steps])
    assert 0.75 < square / held < 1.25
    assert square > 2.0 * plain


def test_a_part_that_is_not_there_raises_no_alarm_and_one_that_is_large_does() -> None:
    def told(size: float, seeds: range) -> float:
        every = []
        for seed in seeds:
            _, bound, shifts = step_of(np.random.default_rng(seed), size)
            words = shifts.warnings(("a", "b"), np.arange(2), np.diag(bound))
            every.append(bool(words) and "a lag (" in words[0] and "a by " in words[0] and "b by" not in words[0])
        return float(np.mean(every))

    assert told(0.0, range(200)) <= 0.02
    assert told(6.0, range(20)) >= 0.9


def test_the_step_is_that_of_the_larger_regression() -> None:
    random = np.random.default_rng(2)
    S, Z = random.standard_normal((2, 2, 500, 1)), random.standard_normal((2, 1, 500, 1)) / 20.0
    errors = random.standard_normal((2, 500, 1)) + 3.0 * Z[:, 0]
    flat = np.concatenate([np.concatenate([s, z]).reshape(3, -1) for s, z in zip(S, Z, strict=True)], axis=1)
    bound = np.linalg.inv(flat[:2] @ flat[:2].T)
    alone = -bound @ flat[:2] @ errors.ravel()
    larger = -np.linalg.solve(flat @ flat.T + np.diag([0.0, 0.0, 1.0]), flat @ errors.ravel())
    left = list(errors + np.einsum("rpnm,p->rnm", S, alone))
    shifts = shifts_by(MissingParts(("a lag",), tuple(Z)), bound, NONE, left, list(S), lags=50)
    np.testing.assert_allclose(alone + shifts.by_part[:, 0], larger[:2], rtol=1e-9)
