"""Where a fit would end, to first order: one Gauss-Newton step from the truth, at the cost of one gradient.

The gradient of a likelihood at the truth is zero on average where the likelihood is right. Over the information it is
the estimate's error to first order, with its bias and its scatter, without the ten to twenty steps of a search.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core import accuracy
from swashplate.identification.time.estimates import LAGS
from swashplate.identification.time.filter_error import FilterError


@dataclass(frozen=True)
class Step:
    """What a step says of the parameters.

    Attributes:
        error: estimate less truth.
        sigma: predicted standard deviation, corrected for coloured residuals.
    """

    error: Array
    sigma: Array

    @property
    def distance(self) -> Array:
        """Errors in predicted standard deviations."""
        return np.asarray(self.error / self.sigma)


def one_step(likelihood: FilterError, truth: Mapping[str, float], noise: Mapping[str, float]) -> Step:
    """A step from the truth.

    Args:
        likelihood: of simulated records, whose delays, trims and levers are zero.
        truth: the parameters' values.
        noise: where the noise's numbers stand, as a whole fit of another seed found them.
    """
    entries, scale = likelihood.row.entries, likelihood.row.scale
    at = {"parameter": truth.get, "nuisance": lambda name: 0.0, "noise": lambda name: np.log(noise[name])}
    row = np.array([at[entry.group](entry.name) for entry in entries], dtype=np.float64) / scale
    _, gradient, information = likelihood.scores(row)
    _, pull, prior = likelihood.row.prior(row)
    total, gradient, free = information + prior, gradient + pull, np.arange(len(row))
    step = np.zeros(len(row))
    while True:  # what would leave its bounds stays on them, as in the search
        step[:] = 0.0
        step[free] = -np.linalg.solve(total[np.ix_(free, free)], gradient[free])
        out = [i for i in free if entries[i].name.startswith("delay") and step[i] < 0.0]
        if not out:
            break
        free = np.setdiff1d(free, out)
    plain = accuracy.covariance(likelihood.row, information, prior)
    white, slopes, rest = likelihood.whitened(row)
    lags = round(LAGS / likelihood.model.dt)
    corrected = accuracy.corrected_covariance(plain, rest + prior, white, slopes, lags=lags)
    k = likelihood.row.places("parameter")
    return Step(step[k] * scale[k], np.sqrt(np.diag(corrected)[k]) * scale[k])
