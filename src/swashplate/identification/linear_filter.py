"""Innovations of a linear model in gusts: the filter error method, its gain from noise of known origin.

Every state's rate is disturbed by white noise and every output measured with noise; their intensities are unknown, and
the steady Kalman filter of these gives the gain (Maine and Iliff 1981; Jategaonkar 2015, ch. 5). That is n + m unknowns
where a free gain has n m. As in Jategaonkar's program the innovations count by the variances that they have, without
cross-correlations: on his HFB-320 the covariance that the filter predicts gives a pitch damping 30 % lower.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import expm

from swashplate.flights.flight import Array
from swashplate.identification.linear_likelihood import OutputErrors
from swashplate.identification.riccati import kalman_gain
from swashplate.identification.rows import Entry
from swashplate.simulation.dynamics import enable_double_precision

_GUST, _SENSOR = 0.3, 0.1
"""First guesses: share of a state's size by which its rate is disturbed, share of an output's that is noise."""

_SPREAD = 2.0
"""Of the prior on the logarithm of each: a factor of seven either way."""


class FilterErrors(OutputErrors):
    """The likelihood of innovations under a Kalman filter's gain (arguments: `OutputErrors`)."""

    def _noise_entries(self, size: dict[str, float], spread: dict[str, float]) -> list[Entry]:
        first = {f"gust {s}": _GUST * size[s] for s in self.model.states}
        first |= {f"sensor {o}": _SENSOR * spread[o] for o in self.outputs}
        return [
            Entry(name, "noise", log, 1.0, mean=log, sigma=_SPREAD, logarithmic=True)
            for name, value in first.items()
            for log in (float(np.log(value)),)
        ]

    def _covariance(self, errors: Array) -> Array:
        return np.diag(np.diag(super()._covariance(errors)))

    def _gain(self, batch: Any, a: Any, c: Any, phi: Any, dt: float) -> Any:
        # Only the ratios of all intensities tell on the gain; wide priors hold what they have in common.
        intensity = np.exp(2.0 * batch[:, [self._place[f"gust {s}"] for s in self.model.states]])
        n = a.shape[1]
        # Noise gathered over one sample, integral of e^(As) W e^(A's) (Van Loan 1978).
        block = np.zeros((len(batch), 2 * n, 2 * n), dtype=np.complex128)
        block[:, :n, :n], block[:, n:, n:] = -a, a.transpose(0, 2, 1)
        block[:, :n, n:] = intensity[:, :, None] * np.eye(n)
        gathered = np.einsum("pij,pjk->pik", phi, expm(block * dt)[:, :n, n:])
        sensor = np.exp(2.0 * batch[:, [self._place[f"sensor {o}"] for o in self.outputs]])
        gain, _ = _gains()(phi, c, gathered, sensor[:, :, None] * np.eye(sensor.shape[1]))
        return np.einsum("pij,pjk->pik", phi, np.asarray(gain))


@cache
def _gains() -> Any:
    """Kalman gains of a batch, compiled for its shapes."""
    import jax

    enable_double_precision()
    return jax.jit(jax.vmap(kalman_gain))
