"""The No-U-Turn sampler on densities whose answer is known, bounds among them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from swashplate.identification.core import nuts
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.scoring import TracedCost
from swashplate.identification.core.whitened import effective, split_rhat, unbent

WALL = 1.5
"""Sigmas from the mean to the lower bound of the second number."""
TIED = np.array([[1.0, 0.9], [0.9, 1.0]])


def half_squares(plan: tuple[float, ...], data: Any, row: Any) -> Any:
    """A correlated pair, and a third that is exponential above zero."""
    away = row[:2] / jnp.array(plan)
    return 0.5 * away @ jnp.linalg.solve(data["tied"], away) + row[2]


def tied_squares(plan: tuple[float, ...], data: Any, row: Any) -> Any:
    """The correlated pair alone."""
    return half_squares(plan, data, jnp.append(row, 0.0))


PLAN = (1.0, 2.0)
ROW = Row(
    (
        Entry("free", "parameter", 0.0, 1.0),
        Entry("walled", "parameter", 0.0, 1.0, lower=-2.0 * WALL),
        Entry("exponential", "parameter", 0.0, 1.0, lower=0.0),
    )
)


def drawn(*, warmup: int, block: int, most: int) -> nuts.Chains:
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = TIED * np.outer(PLAN, PLAN)
    covariance[2, 2] = 1.0
    traced = TracedCost(half_squares, PLAN, {"tied": TIED})
    asked: dict[str, Any] = {"chains": 3, "warmup": warmup, "block": block, "most": most, "seed": 4}
    return nuts.sample(traced, ROW, np.zeros(3), covariance, enough=lambda _: False, **asked)


@lru_cache(maxsize=2)
def chains(most: int = 400) -> nuts.Chains:
    return drawn(warmup=100, block=most // 2, most=most)


@pytest.mark.parametrize("most", [400, pytest.param(800, marks=pytest.mark.proof)])
def test_the_draws_are_of_the_density_and_keep_its_bounds(most: int) -> None:
    found = chains() if most == 400 else chains(most)  # those that other tests look at
    assert found.rows.shape == (3, most, 3)
    random = np.random.default_rng(0)
    exact = random.standard_normal((400_000, 2)) @ np.linalg.cholesky(TIED * np.outer(PLAN, PLAN)).T
    exact = exact[exact[:, 1] > -2.0 * WALL]
    flat = found.rows.reshape(-1, 3)
    error = 4.0 / np.sqrt(effective(found.rows))  # four standard errors of a mean
    assert np.all(np.abs(flat[:, :2].mean(axis=0) - exact.mean(axis=0)) < error[:2] * exact.std(axis=0))
    assert abs(flat[:, 2].mean() - 1.0) < error[2]
    np.testing.assert_allclose(flat.std(axis=0), [*exact.std(axis=0), 1.0], rtol=0.15)
    assert flat[:, 1].min() > -2.0 * WALL
    assert flat[:, 2].min() > 0.0
    assert found.stats["diverging"].mean() < 0.01
    assert np.all(split_rhat(found.rows) < 1.02)


def test_a_covariance_that_is_wrong_is_mended_by_the_gradients() -> None:
    """A number taken for half as wide, and one for twice as wide, come out as wide as they are."""
    free = Row(tuple(Entry(name, "parameter", 0.0, 1.0) for name in ("one", "other")))
    true = TIED * np.outer(PLAN, PLAN)
    wrong = true * np.outer([0.5, 2.0], [0.5, 2.0])
    traced = TracedCost(tied_squares, PLAN, {"tied": TIED})
    with ThreadPoolExecutor(1) as pool:
        for covariance in (true, wrong):
            target = (traced.function, PLAN, nuts._prepared(traced, free, np.zeros(2), covariance))
            root = np.asarray(nuts._evened(target, pool)[2]["root"])
            np.testing.assert_allclose(root @ root.T, true, rtol=1e-9)


def test_equal_seeds_give_equal_draws_whatever_the_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    few = {"warmup": 20, "block": 20, "most": 40}
    first = drawn(**few).rows
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    np.testing.assert_array_equal(drawn(**few).rows, first)


def test_chains_that_never_meet_are_told() -> None:
    apart = chains().rows + np.array([0.0, 0.5, 5.0])[:, None, None]
    assert np.all(split_rhat(apart) > 1.05)
    assert np.all(effective(apart) < effective(chains().rows))
    drifting = chains().rows + np.linspace(0.0, 5.0, 400)[None, :, None]
    assert np.all(split_rhat(drifting) > 1.05)  # only halves against halves can tell


@jax.jit
def bent(data: Any, z: jax.Array) -> tuple[Any, Any, Any]:
    """The number at a place on the bent scale, the logarithm of the stretch, and the slope."""
    value, stretch = unbent(data, z, jnp)
    return value, stretch, jax.jacfwd(lambda z: unbent(data, z, jnp)[0][0])(z)


@pytest.mark.parametrize("bounds", [(-np.inf, np.inf), (-1.0, np.inf), (-np.inf, 2.0), (-1.0, 2.0), (-0.1, 0.2)])
def test_the_stretch_of_a_bent_scale_is_its_slope(bounds: tuple[float, float]) -> None:
    row = Row((Entry("one", "parameter", 0.0, 1.0, lower=bounds[0], upper=bounds[1]),))
    data = nuts._prepared(TracedCost(half_squares, (), {}), row, np.zeros(1), np.eye(1))
    for place in (-2.0, 0.0, 1.3):
        (value,), stretch, (slope,) = bent(data, jnp.array([place]))
        assert bounds[0] < value < bounds[1]
        np.testing.assert_allclose(stretch, np.log(slope), atol=1e-6)  # near one, 1 - sigmoid has few digits left


def test_the_logarithm_of_a_noise_is_as_wide_as_the_prior_where_it_is_not_seen() -> None:
    row = Row((Entry("noise", "noise", 0.0, 1.0, mean=0.0, sigma=2.0, logarithmic=True),))
    # One that a flight tells to 1 % keeps that width all the way.
    for sigma, wide in ((0.4, 2.0), (0.01, 0.01)):
        data = nuts._prepared(TracedCost(half_squares, (), {}), row, np.zeros(1), np.full((1, 1), sigma**2))
        for place, expected in ((1.0, sigma), (0.0, sigma), (-6.0, wide)):
            _, stretch, slope = bent(data, jnp.array([place]))
            np.testing.assert_allclose(slope, [expected], rtol=0.2)
            np.testing.assert_allclose(stretch, np.log(slope[0] / sigma), rtol=1e-6, atol=1e-9)
