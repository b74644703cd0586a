"""What a blade-element model of a helicopter misses in its derivatives, as published helicopters have shown it.

A card may be right in every number, and its derivatives are still off: wake on the fuselage, interference, blades that
bend, inflow that is slower or uneven. How far off is measured: derivatives of four helicopters of which the geometry is
known, held against published ones (`tests/oracle/test_model_error.py` has the sources and works these numbers out).
Two are from flights of small helicopters, two from larger models of full-size ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from swashplate.arrays import Array
from swashplate.models.conventional.derivative_table import COLUMNS, ROWS, split_name

MEASURED: Mapping[str, Mapping[str, float]] = {
    "heave": {"UH-60A": 0.05, "Lynx": 0.03, "R-50": 0.37, "HeLion": 0.02},
    "forces by speed": {"UH-60A": 0.33, "Lynx": 0.15, "R-50": 0.54, "HeLion": 1.57},
    "roll and pitch by speed": {"Lynx": 0.07, "R-50": 1.31, "HeLion": 0.69},
    "roll and pitch by rates": {"UH-60A": 0.49, "Lynx": 0.03, "HeLion": 1.06},
    "yaw and tail rotor": {"UH-60A": 0.28, "Lynx": 0.14},
    "other controls": {"Lynx": 0.02},
}
"""Root mean square of published less ours, over ours, by kind of derivative and helicopter."""

_QUANTILES = (np.arange(40) + 0.5) / 40
"""Of the model's error, where samples of a card are multiplied by it."""


@dataclass(frozen=True)
class ModelError:
    """How far a kind of derivative is off.

    Attributes:
        kind: of the derivative. sigma: standard deviation over the value; NaN where no helicopter told it.
        vehicles: how many helicopters told it.
    """

    kind: str
    sigma: float
    vehicles: int

    def widened(self, samples: Array) -> tuple[float, float]:
        """5 % and 95 % quantiles of samples of a derivative (n,) that is off by this, too.

        So few helicopters tell a standard deviation that the error has Student's distribution, with one degree of
        freedom for each. Where none told it, the samples' own quantiles.
        """
        factors = np.ones(1)
        if self.vehicles:
            factors = 1.0 + self.sigma * stdtrit(self.vehicles, _QUANTILES)
        low, high = np.quantile(np.outer(samples, factors), [0.05, 0.95])
        return float(low), float(high)


def model_error(name: str, *, without: str = "") -> ModelError:
    """The model's error of a derivative.

    Args:
        name: of the derivative, as "Lp". without: a helicopter that is not to be counted, so that it can judge.

    Raises:
        SwashError: where there is no such derivative.
    """
    kind = kind_of(name)
    told = [value for vehicle, value in MEASURED[kind].items() if vehicle != without]
    sigma = float(np.sqrt(np.mean(np.square(told)))) if told else float("nan")
    return ModelError(kind, sigma, len(told))


def kind_of(name: str) -> str:
    """The kind of a derivative, a key of `MEASURED`.

    Raises:
        SwashError: where there is no such derivative.
    """
    place = split_name(name)
    row, column = ROWS[place[0]], COLUMNS[place[1]]
    if row == "Z" and column in ("w", "theta0"):
        return "heave"
    if row == "N" or column == "theta0T" or (row, column) == ("Y", "r"):
        return "yaw and tail rotor"
    if column in ("u", "v", "w"):
        return "forces by speed" if row in "XYZ" else "roll and pitch by speed"
    return "roll and pitch by rates" if column in ("p", "q", "r") else "other controls"
