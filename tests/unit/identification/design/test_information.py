"""Information before the flight: exact slopes, and what time, amplitude and noise make of it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.identification.design.information import Sensed, bounds_from, line_information, output_noise, sensed

UNKNOWN = ("tau_f_upper", "linkage_lower")
LINES = np.array([0.7, 2.3, 6.1])


@lru_cache(maxsize=1)
def coax() -> Sensed:
    return sensed(sp.vehicle("coax"), UNKNOWN)


@pytest.mark.parametrize("place", [0, 1])
def test_the_slopes_are_those_of_the_linear_model(place: int) -> None:
    vehicle, name = sp.vehicle("coax"), UNKNOWN[place]
    value = vehicle.card.parameters[name].value
    step = 1e-5 * value
    low, high = (sp.linearize(vehicle.with_values({name: value + s}), coax().trim) for s in (-step, step))
    moved = 0.0
    for slopes, below, above in ((coax().dA, low.A, high.A), (coax().dB, low.B, high.B)):
        by_difference = (above - below) / (2.0 * step)
        moved = max(moved, float(np.abs(by_difference).max()))
        np.testing.assert_allclose(
            slopes[:, :, place], by_difference, atol=1e-5 * max(1.0, np.abs(by_difference).max())
        )


def test_the_slopes_of_a_structure_are_those_of_its_parameters() -> None:
    """Of a model of named expressions the unknowns have the file's names, and all entries that they move are moved."""
    vehicle = sp.vehicle("hybrid")
    found = sensed(vehicle, ("tau_f", "Blat"))
    value = vehicle.numbers["tau_f"].value
    late, soon = (sp.linearize(vehicle.with_values({"tau_f": value + s}), found.trim) for s in (1e-6, -1e-6))
    for slopes, above, below in ((found.dA, late.A, soon.A), (found.dB, late.B, soon.B)):
        np.testing.assert_allclose(slopes[:, :, 0], (above - below) / 2e-6, rtol=1e-5, atol=1e-4)
    assert np.abs(found.dA[:, :, 0]).max() > 1.0


def told(amplitude: float = 1.0, noise: Noise | None = None) -> np.ndarray:
    inputs = amplitude * np.tile([0.0, 0.0, 1.0, 0.3j], (3, 1))
    return line_information(coax(), LINES, inputs, noise or Noise(), rate=100.0)


def test_information_is_of_the_square_of_amplitude_and_falls_with_noise() -> None:
    size = np.abs(told()).max()
    np.testing.assert_allclose(told(3.0), 9.0 * told(), rtol=1e-9, atol=1e-12 * size)
    twice = Noise(*(2.0 * float(v) if n.startswith(("white", "gust", "drift", "sensor")) else v
                    for n, v in Noise()._asdict().items()))  # fmt: skip
    np.testing.assert_allclose(told(noise=twice), 0.25 * told(), rtol=1e-6, atol=1e-12 * size)
    for one in told():
        assert np.all(np.linalg.eigvalsh(one / np.sqrt(np.outer(np.diag(one), np.diag(one)))) > -1e-9)


def test_the_noise_of_a_fast_line_is_the_sensors() -> None:
    noise = Noise()
    found = output_noise(coax(), np.array([45.0]), noise, rate=100.0)[0]
    assert found[0, 0].real == pytest.approx(noise.sensor_position**2 / 100.0, rel=0.01)
    slow = output_noise(coax(), np.array([0.2]), noise, rate=100.0)[0]
    assert slow[0, 0].real > 100.0 * found[0, 0].real  # gusts


@pytest.mark.parametrize(
    ("own", "louder", "same"), [("drift_yaw", 5, 2), ("drift_vertical", 2, 5), ("sensor_heading", 5, 2)]
)
def test_yaw_and_heave_may_have_noise_of_their_own(own: str, louder: int, same: int) -> None:
    """What is zero is shared, as in the likelihoods."""
    usual, loud = (output_noise(coax(), LINES, n, rate=100.0) for n in (Noise(), Noise()._replace(**{own: 30.0})))
    assert np.all(loud[:, louder, louder].real > 1.1 * usual[:, louder, louder].real)
    np.testing.assert_allclose(loud[:, same, same], usual[:, same, same], rtol=0.05)


def test_bounds_know_what_nothing_tells() -> None:
    np.testing.assert_allclose(bounds_from(np.diag([4.0, 100.0, 0.0])), [0.5, 0.1])
    assert bounds_from(np.diag([4.0, 0.0, 1.0]))[1] == np.inf
    together = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert np.all(np.isinf(bounds_from(together)))


def test_what_cannot_be_designed_for_is_refused() -> None:
    with pytest.raises(IdentificationError, match="nose_colour: is no parameter of 'coax'"):
        sensed(sp.vehicle("coax"), ["tau_f_upper", "nose_colour"])
    with pytest.raises(IdentificationError, match="names nothing"):
        sensed(sp.vehicle("coax"), [])
