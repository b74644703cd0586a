"""How a linear model's errors along a record move with its numbers: one filter for the slopes of all of them.

    x+ = phi x + g0 u + g1 (u+ - u) + push + gain e,    e = y - c x - d u - bias

The slopes of x run through phi - gain c, whatever number moves; what drives them is, for every number, a constant
matrix times the same few signals (states, inputs, their steps, errors). It is done for a block of samples at a time,
which stays in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.time.linear_simulation import driven

_BLOCK = 256
"""Samples."""


class Coefficients(NamedTuple):
    """What makes a record's errors, for a batch of models (first axis).

    Attributes:
        x: at the start. phi, c, gain, g0, g1, push, d, bias: as above.
        lag: of the inputs, in samples.
    """

    x: Any
    phi: Any
    c: Any
    gain: Any
    g0: Any
    g1: Any
    push: Any
    d: Any
    bias: Any
    lag: Any


def slopes_along(
    base: Coefficients, slope: Coefficients, inputs: Array, later: Array, errors: Array, states: Array
) -> Iterator[tuple[Array, Array]]:
    """Block by block the errors (n, n_outputs) and their slopes (n_entries, n, n_outputs).

    Args:
        base: of one model, without a batch.
        slope: their slopes by the entries; entries that move the gain alone stand last, and are missing in the others.
        inputs: later by their lags, (n_t, n_inputs). later: their slopes by the lag.
        errors, states: along the record, (n_t, n_outputs) and (n_t, n_states).
    """
    (n_t, k), n, few, many = errors.shape, base.phi.shape[0], len(slope.x), len(slope.gain)
    still = np.zeros((1, inputs.shape[1]))
    signals = [states, inputs, np.diff(inputs, axis=0, append=still), later, np.diff(later, axis=0, append=still)]
    signals += [np.ones((n_t, 1)), errors]
    lag = slope.lag[:, None, :]
    none = np.zeros_like(slope.d)
    outputs = -np.concatenate(
        [slope.c, slope.d, none, base.d * lag, none, slope.bias[:, :, None], np.zeros((few, k, k))], axis=2
    )
    driving = np.concatenate(
        [slope.phi, slope.g0, slope.g1, base.g0 * lag, base.g1 * lag, slope.push[:, :, None], slope.gain[:few]], axis=2
    )
    pushing = np.zeros((many, n, outputs.shape[2]))
    pushing[:few] = driving + base.gain @ outputs
    pushing[few:, :, -k:] = slope.gain[few:]
    by_signal, through = pushing.reshape(many * n, -1).T, outputs.reshape(few * k, -1).T
    table = np.hstack(signals)
    x = np.concatenate([slope.x, np.zeros((many - few, n))])
    loop = base.phi - base.gain @ base.c
    for at in range(0, n_t, _BLOCK):
        block = table[at : at + _BLOCK]
        count = len(block)
        ran, x = driven(x, loop, (block @ by_signal).reshape(count, many, n))
        slopes = (ran.reshape(-1, n) @ -base.c.T).reshape(count, many, k)
        slopes[:, :few] += (block @ through).reshape(count, few, k)
        yield errors[at : at + count], np.ascontiguousarray(np.moveaxis(slopes, 1, 0))
