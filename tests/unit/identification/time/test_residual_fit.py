"""How much of a residual is kept: by blocks left out, and no more than they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from simulated_flights import ten_seconds
from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import records
from swashplate.identification.time import residual_fit
from swashplate.identification.time.residual_fit import (
    LeftOutBlock,
    LinearResidual,
    chosen_strength,
    fit_residual,
    shrunk,
)

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
        monkeypatch.setattr(residual_fit, "shrunk", lambda _, strength, told=told: shrunk(told, strength))
        kept += np.isfinite(chosen_strength(told)[0])
    assert kept >= 5  # against one in twenty


def test_words_say_what_was_gained_and_where() -> None:
    vehicle = sp.vehicle("crazyflie")
    none = LinearResidual(vehicle, np.inf, 12.0, 9.0, {"p": 0.0}, Noise())
    assert none.words == "residual: none, the best would gain 12 +- 9 of log-likelihood on blocks left out"
    some = LinearResidual(vehicle, 2.0, 120.0, 9.0, {"p": 14.2, "q": 3.0}, Noise())
    assert "gains 120 +- 9" in some.words
    assert "p 14 %, q 3 %" in some.words
    assert some.told["share of each acceleration [%]"] == {"p": 14.2, "q": 3.0}


def test_too_few_blocks_are_refused_before_anything_is_computed() -> None:
    coax = sp.vehicle("coax")
    pieces = records((ten_seconds().condition(rate=100.0, cutoff=0.0),), coax)
    with pytest.raises(IdentificationError, match="1 blocks of 6 s, a residual needs 4"):
        fit_residual(coax, pieces, [Nuisance()], Noise())


def test_blocks_cover_the_record_once() -> None:
    (piece,) = records((ten_seconds().condition(rate=100.0, cutoff=0.0),), sp.vehicle("coax"))
    long = replace(piece, **{name: np.concatenate([getattr(piece, name)] * 3) for name in ("inputs", "outputs")},
                   time=0.01 * np.arange(3 * piece.time.size), voltage=np.tile(piece.voltage, 3))  # fmt: skip
    cut = residual_fit._blocks(long)
    assert len(cut) == int(long.time[-1] // residual_fit.BLOCK)
    np.testing.assert_array_equal(np.concatenate([block.time for block in cut]), long.time)
