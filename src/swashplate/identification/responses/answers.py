"""Inputs that are a controller's answer to the outputs: their responses are minus its inverse (Ljung 1999, ch. 13).

The test of `docs/explanation/flights-under-feedback.md` on channels instead of a vehicle's axes: what share of an
input do the present and the past 0.3 s of the outputs explain, and do they explain it better than what follows?
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.responses.spectra import Signals

_SPAN, _STEP = 0.3, 0.025  # s: of the outputs that a controller answers to, and between the samples of them
_ANSWER = 0.99  # explained share from which an input is an answer
_NEAR = 0.9  # ... and from which that is asked of all digits
_LATER = 1.5  # times as much left unexplained by the past as by what follows: then the outputs follow the input


def answer_words(pieces: Sequence[Signals], inputs: Sequence[str], outputs: Sequence[str]) -> list[str]:
    """A problem for every input that the outputs before it explain.

    Args:
        pieces: records that hold inputs, then outputs.
        inputs, outputs: names.
    """
    words = []
    of_pieces = [_shares(piece, len(inputs), len(outputs)) for piece in pieces]
    for i, name in enumerate(inputs):
        shares = [share[i] for share in of_pieces]
        told = [share for share in shares if share is not None]
        if told and all(past >= _ANSWER and 1.0 - past <= _LATER * (1.0 - later) for past, later in told):
            least = 100.0 * min(past for past, _ in told)
            where = ", ".join(dict.fromkeys(piece.name for piece in pieces))
            words.append(
                f"{where}: input '{name}' is a controller's answer: {_SPAN:g} s of {', '.join(outputs)} explain "
                f"{least:.1f} % of it. Its responses are minus the controller's inverse, not the aircraft's, however "
                "coherent. Fly a sweep, or move the sticks and name the set-point with --references."
            )
    return words


def _shares(piece: Signals, n_in: int, n_out: int) -> list[tuple[float, float] | None]:
    """Of each input, the shares of its variance that the outputs until then and from then on explain; None: still."""
    step = max(1, round(_STEP / piece.dt))
    reach = step * round(_SPAN / _STEP)
    values = np.asarray(piece.values[:, : n_in + n_out], dtype=np.float64)
    if len(values) < 20 * reach:
        return [None] * n_in
    # A row for every step: those between say the same again.
    targets, answers = values[reach:-reach:step, :n_in], np.ascontiguousarray(values[::step, n_in:])
    span, rows = reach // step, len(targets)

    def shifted(shifts: Sequence[int]) -> Array:
        return np.concatenate([answers[span + k : span + k + rows] for k in shifts], axis=1)

    before = shifted(range(-span, 1))
    past = _nearly_explained(targets, before)
    if np.any(past >= _NEAR):
        past = _explained(targets, before)
    # What follows is asked only where the past explains an input.
    later = _explained(targets, shifted(range(1, span + 1))) if np.any(past >= _ANSWER) else past
    still = np.ptp(targets, axis=0) == 0.0
    return [None if still[i] else (float(past[i]), float(later[i])) for i in range(n_in)]


def _explained(targets: Array, by: Array) -> Array:
    """Share of each target's variance that lies in the span of some columns, by one triangular factor of them all."""
    both = np.concatenate([by, targets], axis=1)
    factor = np.asarray(np.linalg.qr(both - both.mean(axis=0), mode="r"), dtype=np.float64)
    triangle = factor[:, by.shape[1] :] ** 2
    total = triangle.sum(axis=0)
    return np.asarray(triangle[: by.shape[1]].sum(axis=0) / np.where(total > 0.0, total, 1.0))


def _nearly_explained(targets: Array, by: Array) -> Array:
    """The same by covariances, in a tenth of the time; what varies by less than 1e-6 of all is left out."""
    n = by.shape[1]
    both = np.concatenate([by, targets], axis=1)
    both -= both.mean(axis=0)
    size = np.sqrt(np.einsum("ij,ij->j", both, both))
    both /= np.where(size > 0.0, size, 1.0)
    products = both.T @ both
    values, vectors = np.linalg.eigh(products[:n, :n])
    kept = values > 1e-12 * n
    along = vectors[:, kept].T @ products[:n, n:]
    return np.asarray((along**2 / values[kept, None]).sum(axis=0))
