"""Flight-path reconstruction finds what was put in, within its own bounds."""

from collections.abc import Mapping

import numpy as np
import pytest

from conditioning_flights import hover, tracked
from swashplate.errors import FlightError
from swashplate.flights.conditioning.condition import condition, replay
from swashplate.flights.conditioning.derive import derive
from swashplate.flights.conditioning.lever_arm import lever_arm, move_to_cg, percussion_offset
from swashplate.flights.conditioning.reconstruction import reconstruct
from swashplate.flights.conditioning.regression import regress
from swashplate.flights.conditioning.time_shift import time_shift
from swashplate.flights.flight import Flight, stream

ARM = (-0.02, 0.18, 0.04)


def test_the_lever_arm_comes_out_component_by_component() -> None:
    flight = condition(tracked(hover(30.0, 1), 1, arm=ARM), trim_ground=False, cutoff=15.0)
    found = lever_arm(flight)
    for part, true in zip((found.x, found.y, found.z), ARM, strict=True):
        assert part.significant
        assert part.value == pytest.approx(true, abs=max(3 * part.sigma, 0.003))
        assert part.sigma < 0.004
    assert found.y.equations["ax"][3] > 0.9  # coherent
    np.testing.assert_allclose(found.vector, ARM, atol=0.006)


def test_no_lever_arm_is_not_significant() -> None:
    found = lever_arm(condition(tracked(hover(30.0, 2), 2), trim_ground=False, cutoff=15.0))
    assert not any(part.significant for part in (found.x, found.y, found.z))
    assert found.vector == (0.0, 0.0, 0.0)
    assert "not significant" in str(found)


def test_the_rotors_tilt_hides_in_the_vertical_arm_as_the_formula_says() -> None:
    offset = percussion_offset(inertia=1.837e-3, hub_stiffness=0.536, thrust_moment=0.377)
    motion = hover(30.0, 3, percussion=offset)
    found = lever_arm(condition(tracked(motion, 3, arm=ARM), trim_ground=False, cutoff=15.0), percussion=offset)
    assert found.z.value == pytest.approx(ARM[2] - offset, abs=0.003)
    assert found.vertical == pytest.approx(ARM[2], abs=0.003)


def test_moving_to_the_centre_of_gravity_takes_the_arm_away() -> None:
    raw = tracked(hover(30.0, 4), 4, arm=ARM)
    flight = derive(move_to_cg(condition(raw, trim_ground=False, derive=False, cutoff=15.0), ARM))
    found = lever_arm(flight)
    assert max(abs(found.x.value), abs(found.y.value), abs(found.z.value)) < 0.006
    with pytest.raises(FlightError, match="already has u, v, w"):
        move_to_cg(flight, ARM)
    with pytest.raises(FlightError, match="three finite numbers"):
        move_to_cg(raw, (1.0, 2.0))


def test_bounds_know_the_colour_of_the_residual() -> None:
    z, plain = [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        x, noise = (np.convolve(rng.standard_normal(2000), np.ones(20) / 20, "same") for _ in range(2))
        fit = regress([(x[:, None], 2.0 * x + noise)], lag=60)
        z.append((fit.values[0] - 2.0) / fit.sigma[0])
        rest = noise - (fit.values[0] - 2.0) * x
        plain.append((fit.values[0] - 2.0) / (rest.std() / np.sqrt(x @ x)))
    assert 0.7 < np.std(z) < 1.4
    assert np.std(plain) > 2.0


def delayed(delay: float, *, gain: float, seed: int = 0) -> Flight:
    """p answers the servo after a delay; the servo answers p through a controller of that gain."""
    rng = np.random.default_rng(seed)
    n, lag = 4000, round(delay * 100)
    p, u = np.zeros(n), np.zeros(n)
    gust, excitation = (np.convolve(rng.standard_normal(n), np.ones(5) / 5, "same") for _ in range(2))
    for k in range(1, n):
        p[k] = 0.97 * p[k - 1] + 0.3 * (u[k - 1 - lag] if k > lag else 0.0) + 0.05 * gust[k]
        u[k] = 0.3 * excitation[k] * (gain == 0) - gain * p[k - 1] + 0.01 * excitation[k]
    return Flight({"uniform": stream(np.arange(n) / 100, {"servo_roll": u, "p": p})})


def test_a_delay_in_open_loop_is_found_and_feedback_is_reported() -> None:
    one, two = (time_shift(delayed(d, gain=0.0), "servo_roll", response="p") for d in (0.05, 0.15))
    assert one.identifiable
    assert two.identifiable
    assert two.lag - one.lag == pytest.approx(0.1, abs=0.01)
    loop = time_shift(delayed(0.05, gain=0.3), "servo_roll", response="p")
    assert not loop.identifiable
    assert "not identifiable" in str(loop)


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
