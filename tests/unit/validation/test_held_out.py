"""Which of two models predicts unseen flights better: said where it is sure, and not said where it is not."""

from __future__ import annotations

import math

import numpy as np
from held_out import CHANNELS, Gain, PredictionErrors, gains

from swashplate.arrays import Array


def made(size: float, *, seconds: float = 60.0, seed: int = 1) -> PredictionErrors:
    """Errors of one size, in flights that move by one unit."""
    time: Array = np.arange(0.0, seconds, 0.1)
    shape = (time.size, len(CHANNELS))
    errors = size * np.random.default_rng(seed).standard_normal(shape)
    return PredictionErrors((time,), (errors**2,), (np.ones(shape),))


def test_a_better_model_is_found_better_and_the_other_way_round_worse() -> None:
    assert {one.verdict for one in gains(made(0.6), made(0.3))} == {"better"}
    assert {one.verdict for one in gains(made(0.3), made(0.6))} == {"worse"}
    first = gains(made(0.6), made(0.3))[0]
    assert first.low < first.points < first.high


def test_alike_models_are_not_told_apart_nor_models_on_short_flights() -> None:
    alike = gains(made(0.5), made(0.5, seed=2))
    assert sum(bool(one.verdict) for one in alike) <= 1  # each interval is of 95 %
    assert {one.verdict for one in gains(made(0.5), made(0.5))} == {""}
    short = gains(made(0.6, seconds=5.0), made(0.3, seconds=5.0))
    assert all(one.points > 20.0 and math.isnan(one.low) and not one.verdict for one in short)
    assert isinstance(short[0], Gain)
