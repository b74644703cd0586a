"""A vehicle stepped from outside against the compiled simulation, and what it tells its sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import swashplate as sp
from link_bench import QUICK, PlainFloats
from swashplate.errors import DivergenceError
from swashplate.models.catalogue import vehicle
from swashplate.models.nesting import rebuild
from swashplate.models.surroundings import environment_of
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.standing import at_rest, skids_of, standing
from swashplate.simulation.stepping import MakeEngine, Stepping


@pytest.mark.parametrize(
    ("name", "options"),
    [pytest.param("raptor50", {"rotor_speed": "throttle"}, marks=pytest.mark.proof), ("coax", {})],
    ids=["raptor50", "coax"],
)
def test_steps_are_those_of_the_simulation(name: str, options: dict[str, object]) -> None:
    flown = vehicle(name, **options)
    around = environment_of(flown, Environment(1.0, -0.5, 0.2))
    hover = sp.trim(flown, environment=around)
    random = np.random.default_rng(0)
    inputs = np.array(hover.inputs) + 0.01 * random.standard_normal((41, len(hover.inputs)))
    inputs = np.clip(inputs, *np.array(flown.input_limits).T)
    truth = sp.simulate(flown, inputs, start=hover, rate=200.0, substeps=10, environment=around)
    stepping = Stepping(flown, np.array(hover.state), around)
    for row in inputs[:-1]:
        told = stepping.advance(row, 1.0 / 200.0)
    np.testing.assert_allclose(told.states, truth.array(flown.state_names)[-1], rtol=1e-11, atol=1e-11)

    # The specific force by the vehicle's own sum of forces, and the velocity by its own rotation.
    nested = rebuild(flown.state, told.states)
    commands = flown.inputs(*inputs[-2].tolist())
    felt = flown.specific_force(nested, commands, flown.values(), around, FloatBackend())
    np.testing.assert_allclose(told.force, felt, rtol=1e-9, atol=1e-9)
    turned = Rotation.from_euler("ZYX", [told.body.psi, told.body.theta, told.body.phi])
    np.testing.assert_allclose(told.velocity, turned.apply(told.body[3:6]), atol=1e-12)


def test_inputs_are_cut_and_surroundings_change() -> None:
    coax = vehicle("coax")
    hover = sp.trim(coax)
    one, other = (Stepping(coax, np.array(hover.state), Environment()) for _ in range(2))
    wild = one.advance(np.array([9.0, 9.0, -9.0, 9.0]), 0.01)
    assert np.array_equal(wild.states, other.advance(np.array([1.0, 1.0, -1.0, 1.0]), 0.01).states)
    other.place(np.array(hover.state))
    other.surround(voltage=9.0)
    sagged = other.advance(np.array([1.0, 1.0, -1.0, 1.0]), 0.01)
    assert sagged.states[coax.index("omega_lower")] < wild.states[coax.index("omega_lower")]


def test_a_vehicle_that_flies_apart_stays_where_it_was() -> None:
    coax = vehicle("coax")
    hover = np.array(sp.trim(coax).state)
    broken = hover.copy()
    broken[coax.index("p")] = 1e160
    stepping = Stepping(coax, broken, Environment())
    with pytest.raises(DivergenceError):
        stepping.advance(np.zeros(4), 0.01)
    stepping.place(hover)
    before = stepping.advance(np.zeros(4), 0.01)
    assert np.isfinite(before.states).all()


OPTIONS = {"bar": True, "servos": True, "gyro": True, "coning": True, "inflow": "pitt-peters"}


@pytest.mark.parametrize(
    ("name", "options", "engine"),
    [
        pytest.param("raptor50", OPTIONS, None, marks=pytest.mark.proof),
        ("coax", {}, QUICK),
        pytest.param("coax", {}, None, marks=pytest.mark.proof),
        pytest.param("coax", {"bar": False}, None, marks=pytest.mark.proof),
    ],
)
def test_everything_can_stand(name: str, options: dict[str, object], engine: MakeEngine | None) -> None:
    made = standing(vehicle(name, **options))
    around = Environment()
    stepping = Stepping(made, at_rest(made, around), around, engine=engine)
    stopped = np.zeros(len(made.input_names))
    for _ in range(50):
        told = stepping.advance(stopped, 0.01)
    np.testing.assert_allclose(told.force, [0.0, 0.0, -9.81], atol=2e-3)
    np.testing.assert_allclose(told.velocity, 0.0, atol=1e-3)
    assert -told.body.z == pytest.approx(skids_of(made).depth, rel=0.1)


def test_ground_is_added_to_any_body_as_a_card_has_it() -> None:
    """The wrapper and the helicopter's own options are the same equations."""
    free = vehicle("raptor50", rotor_speed="throttle")
    own = vehicle("raptor50", rotor_speed="throttle", ground=True, grip=True)
    added = standing(replace(free, traits=replace(free.traits, standing={})))
    around = Environment()
    start = at_rest(own, around)
    start[own.index("z")] += 0.004  # pressed down, turned and moving
    start[own.index("phi")], start[own.index("u")], start[own.index("q")] = 0.02, 0.3, 0.1
    inputs = np.array([0.05, 0.01, -0.01, 0.1, 0.5])
    rows = [Stepping(made, start, around, engine=PlainFloats).advance(inputs, 0.05) for made in (own, added)]
    np.testing.assert_allclose(rows[1].states, rows[0].states, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(rows[1].force, rows[0].force, rtol=1e-9, atol=1e-9)
