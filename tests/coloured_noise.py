"""Stationary noise of many spectra, as loops and gusts make it, for tests that count false alarms."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from swashplate.arrays import Array

FASTEST = 60.0
"""Hz: resonances lie below 0.4 of the rate, or of this where the rate is higher."""
_SETTLED = 2000  # samples


def resonance(random: np.random.Generator, count: int, *, rate: float, hertz: float, damping: float) -> Array:
    """White noise through a second-order system, of unit size, shape (count,)."""
    omega = 2.0 * np.pi * hertz / rate
    radius = np.exp(-damping * omega)
    poles = [1.0, -2.0 * radius * np.cos(omega * np.sqrt(1.0 - damping**2)), radius**2]
    made = lfilter([1.0, -random.choice([0.0, 1.0])], poles, random.standard_normal(count + _SETTLED))[_SETTLED:]
    return np.asarray(made / np.std(made))


def coloured(random: np.random.Generator, count: int, *, rate: float) -> Array:
    """Noise of a random spectrum and unit size, shape (count,): one resonance or two, a low-pass, or white."""

    def one() -> Array:
        hertz = np.exp(random.uniform(np.log(0.1), np.log(0.4 * min(rate, FASTEST))))
        return resonance(random, count, rate=rate, hertz=hertz, damping=np.exp(random.uniform(np.log(0.03), -0.1)))

    kind = random.integers(0, 5)
    if kind == 0:
        made = random.standard_normal(count)
    elif kind == 1:
        keep = np.exp(-2.0 * np.pi * np.exp(random.uniform(np.log(0.1), np.log(4.0))) / rate)
        made = lfilter([1.0], [1.0, -keep], random.standard_normal(count + _SETTLED))[_SETTLED:]
    elif kind == 2:
        made = one() + np.exp(random.uniform(-1.0, 1.0)) * one()
    else:
        made = one()
    return np.asarray(made / np.std(made))
