"""How well a fit tells the modes of its model: bounds of the parameters carried to frequencies and dampings.

Two parameters may be told badly and their mode well, or the other way round; what a reader wants is the mode. A simple
eigenvalue moves by d lambda = w' dA v / (w' v) with its left and right eigenvectors w and v (Wilkinson 1965, ch. 2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from swashplate.arrays import Array, Complex
from swashplate.models.linear.state_space import StateSpaceModel

_STEP = 1e-5

_ORIGIN = 1e-6
"""1/s; an integrator's eigenvalue is zero but for rounding, and no mode."""


@dataclass(frozen=True)
class ModeAccuracy:
    """One real eigenvalue or one conjugate pair.

    Attributes:
        eigenvalue: with the positive imaginary part [1/s].
        frequency: its modulus [rad/s]. damping: ratio; 1 for a real mode that fades, -1 for one that grows.
        frequency_bound, damping_bound: standard deviations; infinite where a parameter behind them is not told.
        inside: whether the mode lies above the lowest fitted frequency.
    """

    eigenvalue: complex
    frequency: float
    damping: float
    frequency_bound: float
    damping_bound: float
    inside: bool

    @property
    def frequency_percent(self) -> float:
        return 100.0 * self.frequency_bound / self.frequency if self.frequency else float("inf")

    def to_document(self) -> dict[str, float | bool]:
        return {
            "real": self.eigenvalue.real,
            "imag": self.eigenvalue.imag,
            "frequency": self.frequency,
            "damping": self.damping,
            "frequency_bound": self.frequency_bound,
            "damping_bound": self.damping_bound,
            "inside_band": self.inside,
        }


def mode_accuracy(
    model: StateSpaceModel, bounds: Mapping[str, float], correlation: Array, *, lowest: float
) -> tuple[ModeAccuracy, ...]:
    """The modes of an identified model with their bounds, fastest first; integrators are none.

    Args:
        model: with its numbers.
        bounds: standard deviations of the free parameters, in the order of `correlation` (n, n).
        lowest: fitted frequency [rad/s].
    """
    a = model.explicit()[0]
    # Left eigenvectors not by inversion: two integrators in series make `right` singular.
    values, left, right = eig(a, left=True)
    left = left.conj().T
    length = np.sum(left.T * right, axis=0)
    left = left / np.where(np.abs(length) > np.finfo(float).tiny, length, 1.0)[:, None]
    slopes = _root_slopes(model, tuple(bounds), left, right)
    known = np.isfinite(np.array(list(bounds.values())))
    size = np.where(known, list(bounds.values()), 0.0)
    covariance = np.outer(size, size) * np.nan_to_num(correlation)
    modes = []
    for k in np.argsort(-np.abs(values), kind="stable"):
        v = complex(values[k])
        if v.imag < 0.0 or abs(v) < _ORIGIN:
            continue
        # Of the modulus and of -Re / modulus.
        frequency = (np.conj(v) * slopes[k]).real / abs(v)
        damping = -slopes[k].real / abs(v) + v.real / abs(v) ** 2 * frequency
        blind = bool(np.any(np.abs(slopes[k][~known]) > 0.0))
        bound = [np.inf if blind else float(np.sqrt(max(s @ covariance @ s, 0.0))) for s in (frequency, damping)]
        modes.append(ModeAccuracy(v, abs(v), -v.real / abs(v), bound[0], bound[1], bool(abs(v) >= lowest)))
    return tuple(modes)


def _root_slopes(model: StateSpaceModel, names: Sequence[str], left: Complex, right: Complex) -> Complex:
    """Derivatives of the eigenvalues by the parameters, shape (n_states, n_parameters)."""
    columns = []
    for name in names:
        value = model.parameters[name].value
        step = _STEP * max(abs(value), 1e-3)
        up, down = (model.with_values({name: value + sign * step}).explicit()[0] for sign in (1.0, -1.0))
        columns.append(np.einsum("ij,jk,ki->i", left, (up - down) / (2.0 * step), right))
    return np.stack(columns, axis=1) if columns else np.zeros((left.shape[0], 0), dtype=np.complex128)
