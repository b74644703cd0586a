"""Flight-path reconstruction finds what was put in, within its own bounds."""

from collections.abc import Mapping

import numpy as np
import pytest

from conditioning_flights import hover, tracked
from swashplate.flights.conditioning.condition import condition, replay
from swashplate.flights.conditioning.reconstruction import reconstruct, regress
from swashplate.flights.flight import Flight, stream


def test_bounds_know_the_colour_of_the_residual() -> None:
    z, plain = [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        x, noise = (np.convolve(rng.standard_normal(2000), np.ones(20) / 20, "same") for _ in range(2))
        (value,), covariance = regress([(x[:, None], 2.0 * x + noise)], lag=60)
        z.append((value - 2.0) / np.sqrt(covariance[0, 0]))
        rest = noise - (value - 2.0) * x
        plain.append((value - 2.0) / (rest.std() / np.sqrt(x @ x)))
    assert 0.7 < np.std(z) < 1.4
    assert np.std(plain) > 2.0


BIAS = {"p": 0.02, "r": -0.03, "ax": 0.1, "az": -0.2}
SCALE = {"q": 0.05, "r": -0.02, "ay": 0.04}


def sensed_flight(bias: Mapping[str, float] = BIAS, scale: Mapping[str, float] = SCALE) -> Flight:
    """A hover of 40 s with gyroscopes, accelerometers and a pose, with errors that are known."""
    motion = hover(40.0, 9)
    turn = motion.rotation()
    omega = (turn[:-1].inv() * turn[1:]).as_rotvec() / 1e-3
    acceleration = np.gradient(np.gradient(motion.position, motion.time, axis=0), motion.time, axis=0)
    force = turn.inv().apply(acceleration - [0, 0, 9.80665])
    t = np.arange(0.5, 39.0, 0.01)
    rng = np.random.default_rng(9)

    def sensed(name: str, time: np.ndarray, truth: np.ndarray) -> np.ndarray:
        true = np.interp(t, time, truth)
        return (1 + scale.get(name, 0.0)) * true + bias.get(name, 0.0) + 0.02 * rng.standard_normal(t.size)

    channels = {n: sensed(n, motion.time[:-1] + 5e-4, omega[:, k]) for k, n in enumerate(("p", "q", "r"))}
    channels |= {n: sensed(n, motion.time, force[:, k]) for k, n in enumerate(("ax", "ay", "az"))}
    channels |= {
        n: np.interp(t, motion.time, motion.euler[:, k]) + 1e-3 * rng.standard_normal(t.size)
        for k, n in enumerate(("phi", "theta", "psi"))
    }
    channels |= {
        n: np.interp(t, motion.time, motion.position[:, k]) + 2e-4 * rng.standard_normal(t.size)
        for k, n in enumerate("xyz")
    }
    return Flight({"uniform": stream(t, channels)})


def test_biases_and_scale_factors_of_sensors() -> None:
    bias, scale = BIAS, SCALE
    found = reconstruct(sensed_flight())
    for name in ("p", "q", "r", "ax", "ay", "az"):
        for estimates, truth, floor in ((found.biases, bias, 2e-3), (found.scales, scale, 5e-3)):
            estimate = estimates[name]
            # az: bias and scale are nearly one and the same at 1 g, and its bound says so.
            assert abs(estimate.value - truth.get(name, 0.0)) < max(3.5 * estimate.sigma, floor), name
    assert found.scales["q"].significant
    assert found.biases["p"].significant
    assert not found.scales["p"].significant
    (line,) = (row for row in str(found).splitlines() if row.startswith("p "))
    assert line.endswith("bias")


def test_what_was_found_is_taken_out_of_the_flight() -> None:
    wrong, right = sensed_flight(), sensed_flight({}, {})
    found = reconstruct(wrong)
    mended = found.corrected(wrong)
    for name in ("p", "q", "r", "ax", "ay"):
        before, after = (np.std(f.values(name) - right.values(name)) for f in (wrong, mended))
        shift = abs(np.mean(mended.values(name) - right.values(name)))
        assert shift < 0.2 * abs(BIAS.get(name, 0.0)) + 4e-3, name
        assert after <= before + 1e-6, name
    again = reconstruct(mended)
    for name in ("p", "q", "r", "ax", "ay"):
        assert not again.biases[name].significant, name
        assert not again.scales[name].significant, name
    step = mended.history[-1]
    assert step.operation == "correct_sensors"
    assert replay(wrong, mended.history).values("p") == pytest.approx(mended.values("p"))
    calm = reconstruct(right)
    assert not any(e.significant for e in (calm.biases["p"], calm.biases["q"], *calm.scales.values()))
    assert abs(calm.biases["r"].value) < 5e-4  # noise of the attitude in the kinematics is not in its bound


def test_what_was_not_measured_is_said() -> None:
    found = reconstruct(condition(tracked(hover(20.0, 2), 2), trim_ground=False, cutoff=15.0))
    assert not found.biases
    assert any(note.startswith("rates: not measured") for note in found.notes)
