"""The loop of every filter along a record: a reading corrects, the model predicts.

What is filtered is plugged in as two functions, so that the likelihoods of linear and nonlinear models, their tangent
planes, the predictions of validation and an observer along a log run the same loop.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from swashplate.jax_on_demand import jax

Correct = Callable[[Any, Any, Any], tuple[Any, Any]]
"""(predicted state, reading, what holds now) to (corrected state, what is told, such as the innovation)."""
Predict = Callable[[Any, Any], Any]
"""(corrected state, what holds now) to the state one sample later."""


def filtered(
    start: Any, readings: Any, along: Any, *, correct: Correct, predict: Predict
) -> tuple[Any, tuple[Any, Any]]:
    """The state after the last sample; what is told at every sample and the states after each reading (traceable).

    Args:
        start: predicted state at the first sample.
        readings: by sample, first axis n.
        along: what holds at each sample, first axis n.
        correct, predict: the filter.
    """

    def sample(state: Any, here: tuple[Any, Any]) -> tuple[Any, Any]:
        reading, now = here
        corrected, told = correct(state, reading, now)
        return predict(corrected, now), (told, corrected)

    return jax.lax.scan(sample, start, (readings, along))
