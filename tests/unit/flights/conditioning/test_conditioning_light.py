"""What a look at a log uses instead of SciPy's filters gives the same numbers as these."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.signal import savgol_filter

from swashplate.flights.conditioning.derive import differentiate
from swashplate.flights.conditioning.filters import filtered, within


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    return np.random.default_rng(0).standard_normal((4000, 2)).cumsum(axis=0)


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_are_savitzky_and_golays(walk: np.ndarray, order: int) -> None:
    wanted = savgol_filter(walk, 5, 4, deriv=order, delta=0.01, axis=0, mode="interp")
    np.testing.assert_allclose(differentiate(walk, rate=100.0, order=order), wanted, atol=1e-12 * np.abs(wanted).max())
    alone = differentiate(walk[:, 0], rate=100.0, order=order)
    np.testing.assert_allclose(alone, wanted[:, 0], atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize("rate", [25.0, 100.0])
def test_a_band_is_the_filters_away_from_the_ends(walk: np.ndarray, rate: float) -> None:
    wanted = filtered(walk, rate=rate, cutoff=(0.2, 3.0), order=2)
    middle = slice(int(10 * rate), -int(10 * rate))
    made = within(walk, rate=rate, band=(0.2, 3.0))
    np.testing.assert_allclose(made[middle], wanted[middle], atol=1e-3 * np.abs(wanted).max())
    assert np.abs(within(walk, rate=rate, band=(0.1, 0.8))[middle] - wanted[middle]).max() > 0.1


def test_looking_at_a_log_and_conditioning_it_load_nothing_heavy() -> None:
    code = (
        "import sys, numpy as np, swashplate as sp\n"
        "t = np.arange(0.0, 40.0, 0.01)\n"
        "phi, p = 0.1 * np.sin(3.0 * t), -0.3 * np.cos(3.0 * t)\n"
        "flight = sp.Flight.from_arrays(t, {'phi': phi, 'theta': 0.0 * t, 'p': p})\n"
        "print(any('other sign' in problem for problem in sp.inspect(flight).problems))\n"
        "flight.condition(rate=100.0, cutoff=8.0, check=False)\n"
        "heavy = ('scipy.signal', 'scipy.stats', 'scipy.optimize', 'scipy.interpolate', 'dask', 'jax')\n"
        "print([name for name in heavy if name in sys.modules])\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ran.stdout.splitlines() == ["True", "[]"], ran.stdout + ran.stderr
