"""Gusts: Dryden turbulence as series of wind for one vehicle or many (MIL-F-8785C, 1980, sec. 3.7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg

from swashplate.arrays import Array
from swashplate.errors import SwashError


@dataclass(frozen=True)
class Gusts:
    """A setting of the turbulence.

    Attributes:
        sigma: standard deviations along the mean wind, across it and down [m/s].
        length: scale lengths in the same order [m].
        speed: of the air past the aircraft [m/s]; a hovering one is passed by the mean wind.
    """

    sigma: tuple[float, float, float]
    length: tuple[float, float, float]
    speed: float


INDOOR = Gusts((0.15, 0.15, 0.1), (1.0, 1.0, 1.0), 0.5)
"""A room with ventilation and the rotor's own recirculation; assumed, no standard speaks of rooms."""


def indoor(sigma: float) -> Gusts:
    """`INDOOR` at another strength: `sigma` m/s along and across, two thirds of it down, as large as the room.

    Raises:
        SwashError: for a strength that is not positive.
    """
    if not 0.0 < sigma < 20.0:
        raise SwashError(f"gusts of {sigma:g} m/s in a room: expected more than 0 and less than 20.")
    share = sigma / INDOOR.sigma[0]
    along, across, down = (share * part for part in INDOOR.sigma)
    return Gusts((along, across, down), INDOOR.length, INDOOR.speed)


def outdoor(mean: float, *, height: float = 10.0) -> Gusts:
    """Low-altitude Dryden (MIL-F-8785C, sec. 3.7.3.4) for a mean wind of `mean` m/s at 6 m and a height [m]."""
    if mean <= 0.0 or not 0.0 < height < 300.0:
        raise SwashError(f"{mean:g} m/s at {height:g} m: expected a wind above zero and a height below 300 m.")
    feet = max(height, 3.05) / 0.3048
    ratio = 0.177 + 0.000823 * feet
    vertical = 0.1 * mean
    across, scale = vertical / ratio**0.4, feet / ratio**1.2 * 0.3048
    return Gusts((across, across, vertical), (scale, scale, feet * 0.3048), mean)


def dryden(gusts: Gusts, *, samples: int, rate: float, seed: int, count: int = 1) -> dict[str, Array]:
    """Turbulence blowing from the south (the mean itself is not in it), shape (samples, count) each.

    Along: sigma sqrt(2 L / pi V) / (1 + T s); across and down: sigma sqrt(L / pi V) (1 + sqrt3 T s) / (1 + T s)^2, with
    T = L / V. Sampled exactly: states start in their stationary distribution and step by their own covariance.

    Args:
        gusts: the setting, `INDOOR` or `outdoor(...)`.
        samples: how many.
        rate: per second [Hz].
        seed: of the noise.
        count: how many independent series.
    """
    random = np.random.default_rng(seed)
    turbulence = {}
    for name, part in zip(_NAMES, filters_of_gusts(gusts, rate), strict=True):
        x = part.start @ random.standard_normal((part.step.shape[0], count))
        series = np.empty((samples, count))
        coming, shaken = _block(part)
        for k in range(0, samples, _BLOCK):
            size = min(_BLOCK, samples - k)
            noise = random.standard_normal((size, *x.shape)).reshape(-1, count)
            states = coming[: size * len(x)] @ x + shaken[: size * len(x), : len(noise)] @ noise
            series[k], x = part.output @ x, states[-len(x) :]
            series[k + 1 : k + size] = part.output @ states[: -len(x)].reshape(size - 1, len(x), count)
        turbulence[name] = series
    return turbulence


_BLOCK = 64
"""Samples in one product; a step of two states alone is some calls of numpy."""


def _block(part: GustFilter) -> tuple[Array, Array]:
    """The next states, one below the other, from the state at the start of a block and from its noise."""
    n = len(part.step)
    powers = [np.eye(n)]
    for _ in range(_BLOCK):
        powers.append(part.step @ powers[-1])
    shaken = np.zeros((_BLOCK, n, _BLOCK, n))
    for k in range(_BLOCK):
        for j in range(k + 1):
            shaken[k, :, j] = powers[k - j] @ part.noise
    return np.concatenate(powers[1:]), shaken.reshape(_BLOCK * n, _BLOCK * n)


_NAMES = ("wind_north", "wind_east", "wind_down")


class GustFilter(NamedTuple):
    """White noise to one component: `x -> step x + noise n`, out comes `output x`; `start` makes the first x."""

    step: Array
    noise: Array
    output: Array
    start: Array


def filters_of_gusts(gusts: Gusts, rate: float) -> list[GustFilter]:
    """The filters of wind towards north, east and down, for `rate` samples a second."""
    filters = []
    for i, (sigma, length) in enumerate(zip(gusts.sigma, gusts.length, strict=True)):
        T = length / gusts.speed
        if i == 0:
            A, c = np.array([[-1.0 / T]]), np.array([1.0])
        else:
            A = np.array([[0.0, 1.0], [-1.0 / T**2, -2.0 / T]])
            c = np.array([1.0, np.sqrt(3.0) * T])
        b = np.zeros((A.shape[0], 1))
        b[-1] = 1.0
        P = scipy.linalg.solve_continuous_lyapunov(A, -b @ b.T)
        P *= sigma**2 / (c @ P @ c)
        step = scipy.linalg.expm(A / rate)
        filters.append(GustFilter(step, _root(P - step @ P @ step.T), c, _root(P)))
    return filters


def _root(P: Array) -> Array:
    """A square root of a covariance that may have lost rank to rounding."""
    values, vectors = np.linalg.eigh(0.5 * (P + P.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)), dtype=np.float64)
