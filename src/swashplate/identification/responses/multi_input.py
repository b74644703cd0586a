"""Multi-input conditioning: what each input does to each output when all other inputs are accounted for.

What of each input is its own, no other input's: the share that windows do not feign.

Two inputs that a loop ties together are one, whatever the record's length. But a window blurs the loop's response as it
blurs every other, and what it blurs looks like power of the input's own: on a roll sweep under ArduPilot's rate loop a
window of 5 s showed 1 to 3 % for two inputs of which 0.05 % were their own, and the responses on them were off by 10 dB
with a coherence of 0.98. The same cure as for responses (`resolution`): what the other inputs explain is taken out of
the whole record before the window looks at what is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array, Complex
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
    shares = [condition_spectra(m.values[:, :inputs, :inputs], inputs, averages=m.averages).own_share for m in matrices]
    suspects = [i for i in range(inputs) if any(np.mean(share[:, i] < SUSPECT) > OFTEN for share in shares)]
    if not suspects:
        return [None] * len(matrices)
    close = [_closely(pieces, m, omega, share, suspects, overlap) for m, share in zip(matrices, shares, strict=True)]
    # A share is the input's, not the window's, and blurring only adds to it; too few windows fit anything.
    sure = [share for share, m in zip(close, matrices, strict=True) if m.averages >= ENOUGH]
    least = np.fmin.reduce(sure) if sure else np.full(close[0].shape, np.nan)
    return [np.where(np.isfinite(share), np.fmin(share, least), np.nan) for share in close]


def _closely(
    pieces: Sequence[Signals],
    matrix: SpectralMatrix,
    omega: Array,
    shares: Array,
    suspects: Sequence[int],
    overlap: float,
) -> Array:
    """The smaller of a window's own share and what is left when the others' part was taken out of the record."""
    n = shares.shape[1]
    closest = shares.copy()
    known = np.isfinite(matrix.values[:, 0, 0])
    for i in suspects:
        order = [*(j for j in range(n) if j != i), i]
        part = matrix.values[np.ix_(range(omega.size), order, order)]
        first = condition_spectra(part, n - 1, averages=matrix.averages)
        rest = without(
            [replace(piece, values=piece.values[:, order]) for piece in pieces],
            omega[known],
            coherent_guess(omega[known], first.response[known], first.coherence[known]),
        )
        left = spectral_matrix(rest, omega, window=matrix.window, overlap=overlap, periods=0.0)
        assert left is not None
        second = condition_spectra(left.values, n - 1, averages=matrix.averages)
        power = left.values[:, -1, -1].real * (1.0 - second.multiple[:, 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            share = power / part[:, -1, -1].real
        closest[known, i] = np.fmin(closest[known, i], share[known])
    return closest


SINGULAR = 5e-3
"""Share of an input's power that no other input explains, below which it cannot be told from the others."""

C_EPSILON = float(np.sqrt(0.55))
"""Constant of the random error for Hann windows that overlap by half (Tischler and Remple 2012, ch. 7)."""


@dataclass(frozen=True)
class Conditioned:
    """Responses and conditioned spectra of one spectral matrix; NaN where the inputs cannot be told apart.

    Attributes:
        response: H, shape (n_f, n_outputs, n_inputs).
        coherence: partial coherence, same shape.
        multiple: multiple coherence of each output, shape (n_f, n_outputs).
        input_power: spectrum of each input that no other input explains, shape (n_f, n_inputs).
        output_power: spectrum of each output that no other input explains, shape (n_f, n_outputs, n_inputs).
        cross: conditioned cross spectrum, same shape.
        own_share: share of each input's power that no other input explains, shape (n_f, n_inputs).
        error: random error of the magnitude (relative) and of the phase [rad], shape as `response`.
        noise: spectral matrix of what the inputs leave of the outputs, shape (n_f, n_outputs, n_outputs).
        inverse: of the inputs' spectral matrix, shape (n_f, n_inputs, n_inputs): errors of responses of one output to
            several inputs go together as its entries do.
    """

    response: Complex
    coherence: Array
    multiple: Array
    input_power: Array
    output_power: Array
    cross: Complex
    own_share: Array
    error: Array
    noise: Complex
    inverse: Complex


WEAK = 0.2
"""Random error of what references tell of an input, from which on they tell too little: a quotient of two noises."""


