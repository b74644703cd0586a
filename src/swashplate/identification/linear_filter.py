"""Innovations of a linear model in gusts: the filter error method, its gain from noise of known origin.

White noise of unknown intensity disturbs every state's rate; the sensors' noise is taken for what the innovations have,
and the steady Kalman filter of both gives the gain (Maine and Iliff 1981; Jategaonkar 2015, ch. 5). That is n unknowns
where a free gain has n m. As in Jategaonkar's program the innovations count by their variances, without
cross-correlations: on his HFB-320 the covariance that the filter predicts gives a pitch damping 30 % lower.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import expm

from swashplate.flights.flight import Array
from swashplate.identification.linear_likelihood import OutputErrors
from swashplate.identification.riccati import kalman_gain
from swashplate.identification.rows import Entry
from swashplate.identification.time_likelihood import gust_entries
from swashplate.simulation.dynamics import enable_double_precision


class FilterErrors(OutputErrors):
    """The likelihood of innovations under a Kalman filter's gain (arguments: `OutputErrors`)."""

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        return gust_entries(self.model.states, size)

    def _covariance(self, errors: Array) -> Array:
        return np.diag(np.diag(super()._covariance(errors)))

    def _gain(self, batch: Any, a: Any, c: Any, phi: Any, dt: float) -> Any:
        intensity = np.exp(2.0 * batch[:, [self._place[f"gust {s}"] for s in self.model.states]])
        n = a.shape[1]
        # Noise gathered over one sample, integral of e^(As) W e^(A's) (Van Loan 1978).
        block = np.zeros((len(batch), 2 * n, 2 * n), dtype=np.complex128)
        block[:, :n, :n], block[:, n:, n:] = -a, a.transpose(0, 2, 1)
        block[:, :n, n:] = intensity[:, :, None] * np.eye(n)
        gathered = np.einsum("pij,pjk->pik", phi, expm(block * dt)[:, :n, n:])
        sensors = np.broadcast_to(self.covariance.astype(np.complex128), (len(batch), *self.covariance.shape))
        gain, _ = _gains()(phi, c, gathered, sensors)
        return np.einsum("pij,pjk->pik", phi, np.asarray(gain))


@cache
def _gains() -> Any:
    """Kalman gains of a batch, compiled for its shapes."""
    import jax

    enable_double_precision()
    return jax.jit(jax.vmap(kalman_gain))
