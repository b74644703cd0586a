"""The No-U-Turn sampler on densities whose answer is known, bounds among them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.identification.core import nuts
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.whitened import effective, evened, split_rhat, unbent, whitening

WALL = 1.5
"""Sigmas from the mean to the lower bound of the second number."""
TIED = np.array([[1.0, 0.9], [0.9, 1.0]]) * np.outer([1.0, 2.0], [1.0, 2.0])
ROW = Row(
    (
        Entry("free", "parameter", 0.0, 1.0),
        Entry("walled", "parameter", 0.0, 1.0, lower=-2.0 * WALL),
        Entry("exponential", "parameter", 0.0, 1.0, lower=0.0),
    )
)


def tied_squares(row: Array) -> tuple[float, Array]:
    """A correlated pair."""
    pull = np.linalg.solve(TIED, row[:2])
    return 0.5 * row[:2] @ pull, pull


def half_squares(row: Array) -> tuple[float, Array]:
    """The same, and a third number that is exponential above zero."""
    cost, pull = tied_squares(row)
    return cost + row[2], np.append(pull, 1.0)


def drawn(*, warmup: int, block: int, most: int) -> nuts.Chains:
    covariance = np.eye(3)
    covariance[:2, :2] = TIED
    asked: dict[str, Any] = {"chains": 3, "warmup": warmup, "block": block, "most": most, "seed": 4}
    return nuts.sample(half_squares, ROW, np.zeros(3), covariance, enough=lambda _: False, **asked)


@lru_cache(maxsize=2)
def chains(most: int = 400) -> nuts.Chains:
    return drawn(warmup=100, block=most // 2, most=most)


@pytest.mark.parametrize("most", [400, pytest.param(4000, marks=pytest.mark.proof)])
def test_the_draws_are_of_the_density_and_keep_its_bounds(most: int) -> None:
    found = chains() if most == 400 else chains(most)  # those that other tests look at
    assert found.rows.shape == (3, most, 3)
    random = np.random.default_rng(0)
    exact = random.standard_normal((400_000, 2)) @ np.linalg.cholesky(TIED).T
    exact = exact[exact[:, 1] > -2.0 * WALL]
    flat = found.rows.reshape(-1, 3)
    error = 4.0 / np.sqrt(effective(found.rows))  # four standard errors of a mean
    assert np.all(np.abs(flat[:, :2].mean(axis=0) - exact.mean(axis=0)) < error[:2] * exact.std(axis=0))
    assert abs(flat[:, 2].mean() - 1.0) < error[2]
    np.testing.assert_allclose(flat.std(axis=0), [*exact.std(axis=0), 1.0], rtol=0.15)
    assert flat[:, 1].min() > -2.0 * WALL
    assert flat[:, 2].min() > 0.0
    assert found.stats["diverging"].mean() < 0.01
    assert 0.7 < found.stats["acceptance_rate"].mean() < 0.9  # 0.8 is asked
    assert np.all(split_rhat(found.rows) < 1.02)


def test_a_covariance_that_is_wrong_is_mended_by_the_gradients() -> None:
    """A number taken for half as wide, and one for twice as wide, come out as wide as they are."""
    free = Row(tuple(Entry(name, "parameter", 0.0, 1.0) for name in ("one", "other")))
    for wrong in (1.0, np.outer([0.5, 2.0], [0.5, 2.0])):
        data = whitening(free, np.zeros(2), TIED * wrong)
        density = nuts.density_of(tied_squares, free, data)
        root = evened(data, lambda sides, density=density: [density(side).slope for side in sides])["root"]
        np.testing.assert_allclose(root @ root.T, TIED, rtol=1e-9)


def test_equal_seeds_give_equal_draws_whatever_the_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    few = {"warmup": 20, "block": 20, "most": 40}
    first = drawn(**few).rows
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    np.testing.assert_array_equal(drawn(**few).rows, first)


def test_a_place_where_no_filter_settles_is_no_draw() -> None:
    def lost(row: Array) -> tuple[float, Array]:
        if row[0] > 0.0:
            raise np.linalg.LinAlgError("the covariance does not settle")
        return tied_squares(row)

    free = Row(tuple(Entry(name, "parameter", 0.0, 1.0) for name in ("one", "other")))
    density = nuts.density_of(lost, free, whitening(free, np.zeros(2), np.eye(2)))
    assert [np.isfinite(density(np.full(2, place)).density) for place in (-1.0, 1.0)] == [True, False]


def test_chains_that_never_meet_are_told() -> None:
    apart = chains().rows + np.array([0.0, 0.5, 5.0])[:, None, None]
    assert np.all(split_rhat(apart) > 1.05)
    assert np.all(effective(apart) < effective(chains().rows))
    drifting = chains().rows + np.linspace(0.0, 5.0, 400)[None, :, None]
    assert np.all(split_rhat(drifting) > 1.05)  # only halves against halves can tell


def sloped(data: Any, place: float, step: float = 1e-6) -> tuple[Any, float, float]:
    """A bent scale at a place, its slope and that of the stretch, by differences."""
    low, high = (unbent(data, np.array([place + by])) for by in (-step, step))
    by = 2.0 * step * data["root"][0, 0]
    return unbent(data, np.array([place])), (high.row[0] - low.row[0]) / by, (high.stretch - low.stretch) / by


@pytest.mark.parametrize("bounds", [(-np.inf, np.inf), (-1.0, np.inf), (-np.inf, 2.0), (-1.0, 2.0), (-0.1, 0.2)])
def test_the_stretch_of_a_bent_scale_is_its_slope(bounds: tuple[float, float]) -> None:
    row = Row((Entry("one", "parameter", 0.0, 1.0, lower=bounds[0], upper=bounds[1]),))
    data = whitening(row, np.zeros(1), np.eye(1))
    for place in (-2.0, 0.0, 1.3):
        at, slope, bend = sloped(data, place)
        assert bounds[0] < at.row[0] < bounds[1]
        np.testing.assert_allclose(at.slope, slope, rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(at.stretch, np.log(at.slope[0]))
        np.testing.assert_allclose(at.bend, bend, atol=1e-6)


def test_the_logarithm_of_a_noise_is_as_wide_as_the_prior_where_it_is_not_seen() -> None:
    row = Row((Entry("noise", "noise", 0.0, 1.0, mean=0.0, sigma=2.0, logarithmic=True),))
    # One that a flight tells to 1 % keeps that width all the way.
    for sigma, wide in ((0.4, 2.0), (0.01, 0.01)):
        data = whitening(row, np.zeros(1), np.full((1, 1), sigma**2))
        for place, expected in ((1.0, sigma), (0.0, sigma), (-6.0, wide)):
            at, slope, bend = sloped(data, place)
            np.testing.assert_allclose(sigma * slope, expected, rtol=0.2)
            np.testing.assert_allclose(at.slope, slope, rtol=1e-5)
            np.testing.assert_allclose(at.bend, bend, rtol=1e-4, atol=1e-6)
