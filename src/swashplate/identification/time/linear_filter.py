"""Innovations of a linear model in gusts: filter error methods, their gain from noise of known origin.

`FilterErrors`: white noise of unknown intensity disturbs every state's rate; the sensors' noise is taken for what the
innovations have, and the steady Kalman filter of both gives the gain (Maine and Iliff 1981; Jategaonkar 2015, ch. 5).
That is n unknowns where a free gain has n m. As in Jategaonkar's program the innovations count by their variances,
without cross-correlations: on his HFB-320 the covariance that the filter predicts gives a pitch damping 30 % lower.

`GustErrors`: the air itself moves, for some seconds at a time, and acts wherever the body's velocity does, or on the
rates where a model has no velocity. Gusts that last, taken for white, bias the parameters by many times their bounds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.riccati import white_noise_gain
from swashplate.identification.core.likelihood import NOTHING, SPREAD, gust_entries
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.time.linear_likelihood import Batch, LinearErrors
from swashplate.models.linear.state_space import StateSpaceModel

VELOCITIES = ("u", "v", "w")
"""States that are velocities through the air."""

RATES = ("p", "q", "r")
"""Rates that the air turns where a model has no velocity."""

_LASTS, _MOVES, _SHAKES, _READS = 1.0, 0.3, 0.003, 0.03
"""First guesses: seconds that a gust lasts; of the air, of other white noise and of the sensors' noise, as shares of a
state's or an output's size."""


class FilterErrors(LinearErrors):
    """The likelihood of innovations under a Kalman filter's gain (arguments: `LinearErrors`)."""

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        return gust_entries(self.model.states, size)

    def _covariance(self, errors: Array) -> Array:
        return np.diag(np.diag(super()._covariance(errors)))

    def _gain(self, batch: Batch, a: Batch, c: Batch, phi: Batch, dt: float) -> Any:
        sensors = np.broadcast_to(np.diag(np.diag(self.covariance)), (len(batch), *self.covariance.shape))
        return phi @ white_noise_gain(a, self._white(batch), c, sensors, dt)[0]

    def _white(self, batch: Batch) -> Any:
        """Intensity of the white noise on every state's rate."""
        return np.exp(2.0 * batch[:, [self._place[f"gust {s}"] for s in self.model.states]])


class GustErrors(FilterErrors):
    """The likelihood of innovations where the air's velocity is a state too (arguments: `LinearErrors`).

    Each velocity of the air fades as gusts do, g' = -g / tau + noise, and acts as the body's: x' = A (x - g) + B u.
    Its deviation "air u" and time "fading u" are unknown, so is white noise on every rate and on every output. The gain
    tells their ratios; their common size is that of the innovations.
    """

    @staticmethod
    def suits(model: StateSpaceModel) -> bool:
        """Whether the model has a velocity through the air, or a rate."""
        return not {*VELOCITIES, *RATES}.isdisjoint(model.states)

    def _air(self) -> tuple[str, ...]:
        moving = [s for s in self.model.states if s in VELOCITIES] or [s for s in self.model.states if s in RATES]
        return tuple(f"air {s}" for s in moving)

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        moving = [name.split()[1] for name in self._air()]
        lasting = [(f"fading {s}", _LASTS, "nuisance", 1.0) for s in moving]
        shaking = [(f"air {s}", _MOVES * size[s], "noise", SPREAD) for s in moving]
        shaking += [(f"gust {s}", _SHAKES * size[s], "noise", SPREAD) for s in self.model.states]
        shaking += [(f"noise {o}", _READS * around, "noise", SPREAD) for o, around in spread.items()]
        return [
            Entry(name, group, float(np.log(first)), 1.0, mean=float(np.log(first)), sigma=sigma, logarithmic=True)
            for name, first, group, sigma in lasting + shaking
        ]

    def _covariance(self, errors: Array) -> Array:
        return LinearErrors._covariance(self, errors)

    def _matrices(self, numbers: Batch) -> tuple[Any, Any, Any, Any, Any]:
        a, b, c, d, h1 = super()._matrices(numbers)
        air = self._air()
        places = [self.model.states.index(name.split()[1]) for name in air]
        turned = np.eye(len(a))[:, places]  # without a velocity the air pushes at the rates themselves
        felt = np.where([name.split()[1] in RATES for name in air], turned, -a[:, places])
        fading = np.diag([-np.exp(-numbers[self._place[f"fading {name.split()[1]}"]]) for name in air])
        return (
            np.block([[a, felt], [np.zeros((len(air), len(a))), fading]]),
            np.vstack([b, np.zeros((len(air), b.shape[1]))]),
            np.hstack([c, h1 @ felt]),
            d,
            np.hstack([h1, np.zeros((len(h1), len(air)))]),
        )

    def _kalman(self, batch: Batch, a: Batch, c: Batch, dt: float) -> tuple[Any, Any]:
        moving = [name.split()[1] for name in self._air()]
        size, last = (batch[:, [self._place[f"{what} {s}"] for s in moving]] for what in ("air", "fading"))
        intensity = np.concatenate([self._white(batch), 2.0 * np.exp(2.0 * size - last)], axis=1)
        sensors = np.exp(2.0 * batch[:, [self._place[f"noise {o}"] for o in self.outputs]])
        return white_noise_gain(a, intensity, c, sensors[:, :, None] * np.eye(len(self.outputs)), dt)

    def _gain(self, batch: Batch, a: Batch, c: Batch, phi: Batch, dt: float) -> Any:
        return phi @ self._kalman(batch, a, c, dt)[0]

    def sized(self, row: Array) -> Array:
        numbers = self._stepped(row, NOTHING)
        a, _, c, _, _ = self._systems(numbers)
        spread = np.real(self._kalman(numbers, a, c, self.records[0].dt)[1][0])
        errors = np.linalg.solve(spread, self.covariance)
        larger = 0.5 * np.log(np.trace(errors) / len(spread))
        noises = [i for i, entry in enumerate(self.row.entries) if entry.group == "noise"]
        return np.asarray(row + larger * np.isin(np.arange(row.size), noises))
