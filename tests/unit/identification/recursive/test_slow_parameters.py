"""Slow parameters: against the likelihood of the same filter, a change of mass, what freezes them, and their C."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, IdentificationError
from swashplate.filtering.sensor_suite import suite
from swashplate.flights.flight import Flight
from swashplate.identification.recursive.fourier_regression import CLOCK, GAP, NO_NUMBER
from swashplate.identification.recursive.slow_parameters import SlowParameters, SlowPlan, slow_plan

SENSORS = suite("mocap@100+0ms,gyro@100+0ms")
CHANNELS = ("x", "y", "z", "phi", "theta", "psi", "p", "q", "r")
MASS = 0.302


@cache
def falling(share: float) -> Flight:
    """Two seconds with the commands of hover and another mass, as the sensors read it."""
    coax, random = sp.vehicle("coax"), np.random.default_rng(2)
    about = sp.trim(coax)
    commands = np.tile(about.inputs, (200, 1))
    true = sp.simulate(coax.with_values({"mass": share * MASS}), commands, start=about, rate=100.0)
    sigma = [s for sensor in SENSORS for s in sensor.sigma]
    noisy = true.array(CHANNELS) + sigma * random.standard_normal((200, 9))
    inputs = dict(zip(coax.input_names, commands.T, strict=True))
    volts = {"voltage": np.full(200, float(about.environment.voltage))}
    return Flight.from_arrays(
        np.arange(200) * 0.01, dict(zip(CHANNELS, noisy.T, strict=True)) | inputs | volts, source="falling.nc"
    )


def run(plan: SlowPlan, flight: Flight) -> tuple[SlowParameters, float]:
    """The filter at the end, and the squared innovations on the way in units of their covariance."""
    found, total = SlowParameters(plan), 0.0
    inputs = flight.array((*plan.observer.equations.vehicle.input_names, "voltage"))
    for u, y in zip(inputs, flight.array(CHANNELS), strict=True):
        if found.step(0.01, u, y):
            total += found.surprise * len(CHANNELS)
    return found, total


def test_it_is_the_maximum_of_the_filters_own_likelihood() -> None:
    """Masses that are held, each in the filter of the whole record: the parabola of their innovations."""
    flight, coax = falling(1.1), sp.vehicle("coax")
    whole = slow_plan(coax, ("mass",), sensors=SENSORS, rate=100.0, wander=0.0, spread=0.2)
    estimate = run(whole, flight)[0].estimate()
    held = np.array([1.07, 1.1, 1.13]) * MASS
    fits = []
    for mass in held:
        plan = slow_plan(
            coax.with_values({"mass": mass}), ("mass",), sensors=SENSORS, rate=100.0, spread=1e-9, wander=0.0
        )
        plan.start.mean[: plan.observer.n] = whole.start.mean[: plan.observer.n]  # no part of what is compared
        fits.append(run(plan, flight)[1])
    curve = np.polyfit(held, fits, 2)
    best, sigma = -0.5 * curve[1] / curve[0], np.sqrt(1.0 / curve[0])
    assert estimate.values[0] == pytest.approx(best, abs=0.3 * sigma)
    assert estimate.sigmas[0] == pytest.approx(sigma, rel=0.1)
    assert abs(best - 1.1 * MASS) < 3.0 * sigma


def test_a_payload_is_found_and_the_bounds_hold() -> None:
    found = sp.track(falling(1.2), vehicle="coax", unknown=("mass",))
    value, sigma = found["mass"]
    assert abs(value - 1.2 * MASS) < 3.0 * sigma
    assert value > MASS + 5.0 * sigma
    assert "kg" in repr(found)
    assert found.followed[0].notes == ()


def test_readings_that_the_model_does_not_explain_are_told() -> None:
    flight = falling(1.0)
    shaken = flight.with_channel("p", flight.values("p") + 0.3 * np.sin(np.arange(200)), like="p")
    (one,) = sp.track(shaken, vehicle="coax", unknown=("mass",)).followed
    assert any("bounds are too narrow" in words for words in one.notes)


def test_gaps_clocks_and_inputs_that_are_none_freeze_them() -> None:
    plan = slow_plan(sp.vehicle("coax"), ("mass",), sensors=SENSORS, rate=100.0, wander=0.02)
    flight = falling(1.2)
    found, _ = run(plan, flight)
    before = found.estimate()
    u, y = np.append(plan.trim.inputs, plan.trim.environment.voltage), flight.array(CHANNELS)[50]
    for elapsed, commands, why in (
        (0.5, u, GAP),
        (-1.0, u, CLOCK),
        (float("nan"), u, CLOCK),
        (0.01, np.full(5, np.nan), NO_NUMBER),
    ):
        assert not found.step(elapsed, commands, y)
        assert found.frozen == why
        after = found.estimate()
        np.testing.assert_array_equal(after.values, before.values)
        np.testing.assert_array_equal(after.sigmas, before.sigmas)
    assert not found.step(0.01, u, y)
    assert found.step(0.01, u, np.full(9, np.nan))
    assert found.missing == 2  # both sensors
    assert found.estimate().values[0] == pytest.approx(before.values[0], rel=1e-6)
    assert found.estimate().sigmas[0] > before.sigmas[0]


def test_what_cannot_be_a_slow_parameter_is_refused() -> None:
    coax = sp.vehicle("coax")
    for changes, words in (
        ({"unknown": ("weight",)}, "weight"),
        ({"unknown": ()}, "unknown"),
        ({"unknown": ("mass", "mass")}, "unknown"),
        ({"spread": 0.0}, "spread"),
        ({"sensors": suite("mocap@50+0ms")}, "sensors"),
        ({"sensors": suite("mocap@100+10ms")}, "sensors"),
    ):
        with pytest.raises(IdentificationError, match=words):
            slow_plan(coax, **({"unknown": ("mass",), "sensors": SENSORS, "rate": 100.0} | changes))  # type: ignore[arg-type]
    flight = falling(1.0)
    inner = flight.streams[flight.stream_of("p")]
    with pytest.raises(FlightError, match="channels of no sensor"):
        sp.track(flight.with_streams({"only": inner[["p", "z"]]}), vehicle=coax, unknown=("mass",))
    with pytest.raises(FlightError, match="lacks inputs"):
        sp.track(flight.with_streams({"only": inner[list(CHANNELS)]}), vehicle=coax, unknown=("mass",))
