"""Lengths of the windows that a composite response is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

WINDOWS = 5


@dataclass(frozen=True)
class Windows:
    """Lengths [s] of the windows, longest first, with what was bent to get them."""

    lengths: tuple[float, ...]
    warnings: tuple[str, ...]


def choose_windows(durations: Sequence[float], highest: float, *, count: int = WINDOWS) -> Windows:
    """Window lengths by the book's rules (Tischler and Remple 2012, ch. 10).

    The longest is at most half the shortest record and a fifth of all; the shortest holds at least 20 periods of the
    highest frequency.

    Args:
        durations: of the records [s].
        highest: highest frequency [Hz].
        count: how many lengths, spread geometrically.
    """
    longest = min(min(durations) / 2.0, sum(durations) / 5.0)
    shortest = min(20.0 / highest, longest)
    warned: tuple[str, ...] = ()
    if 20.0 / highest > longest:
        warned = (
            f"the records are short: a window of {longest:.3g} s holds {longest * highest:.0f} periods of the highest "
            f"frequency ({highest:.3g} Hz), expected 20. Fly longer for a trustworthy response.",
        )
    shortest = max(shortest, longest / 10.0)
    number = count if longest > 1.2 * shortest else 1
    lengths = np.geomspace(longest, shortest, number) if number > 1 else np.array([longest])
    return Windows(tuple(float(length) for length in lengths), warned)
