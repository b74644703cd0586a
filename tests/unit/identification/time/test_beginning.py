"""Where a filter begins, by NumPy, against the same as JAX traces and differentiates it."""

from __future__ import annotations

import jax
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
    traced_begin,
)
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.compilation import QUICK_TO_COMPILE
from swashplate.simulation.dynamics import enable_double_precision


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


def _agrees(found: Begun, expected: Begun, *, relative: float) -> None:
    for ours, theirs in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
        exact = np.asarray(theirs)
        np.testing.assert_allclose(ours, exact, rtol=relative, atol=relative * np.abs(exact).max())


def test_where_nothing_settles_the_gain_is_not_a_number() -> None:
    enable_double_precision()
    vehicle = load_vehicle("coax")
    at, _ = _numbers("coax")
    lost = at._replace(parameters=np.where(np.array(vehicle.parameter_names) == "mass", np.nan, at.parameters))
    found = begun(stochastic_model(vehicle, POSE, 0.01), lost, _seen((0.0, 0.0, 0.0)))
    assert np.isnan(found.gain.state).all()


@pytest.mark.proof
@pytest.mark.parametrize(("name", "speed"), [("coax", 0.0), ("crazyflie", 0.0), ("raptor50", 0.0), ("raptor50", 10.0)])
def test_the_beginning_and_its_slopes_are_those_that_jax_finds(name: str, speed: float) -> None:
    """Closed forms, and Newton's method at the row with one step beside it for the rest."""
    enable_double_precision()
    model = stochastic_model(load_vehicle(name), POSE, 0.01)
    (at, to), seen = _numbers(name), _seen((speed, 0.0, 0.0))

    def traced(numbers: FilterNumbers) -> Begun:
        return traced_begin(model, numbers, seen)

    both = jax.jit(lambda p, d: jax.jvp(traced, (p,), (d,)), compiler_options=QUICK_TO_COMPILE)
    expected, expected_moved = both(at, to)
    _agrees(begun(model, at, seen), expected, relative=1e-9)
    moved = begun_moved(model, at, seen, FilterNumbers(*(row[None] for row in to)))
    _agrees(jax.tree.map(lambda part: part[0], moved), expected_moved, relative=1e-6)
