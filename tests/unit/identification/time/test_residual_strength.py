"""The ridge of a residual: by blocks left out, with physics that moves beside it."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.identification.time import residual_ahead
from swashplate.identification.time.residual_ahead import ALONE, LeftOutBlock, Physics, chosen_strength, shrunk

K = 20
"""Coefficients."""


def blocks(
    truth: Array, *, seed: int, at: Array | None = None, samples: int = 300, number: int = 8
) -> list[LeftOutBlock]:
    """Blocks of white errors that a linear residual with these coefficients explains: e = X c + noise."""
    rng = np.random.default_rng(seed)
    place = np.zeros(K) if at is None else at
    made = []
    for _ in range(number):
        X = rng.standard_normal((samples, K))
        y = X @ truth + rng.standard_normal(samples)
        off = X @ place - y
        made.append(LeftOutBlock(0.5 * float(y @ y), place, 0.5 * float(off @ off), X.T @ off, X.T @ X))
    return made


def test_a_known_residual_is_recovered() -> None:
    truth = np.where(np.arange(K) < 4, 0.5, 0.0)
    told = blocks(truth, seed=1)
    strength, gain, error = chosen_strength(told)
    assert np.isfinite(strength)
    assert gain > 5.0 * error
    found, covariance = shrunk(told, strength)
    assert np.max(np.abs(found - truth) / np.sqrt(np.diag(covariance))) < 4.0


def test_the_place_about_which_the_cost_is_told_does_not_matter() -> None:
    truth = np.linspace(-0.5, 0.5, K)
    here, there = (blocks(truth, seed=2, at=at) for at in (None, np.full(K, 0.3)))
    assert chosen_strength(here) == pytest.approx(chosen_strength(there))
    np.testing.assert_allclose(shrunk(here, 3.0)[0], shrunk(there, 3.0)[0], atol=1e-9)
    assert here[0].gain(truth) == pytest.approx(there[0].gain(truth))


def kept_of_white_errors(seeds: int = 40) -> int:
    return sum(np.isfinite(chosen_strength(blocks(np.zeros(K), seed=seed))[0]) for seed in range(seeds))


def test_of_white_errors_nothing_is_kept() -> None:
    assert kept_of_white_errors() <= 2  # of forty: two standard errors


def test_gains_on_the_blocks_that_were_learnt_from_would_keep_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mutation: where nothing is left out, white errors seem to be worth a residual."""
    kept = 0
    for seed in range(10):
        told = blocks(np.zeros(K), seed=seed)
        monkeypatch.setattr(residual_ahead, "shrunk", lambda _, strength, physics, told=told: shrunk(told, strength))
        kept += np.isfinite(chosen_strength(told)[0])
    assert kept >= 5  # against one in twenty


def test_physics_gives_back_what_it_took_over() -> None:
    """Errors y = P p + X c: told about the p that fits best without c, which leans towards the missing part."""
    rng = np.random.default_rng(3)
    told, parts = [], []
    for _ in range(8):
        x, other, noise = rng.standard_normal((3, 300))
        parts.append((np.stack([x + 0.3 * other, x], axis=1), noise))  # nearly one direction
    truth = np.array([1.0, 0.8])
    every, errors = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    alone = np.linalg.lstsq(every[:, :1], every @ truth + errors, rcond=None)[0]
    for X, noise in parts:
        off = X[:, :1] @ alone - X @ truth - noise
        told.append(LeftOutBlock(0.5 * float(off @ off), np.zeros(2), 0.5 * float(off @ off), X.T @ off, X.T @ X))
    physics = Physics(np.zeros(1), np.zeros((1, 1)))
    strength, gain, error = chosen_strength(told, physics)
    assert np.isfinite(strength)
    assert gain > error
    away, covariance = shrunk(told, strength, physics)
    assert np.all(np.abs(np.concatenate([alone, [0.0]]) + away - truth) < 4.0 * np.sqrt(np.diag(covariance)))
    assert shrunk(told, np.inf, physics)[0] == pytest.approx(0.0, abs=1e-9)  # alone it stands where it did
    held = [LeftOutBlock(b.start, b.at[1:], b.cost, b.gradient[1:], b.information[1:, 1:]) for b in told]
    assert abs(shrunk(held, strength)[0][0]) < 0.2  # the mutation: of 0.8


def test_priors_of_the_physics_count_once() -> None:
    told = blocks(np.full(K, 0.2), seed=4)
    free = shrunk(told, 1e-9)[0]
    sharp = Physics(np.array([0.0]), np.array([[1e12]]))
    held = shrunk(told, 1e-9, sharp)[0]
    assert abs(held[0]) < 1e-6 < abs(free[0])
    pulled = Physics(np.array([-0.5e12]), np.array([[1e12]]))  # a prior half a unit above
    assert shrunk(told, 1e-9, pulled)[0][0] == pytest.approx(0.5, rel=1e-6)
    assert len(ALONE.pull) == 0
