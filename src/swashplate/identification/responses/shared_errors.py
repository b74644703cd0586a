"""How the random errors of responses go together: gusts move every output at once, and windows blur neighbouring lines.

The error of a response is the inverse of the inputs' spectra times the cross spectrum of inputs and noise. So errors of
two outputs go together as the noise of the two does, those of two inputs as the entries of the inverse do (Bendat and
Piersol 2010, ch. 9; Pintelon and Schoukens 2012, sec. 7.3), and those of two lines as the square of what the squared
taper makes of their distance (Percival and Walden 1993, sec. 6.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex

_WIDTH = 2.0 * np.pi * 0.785
"""Standard deviation [rad] of the normal curve over distance times window's length that stands for what Hann's taper
does: 4/9 where the distance is one over the length, as that has."""


@dataclass(frozen=True)
class ErrorParts:
    """The error of one response as a sum of independent unit parts that other responses' errors have too.

    Attributes:
        noise: of the outputs' noise, shape (n, n_outputs).
        inverse: of the inputs' inverse spectra, shape (n, n_inputs).
        window: length that counts at each frequency [s], shape (n,).
    """

    noise: Complex
    inverse: Complex
    window: Array

    def among(self, lines: NDArray[np.bool_]) -> ErrorParts:
        return ErrorParts(self.noise[lines], self.inverse[lines], self.window[lines])


@dataclass(frozen=True)
class SharedErrors:
    """What the errors of responses have in common.

    Attributes:
        noise: coherency of the outputs' noise, ordered as a spectral matrix, shape (n_f, n_outputs, n_outputs).
        inverse: the same of the inverse of the inputs' spectral matrix, shape (n_f, n_inputs, n_inputs).
        window: length that counts at each line [s], shape (n_f,).
    """

    noise: Complex
    inverse: Complex
    window: Array

    @staticmethod
    def of(noise: Complex, inverse: Complex, window: Array) -> SharedErrors:
        """From spectral matrices of any size; where they have no numbers, nothing is shared."""
        return SharedErrors(_coherency(noise), _coherency(inverse), window)

    def select(self, outputs: Sequence[int], inputs: Sequence[int]) -> SharedErrors:
        """The part of some outputs and inputs, by place."""
        lines = range(self.window.size)
        return SharedErrors(
            self.noise[np.ix_(lines, outputs, outputs)], self.inverse[np.ix_(lines, inputs, inputs)], self.window
        )

    def at(self, omega: Array, lines: Array, output: int, input: int) -> ErrorParts:
        """The parts of one response's error at some frequencies.

        Args:
            omega: frequencies [rad/s], shape (n,). lines: those of this object, shape (n_f,).
            output, input: places.
        """
        # The mean of conj(V_o) V_p is the covariance of V_p and V_o: turned round.
        noise, inverse = (_roots(_between(omega, lines, part)) for part in (self.noise.conj(), self.inverse))
        return ErrorParts(noise[:, output], inverse[:, input], np.interp(np.log(omega), np.log(lines), self.window))


def correlation_of_errors(omega: Sequence[Array], parts: Sequence[ErrorParts | None]) -> Complex:
    """Correlation of the complex errors of all points of several responses, shape (n, n); one without parts is alone.

    Args:
        omega: frequencies [rad/s] of each response, shape (n_k,). parts: of its error.
    """
    sizes = [each.size for each in omega]
    alone = np.concatenate([np.full(n, one is None) for n, one in zip(sizes, parts, strict=True)])
    known = [one for one in parts if one is not None]
    correlation = np.eye(alone.size, dtype=np.complex128)
    if known:
        noise, inverse, window = (
            np.concatenate([getattr(one, name) for one in known]) for name in ("noise", "inverse", "window")
        )
        lines = line_correlation(np.concatenate(omega)[~alone], window)
        correlation[np.ix_(~alone, ~alone)] = (noise @ noise.conj().T) * (inverse @ inverse.conj().T) * lines
    return correlation


def line_correlation(omega: Array, window: Array) -> Array:
    """Correlation of the errors at every two frequencies, shape (n, n); positive definite whatever the windows.

    Normal curves of different widths: Gibbs (1997), eq. 3.56.

    Args:
        omega: frequencies [rad/s], shape (n,). window: lengths [s], shape (n,).
    """
    width = _WIDTH / window
    squares = width[:, None] ** 2 + width[None, :] ** 2
    apart = omega[:, None] - omega[None, :]
    return np.asarray(np.sqrt(2.0 * width[:, None] * width[None, :] / squares) * np.exp(-(apart**2) / squares))


def _coherency(matrix: Complex) -> Complex:
    size = np.sqrt(np.maximum(np.diagonal(matrix, axis1=1, axis2=2).real, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = matrix / (size[:, :, None] * size[:, None, :])
    ratio = np.where(np.isfinite(ratio), ratio, 0.0)
    ratio[:, range(matrix.shape[1]), range(matrix.shape[1])] = 1.0
    return np.asarray(ratio)


def _between(omega: Array, lines: Array, matrices: Complex) -> Complex:
    """Matrices straight between lines over log frequency, shape (n, k, k)."""
    x = np.interp(np.log(omega), np.log(lines), np.arange(lines.size))
    below = np.minimum(x.astype(int), lines.size - 2)
    share = (x - below)[:, None, None]
    return np.asarray((1.0 - share) * matrices[below] + share * matrices[below + 1])


def _roots(matrices: Complex) -> Complex:
    """Hermitian square roots R, R R* = M; they change as smoothly over frequency as the matrices do."""
    values, vectors = np.linalg.eigh(matrices)
    roots = np.sqrt(np.maximum(values, 0.0))[:, None, :]
    return np.asarray((vectors * roots) @ vectors.conj().transpose(0, 2, 1))
