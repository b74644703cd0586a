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

from swashplate.arrays import Array
from swashplate.filtering.riccati import kalman_gain
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.time_likelihood import gust_entries
from swashplate.identification.time.linear_likelihood import OutputErrors
from swashplate.simulation.dynamics import enable_double_precision
from swashplate.simulation.gathered_noise import gathered_noise


class FilterErrors(OutputErrors):
    """The likelihood of innovations under a Kalman filter's gain (arguments: `OutputErrors`)."""

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        return gust_entries(self.model.states, size)

    def _covariance(self, errors: Array) -> Array:
        return np.diag(np.diag(super()._covariance(errors)))

    def _gain(self, batch: Any, a: Any, c: Any, phi: Any, dt: float) -> Any:
        intensity = np.exp(2.0 * batch[:, [self._place[f"gust {s}"] for s in self.model.states]])
        gain = _gains()(a, intensity, c, self.covariance.astype(np.complex128), dt)
        return np.einsum("pij,pjk->pik", phi, np.asarray(gain))


@cache
def _gains() -> Any:
    """Kalman gains of a batch, compiled for its shapes."""
    import jax
    import jax.numpy as jnp

    enable_double_precision()

    def gain(a: Any, intensity: Any, c: Any, sensors: Any, dt: Any) -> Any:
        phi, gathered = gathered_noise(a, jnp.diag(intensity), dt)
        return kalman_gain(phi, c, gathered, sensors)[0]

    return jax.jit(jax.vmap(gain, in_axes=(0, 0, 0, None, None)))
