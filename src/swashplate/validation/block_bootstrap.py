"""How far scores scatter: a moving block bootstrap, with the same blocks for everything that is compared.

Errors of predictions that start 0.1 s apart are nearly the same error, so single starts must not be drawn; blocks of
seconds may (Künsch 1989). The same blocks are drawn for every predictor, so that differences between them are judged by
how they differ on the same stretches of flight.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array

BLOCK = 4.0
"""Seconds of one block: a few periods of a small helicopter's slow motion."""

WANTED, OVERLAP, SHORTEST = 6.0, 2.0, 2.0
"""Blocks below which they are made shorter, but not below so many horizons, over which errors are related, nor so many
seconds, over which gusts are. Simulated (errors related over 0.25 to 0.5 s, 12 s of starts): three blocks of 4 s hold
the truth in 72 % of the cases, six of 2 s in 85 %, where 95 % are meant; ten of 4 s in 86 %."""

DRAWS, SEED = 1000, 20110801
CHANCE = 0.05
"""Share of the draws outside an interval."""

FEWEST = 3.0
"""Blocks that the starts must span for an interval to be told; below it scatter cannot be seen."""


def block_of(times: Sequence[Array], horizon: float) -> float:
    """Seconds of a block for start times by record and predictions `horizon` seconds ahead."""
    return min(BLOCK, max(_span(times) / WANTED, OVERLAP * horizon, SHORTEST))


def blocks_of(times: Sequence[Array], horizon: float) -> float:
    """How many blocks the start times of all records span [1]."""
    return _span(times) / block_of(times, horizon)


def _span(times: Sequence[Array]) -> float:
    return float(sum(t[-1] - t[0] for t in times if t.size))


def drawn(times: Sequence[Array], squares: Sequence[Array], *, horizon: float) -> Array | None:
    """Sums of squares over flights drawn by blocks (DRAWS, ...); None where the records span too few blocks.

    Args:
        times: start times [s] of each record, evenly spaced, shape (s,).
        squares: squared errors of each record (s, ...), of all that is to be compared side by side.
        horizon: seconds ahead that they were predicted.
    """
    block = block_of(times, horizon)
    if blocks_of(times, horizon) < FEWEST:
        return None
    windows, lengths = [], []
    for t, rows in zip(times, squares, strict=True):
        if not t.size:
            continue
        step = float(np.median(np.diff(t))) if t.size > 1 else block
        width = min(t.size, max(1, round(block / step)))
        total = np.concatenate([np.zeros((1, *rows.shape[1:])), np.cumsum(rows, axis=0)])
        windows.append(total[width:] - total[:-width])
        lengths += [width] * len(windows[-1])
    table, starts = np.concatenate(windows), sum(t.size for t in times)
    count = max(2, round(starts / float(np.mean(lengths))))
    chosen = np.random.default_rng(SEED).integers(len(table), size=(DRAWS, count))
    return np.asarray(table[chosen].sum(axis=1))


def interval(draws: Array | None) -> tuple[float, float]:
    """The middle 95 % of drawn figures (DRAWS,); NaN where nothing could be drawn."""
    if draws is None:
        return float("nan"), float("nan")
    low, high = np.quantile(draws, (0.5 * CHANCE, 1.0 - 0.5 * CHANCE))
    return float(low), float(high)
