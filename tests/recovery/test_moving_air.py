"""A CoaX that hovers under feedback in moving air, seen by cameras that its upper rotor shakes, is identified again.

The counterpart of the July flight in short: one seed; both flights and more
seeds: research/simulated_counterpart.py.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

import swashplate as sp
from swashplate.flights.flight import Flight

TRUTH = {
    "linkage_lower": 0.183, "tau_f_lower": 0.03, "o_zeta_lower": -0.069, "o_zeta_upper": -0.268, "tau_f_upper": 1.8,
    "hub_stiffness_upper": 0.163, "a_alpha_p_linear": 0.015, "a_beta_q_linear": 0.015, "a_alpha_v_linear": 0.029,
    "a_beta_u_linear": 0.029, "a_alpha_u_linear": 0.029, "a_beta_v_linear": 0.029, "gyroscopic": 0.38,
    "damping_r": 0.00275, "damping_w": 0.36, "inertia_zz": 3.17e-4, "bar_heading_transport": 1.0,
}  # fmt: skip
"""What July's fit finds, about."""
LINE = {"phi": (1.4e-3, 0.0), "theta": (1.4e-3, 0.5 * np.pi), "z": (2e-4, 1.0)}


@lru_cache(maxsize=2)
def _flight(gusts: float, line: bool) -> Flight:
    aircraft = sp.vehicle("coax").with_values(TRUTH)
    wind = lfilter([1.0], [1.0, -0.99], gusts * np.random.default_rng(101).standard_normal((2, 2001)))
    flown = sp.simulate_maneuver(
        aircraft,
        "multisine:roll+pitch+yaw+heave,0.3-4Hz,18s,0.05",
        controller=sp.hover_hold,
        lead=1,
        tail=1,
        wind={"wind_north": wind[0], "wind_east": wind[1]},
    )
    seen = sp.observe(flown, aircraft, sensors=sp.QUIET, seed=1).condition(rate=100.0, cutoff=0.0)
    streams, at = dict(seen.streams), flown.time("omega_upper")
    turned = np.cumsum(flown.values("omega_upper")) * float(np.median(np.diff(at)))
    for name, (rms, phase) in LINE.items() if line else ():
        wave = rms * np.sqrt(2.0) * np.sin(np.interp(seen.time(name), at, turned) + phase)
        stream = seen.stream_of(name)
        streams[stream] = streams[stream].assign({name: streams[stream][name] + wave})
    return replace(seen, streams=streams)


def _off(fit: sp.Result) -> dict[str, float]:
    """By how many corrected sigmas each estimate is off."""
    truth = sp.vehicle("coax").with_values(TRUTH).card.values()
    return {e.name: abs(e.value - truth[e.name]) / e.sigma_corrected for e in fit.estimates if not e.tie}


@pytest.mark.proof
def test_bounds_hold_in_moving_air_with_a_wind_and_not_without() -> None:
    """Without it tau_f_upper is tens of sigmas off; the fit says that the air may have moved."""
    seen = _flight(0.015, False)
    plain, windy = (sp.identify(sp.vehicle("coax"), seen, keep_unexcited=True, wind=wind) for wind in (False, True))
    assert any(words.startswith("gusts of ") for words in plain.problems)
    assert not any(words.startswith("gusts of ") for words in windy.problems)
    assert _off(plain)["tau_f_upper"] > 5.0
    assert np.mean([off < 2.0 for off in _off(plain).values()]) < 0.8
    assert np.mean([off < 2.0 for off in _off(windy).values()]) > 0.85
    assert windy.noise is not None
    assert float(windy.noise.wind) * np.sqrt(0.5 * float(windy.noise.tau_wind)) == pytest.approx(0.106, rel=0.2)


@pytest.mark.proof
def test_the_sensors_noise_is_right_with_the_line_and_too_large_without() -> None:
    """In still air: what the same cameras have where no rotor shakes them, within 5 %; the line within 10 %."""
    hertz = -float(sp.trim(sp.vehicle("coax").with_values(TRUTH)).states()["omega_upper"]) / (2.0 * np.pi)
    calm, white, known = (
        sp.identify(sp.vehicle("coax"), _flight(0.0, line), keep_unexcited=True, rotor_line=asked)
        for line, asked in ((False, None), (True, None), (True, hertz))
    )
    assert calm.noise is not None
    assert white.noise is not None
    assert known.noise is not None
    assert float(white.noise.sensor_angle) > 1.25 * float(calm.noise.sensor_angle)
    for name in ("sensor_angle", "sensor_position"):
        assert getattr(known.noise, name) == pytest.approx(getattr(calm.noise, name), rel=0.05)
    assert float(known.noise.line_angle) == pytest.approx(1.4e-3, rel=0.1)
    assert float(known.noise.line_height) == pytest.approx(2e-4, rel=0.1)
    related = []
    for fit in (white, known):
        (c,) = fit.comparisons
        errors = (c.record.outputs - c.model)[c.counted > 0.0]
        related.append(np.sum(errors[3:] * errors[:-3], axis=0) / np.sum(errors**2, axis=0))
    assert np.all(related[0][2:5] > 0.25)  # z, phi, theta
    assert np.all(np.abs(related[1][2:5]) < 0.1)
    inside = [off < 2.0 for off in _off(known).values()]
    assert sum(inside) >= binom.ppf(0.01, len(inside), 0.954), (
        "right bounds would have fewer inside in 1 of 100 flights"
    )
