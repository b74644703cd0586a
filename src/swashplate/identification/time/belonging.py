"""Whether commands and motion belong together: the same commands, some seconds earlier or later, must explain less."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from swashplate.identification.core.records import Record

SHIFTS = 19
"""Other places of the commands: unrelated ones are the best of twenty by chance in one of twenty cases."""


def unrelated(cost: Callable[[Sequence[Record]], float], pieces: Sequence[Record]) -> str:
    """Why the commands are not those of the motion, in words; "" where they explain it better than moved ones.

    A permutation test (Good 2005): the commands of every record are moved around in a circle, and nothing is fitted
    anew, so that what they say of the motion is all that changes.

    Args:
        cost: negative log-likelihood of records at the numbers that were found.
        pieces: the records.
    """
    here = cost(pieces)
    shares = np.arange(1, SHIFTS + 1) / (SHIFTS + 1)
    better = [share for share in shares if cost([_moved(piece, share) for piece in pieces]) <= here]
    if not better:
        return ""
    longest = max(float(piece.time[-1] - piece.time[0]) for piece in pieces)
    return (
        f"the motion does not follow the commands: the same commands {better[0] * longest:.3g} s later explain it as "
        "well. Are they of another flight, another clock or other channels?"
    )


def _moved(piece: Record, share: float) -> Record:
    """The record with its commands later by a share of its length, the last ones first."""
    return replace(piece, inputs=np.roll(piece.inputs, round(share * len(piece.inputs)), axis=0))