def condition_spectra(
    spectra: Complex,
    inputs: int,
    *,
    averages: float,
    removed: Complex | None = None,
    total: Array | None = None,
    share: Array | None = None,
    references: int = 0,
) -> Conditioned:
    """H = Gxx^-1 Gxy with partial and multiple coherence (Tischler and Remple 2012, ch. 9; Bendat and Piersol 2010).

    With A = Gxx^-1 and the noise spectrum Gvv = Gyy - Gyx A Gxy, the inverse of the full matrix gives the partial
    coherence |H_i|^2 / (A_ii Gvv + |H_i|^2); 1/A_ii is what no other input explains of input i.

    Args:
        spectra: shape (n_f, n, n), inputs first, `[f, i, j]` = average of conj(Z_i) Z_j.
        inputs: how many of the channels are inputs.
        averages: number of independent windows.
        removed: responses that were taken out of the outputs beforehand and are added here, shape
            (n_f, n_outputs, n_inputs). total: spectra of the whole outputs then, shape (n_f, n_outputs).
        share: of each input's power that is its own, where it is known better than by these spectra (`own_shares`).
        references: channels behind inputs and outputs that no loop feeds back: the joint estimate is made. Its noise is
            what the responses leave of the measured outputs with the measured inputs, which is the aircraft's own; what
            the references leave of the outputs is that noise as the loop answers it (Ljung 1999, eq. 13.44). Where they
            tell too little of an input (random error of `WEAK`), it has no response.
    """
    measured, n = spectra, spectra.shape[1] - references
    if references:
        spectra = project_on_references(measured, inputs, references)[:, :n, :n]
    gxx, gxy = spectra[:, :inputs, :inputs], spectra[:, :inputs, inputs:]
    gyy = np.diagonal(spectra[:, inputs:, inputs:], axis1=1, axis2=2).real
    auto = np.diagonal(gxx, axis1=1, axis2=2).real
    scale = np.sqrt(np.where(auto > 0.0, auto, 1.0))
    normal = gxx / (scale[:, :, None] * scale[:, None, :])
    lone, inverse = _inverse(normal)
    if share is not None:
        lone = np.fmin(lone, share) if references else share
    inverse = inverse / (scale[:, :, None] * scale[:, None, :])
    h = inverse @ gxy  # (n_f, n_inputs, n_outputs)
    explained = np.einsum("fio,fio->fo", gxy.conj(), h).real
    noise = np.maximum(gyy - explained, 0.0)
    left = _unexplained(measured[:, :n, :n], h)
    if references:
        noise = np.maximum(np.diagonal(left, axis1=1, axis2=2).real, 0.0) * _freedom(averages, inputs)
        untold = np.maximum(np.diagonal(measured[:, :inputs, :inputs], axis1=1, axis2=2).real - auto, 0.0)
        a = np.diagonal(inverse, axis1=1, axis2=2).real
        strong = random_error(1.0 / (1.0 + untold * a), averages - (inputs - 1)) < WEAK
        lone = np.where(strong | ~np.isfinite(lone), lone, 0.0)
    estimate = h.transpose(0, 2, 1) if removed is None else h.transpose(0, 2, 1) + removed
    response = np.where(lone[:, None, :] > SINGULAR, estimate, np.nan)
    a = np.diagonal(inverse, axis1=1, axis2=2).real
    power = np.abs(response) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = power / (a[:, None, :] * noise[:, :, None] + power)
        multiple = explained / gyy if total is None else 1.0 - noise / total
        input_power = np.where(a > 0.0, 1.0 / np.where(a > 0.0, a, 1.0), np.nan)
        cross = response * input_power[:, None, :]
    return Conditioned(
        response=response,
        coherence=coherence,
        multiple=np.clip(multiple, 0.0, 1.0),
        input_power=input_power,
        output_power=noise[:, :, None] + power * input_power[:, None, :],
        cross=np.asarray(cross, dtype=np.complex128),
        own_share=lone,
        error=random_error(coherence, averages - (inputs - 1)),
        noise=left,
        inverse=inverse,
    )


