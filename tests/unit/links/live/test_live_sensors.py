"""What the page's pilot reads: as the filter that identified the sensors has it, and as the code in the page does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from swashplate.engine.equations import equations_of
from swashplate.filtering.disturbed_model import StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.links.live.sensors import BODY, PLACED, TrackedSensors, sensors_of, traced_sensors
from swashplate.links.live.world import World
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Euler, Vector, body_to_local, euler_rates

PLACE, ANGLES = ("x", "y", "z"), ("phi", "theta", "psi")
RECORD = dict(zip(PLACED, (0.02, -0.01, -0.05, 0.03, -0.02, 0.2), strict=True))


def identified() -> Vehicle:
    coax = sp.vehicle("coax")
    noise = {"sensor_position": 3e-4, "sensor_angle": 1.5e-3, "sensor_heading": 2e-3, "sensor_rate": 0.04}
    return coax.with_card(replace(coax.card, observer={"nuisance": RECORD, "noise": noise}))


@pytest.fixture
def state() -> np.ndarray:
    """Somewhere in flight."""
    return np.random.default_rng(3).normal(0.0, 0.3, len(sp.vehicle("coax").state_names))


def test_they_show_what_the_fit_s_filter_measures(state: np.ndarray) -> None:
    vehicle, names = identified(), (*PLACE, *ANGLES, "p", "q", "r")
    model = StochasticModel(equations_of(vehicle), names, 0.01)
    measured = model.measure(state, Nuisance()._replace(**RECORD), FloatBackend())
    found = sensors_of(vehicle).read(state)
    np.testing.assert_array_equal(found[[vehicle.index(name) for name in names]], measured)
    np.testing.assert_array_equal(found[BODY:], state[BODY:])


def test_their_velocity_is_that_of_the_tracked_place(state: np.ndarray) -> None:
    """By differences along a motion with the state's velocity and rates."""
    sensors, step = sensors_of(identified()), 1e-6
    attitude = Euler(*state[6:9])
    moving = [*body_to_local(Vector(*state[3:6]), attitude, FloatBackend())]
    turning = [*euler_rates(Vector(*state[9:12]), attitude, FloatBackend())]
    away = np.concatenate([moving, np.zeros(3), turning, np.zeros(state.size - 9)])
    ends = [sensors.read(state + sign * step * away)[:3] for sign in (1.0, -1.0)]
    shown = sensors.read(state)
    velocity = body_to_local(Vector(*shown[3:6]), Euler(*shown[6:9]), FloatBackend())
    np.testing.assert_allclose([*velocity], (ends[0] - ends[1]) / (2.0 * step), atol=1e-8)


def test_the_page_s_code_reads_the_same(state: np.ndarray) -> None:
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    sensors = sensors_of(identified())
    found = np.asarray(traced_sensors()(state[:BODY], sensors.placed))[:, 0]
    np.testing.assert_allclose(found, sensors.read(state)[:BODY], rtol=1e-13)


def test_they_say_which_fly(state: np.ndarray) -> None:
    world = World(identified(), draws=[sp.vehicle("coax")])
    assert str(world.sensors[0]) == (
        "identified sensors: a point (20, -10, -50) mm ahead, right and below, axes turned by (1.7, -1.1, 11.5) deg in "
        "roll, pitch and heading; noise 0.3 mm, 1.5 mrad (heading 2), rates 40 mrad/s, velocities none"
    )
    assert world.sensors[1] == TrackedSensors() == sensors_of(sp.vehicle("coax"))
    assert "the true states" in str(world.sensors[1])
    np.testing.assert_array_equal(world.sensors[1].read(state), state)
    own = World(identified(), controller=sp.design_controller(sp.vehicle("coax")).controller)
    assert not own.pilot.reads
    assert own.sensors == [TrackedSensors()], "it was designed with sensors of its own"
