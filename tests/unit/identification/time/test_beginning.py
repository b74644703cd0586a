"""Where a filter begins, and how that moves with its numbers."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import POSE
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    FirstMotion,
    begun,
    begun_moved,
    steady_rows,
)
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.trim import trim


def _seen(velocity: tuple[float, float, float]) -> FirstMotion:
    value = np.array([0.1, -0.2, -10.0, 0.01, -0.02, 0.3])
    rate = np.array([velocity[0], velocity[1], velocity[2], 0.02, 0.01, -0.03])
    return FirstMotion(value, rate, np.array(velocity), np.array([12.1, 12.0]))


def _numbers(name: str) -> tuple[FilterNumbers, FilterNumbers]:
    """Numbers of a vehicle's filter, and a direction in which all of them move a little."""
    vehicle = load_vehicle(name)
    inputs = np.array([0.5 * (low + high) for low, high in vehicle.input_limits])
    nuisance = np.array(Nuisance(lever_x=0.02, lever_z=-0.1, level_psi=0.05), dtype=np.float64)
    at = FilterNumbers(*(np.array(row, dtype=np.float64) for row in (vehicle.values(), Noise(), nuisance, inputs)))
    draw = np.random.default_rng(1)
    # Each by its own size: a noise of zero is one that is not there, and no direction leads out of that.
    return at, FilterNumbers(*(1e-2 * draw.standard_normal(row.shape) * row for row in at))


def test_where_nothing_settles_the_gain_is_not_a_number() -> None:
    vehicle = load_vehicle("coax")
    at, _ = _numbers("coax")
    lost = at._replace(parameters=np.where(np.array(vehicle.parameter_names) == "mass", np.nan, at.parameters))
    found = begun(stochastic_model(vehicle, POSE, 0.01), lost, _seen((0.0, 0.0, 0.0)))
    assert np.isnan(found.gain.state).all()


@pytest.mark.parametrize(("name", "speed"), [("coax", 0.0), ("crazyflie", 0.0), ("raptor50", 0.0), ("raptor50", 10.0)])
def test_slopes_of_the_beginning_are_those_of_beginnings(name: str, speed: float) -> None:
    """Closed forms, and one step of Newton's method beside the row for the rest."""
    model = stochastic_model(load_vehicle(name), POSE, 0.01)
    (at, to), seen = _numbers(name), _seen((speed, 0.0, 0.0))
    found, step = begun_moved(model, at, seen, FilterNumbers(*(row[None] for row in to))), 1e-3
    one, back, two, far_back = (
        begun(model, FilterNumbers(*(a + factor * step * b for a, b in zip(at, to, strict=True))), seen)
        for factor in (1.0, -1.0, 2.0, -2.0)
    )
    for moved, *sides in zip(*(_parts(each) for each in (found, one, back, two, far_back)), strict=True):
        slope = (8.0 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12.0 * step)
        np.testing.assert_allclose(moved[0], slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize(("speed", "climb"), [(0.0, 0.0), (10.0, -0.5)])
def test_a_helicopter_is_linearised_about_its_trim(speed: float, climb: float) -> None:
    model = stochastic_model(raptor := load_vehicle("raptor50"), POSE, 0.01)
    flown = trim(raptor, speed=speed, climb=climb, voltage=12.0)
    at = FilterNumbers(*(np.array([row], dtype=np.float64) for row in (raptor.values(), Noise(), Nuisance(), [0.0])))
    found, _ = steady_rows(model, at.parameters, 12.0, np.array([speed, 0.0, -climb]))
    np.testing.assert_allclose(found[0], flown.state, atol=1e-10)


def _parts(begin: Begun) -> list[np.ndarray]:
    return [part for part in (*begin.gain, begin.x) if isinstance(part, np.ndarray)]