def _unexplained(spectra: Complex, h: Complex) -> Complex:
    """Spectral matrix of what responses leave of the outputs with the inputs as they are, (n_f, n_outputs, n_outputs).

    Args:
        spectra: channels in the order inputs, outputs. h: shape (n_f, n_inputs, n_outputs).
    """
    n = h.shape[1]
    across = h.conj().transpose(0, 2, 1) @ spectra[:, :n, n:]
    answered = h.conj().transpose(0, 2, 1) @ spectra[:, :n, :n] @ h
    return np.asarray(spectra[:, n:, n:] - across - across.conj().transpose(0, 2, 1) + answered)


def _freedom(averages: float, inputs: int) -> float:
    """By how much fitted responses make noise look smaller: n / (n - inputs), with n as `random_error` counts."""
    n = averages / C_EPSILON**2
    return n / (n - inputs) if n > inputs + 1.0 else n


def _inverse(normal: Complex) -> tuple[Array, Complex]:
    """Each input's own share and the inverse of coherency matrices, by pseudo-inverse where they are singular.

    An input that no null vector touches is conditioned rightly by the pseudo-inverse; the others have no own share.
    """
    n_f, n = normal.shape[:2]
    share = np.full((n_f, n), np.nan)
    inverse = np.full_like(normal, np.nan)
    finite = np.all(np.isfinite(normal), axis=(1, 2))
    lowest = np.full(n_f, np.nan)
    lowest[finite] = np.linalg.eigvalsh(normal[finite])[:, 0]
    well = finite & (lowest > 1e-9)
    inverse[well] = np.linalg.inv(normal[well])
    share[well] = 1.0 / np.maximum(np.diagonal(inverse[well], axis1=1, axis2=2).real, 1.0)
    for f in np.flatnonzero(finite & ~well):
        share[f] = _shares(normal[f])
        inverse[f] = np.linalg.pinv(normal[f], rcond=1e-9, hermitian=True)
    return share, inverse


def _shares(normal: Complex) -> Array:
    """Own shares where the matrix is singular: 1 - multiple coherence with the other inputs, by least squares."""
    n = normal.shape[0]
    share = np.zeros(n)
    for i in range(n):
        others = [j for j in range(n) if j != i]
        gii = normal[i, i].real
        across = normal[others, i]
        explained = float((across.conj() @ np.linalg.pinv(normal[np.ix_(others, others)], rcond=1e-9) @ across).real)
        share[i] = max(gii - explained, 0.0)
    return share


def random_error(coherence: Array, averages: float) -> Array:
    """Relative standard deviation of a response's magnitude, and of its phase in rad.

    C sqrt(1 - coherence) / (sqrt(coherence) sqrt(2 n_d)) (Tischler and Remple 2012, eq. 7.62; Bendat and Piersol 2010).

    Args:
        coherence: ordinary, or partial with the averages reduced by the number of other inputs.
        averages: independent windows n_d.
    """
    held = np.clip(coherence, 1e-12, 1.0)
    return np.asarray(C_EPSILON * np.sqrt((1.0 - held) / held / (2.0 * max(averages, 1.0))))


def project_on_references(spectra: Complex, inputs: int, references: int) -> Complex:
    """The spectral matrix with the inputs replaced by what the references explain of them (joint input-output).

    A loop feeds the outputs' disturbances back into the inputs and biases the direct estimate. The references are free
    of them, so conditioning on the explained inputs gives S_ry / S_ru, with as many references as inputs, and its
    two-stage form with more (Ljung 1999, sec. 13.5; van den Hof and Schrama 1993).

    Args:
        spectra: channels in the order inputs, outputs, references.
        inputs, references: how many of each.

    Returns:
        The matrix of explained inputs and outputs.
    """
    n = spectra.shape[1] - references
    cross = spectra[:, :inputs, n:]  # S_ur
    grr = spectra[:, n:, n:]
    out = spectra[:, :n, :n].copy()
    usable = np.all(np.isfinite(spectra), axis=(1, 2))
    inverse = np.full_like(grr, np.nan)
    inverse[usable] = np.linalg.pinv(grr[usable], rcond=1e-9, hermitian=True)
    gain = cross @ inverse
    out[:, :inputs, :inputs] = gain @ cross.conj().transpose(0, 2, 1)
    out[:, :inputs, inputs:n] = gain @ spectra[:, n:, inputs:n]
    out[:, inputs:n, :inputs] = out[:, :inputs, inputs:n].conj().transpose(0, 2, 1)
    return out
