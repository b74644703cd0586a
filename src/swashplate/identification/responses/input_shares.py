"""What of each input is its own, no other input's: the share that windows do not feign.

Two inputs that a loop ties together are one, whatever the record's length. But a window blurs the loop's response as it
blurs every other, and what it blurs looks like power of the input's own: on a roll sweep under ArduPilot's rate loop a
window of 5 s showed 1 to 3 % for two inputs of which 0.05 % were their own, and the responses on them were off by 10 dB
with a coherence of 0.98. The same cure as for responses (`resolution`): what the other inputs explain is taken out of
the whole record before the window looks at what is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.responses.multi_input import condition_spectra
from swashplate.identification.responses.resolution import coherent_guess, without
from swashplate.identification.responses.spectra import Signals, SpectralMatrix, spectral_matrix

SUSPECT, OFTEN = 0.1, 0.05
"""Own share by the window's own spectra, below which it is looked at closely, and at how many of the lines."""


ENOUGH = 4.95
"""Windows in the records from which on a window's share counts for the others too."""


def own_shares(
    pieces: Sequence[Signals], matrices: Sequence[SpectralMatrix], omega: Array, *, inputs: int, overlap: float
) -> list[Array | None]:
    """Each input's own share of its power for every window, shape (n_f, inputs); None where no window suspects any.

    Args:
        pieces: records, inputs first. matrices: of these, one per window. omega: their frequencies [rad/s].
        inputs: how many of the channels are inputs.
        overlap: of the windows.
    """
    if inputs < 2:
        return [None] * len(matrices)
    plain = [condition_spectra(m.values[:, :inputs, :inputs], inputs, averages=m.averages).own_share for m in matrices]
    suspects = [i for i in range(inputs) if any(np.mean(share[:, i] < SUSPECT) > OFTEN for share in plain)]
    if not suspects:
        return [None] * len(matrices)
    close = [_closely(pieces, m, omega, share, suspects, overlap) for m, share in zip(matrices, plain, strict=True)]
    # A share is the input's, not the window's, and blurring only adds to it; too few windows fit anything.
    sure = [share for share, m in zip(close, matrices, strict=True) if m.averages >= ENOUGH]
    least = np.fmin.reduce(sure) if sure else np.full(close[0].shape, np.nan)
    return [np.where(np.isfinite(share), np.fmin(share, least), np.nan) for share in close]


def _closely(
    pieces: Sequence[Signals],
    matrix: SpectralMatrix,
    omega: Array,
    plain: Array,
    suspects: Sequence[int],
    overlap: float,
) -> Array:
    """The smaller of a window's own share and what is left when the others' part was taken out of the record."""
    n = plain.shape[1]
    closest = plain.copy()
    seen = np.isfinite(matrix.values[:, 0, 0])
    for i in suspects:
        order = [*(j for j in range(n) if j != i), i]
        part = matrix.values[np.ix_(range(omega.size), order, order)]
        first = condition_spectra(part, n - 1, averages=matrix.averages)
        rest = without(
            [replace(piece, values=piece.values[:, order]) for piece in pieces],
            omega[seen],
            coherent_guess(omega[seen], first.response[seen], first.coherence[seen]),
        )
        left = spectral_matrix(rest, omega, window=matrix.window, overlap=overlap, periods=0.0)
        assert left is not None
        second = condition_spectra(left.values, n - 1, averages=matrix.averages)
        power = left.values[:, -1, -1].real * (1.0 - second.multiple[:, 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            share = power / part[:, -1, -1].real
        closest[seen, i] = np.fmin(closest[seen, i], share[seen])
    return closest
