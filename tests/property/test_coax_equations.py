"""The CoaX's equations of motion: floats and CasADi alike, mirror symmetry, moving frames."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swashplate.models import catalogue
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import CasadiBackend, FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, local_to_body

FLOATS = FloatBackend()
SEED = st.integers(0, 2**32 - 1)
few = settings(max_examples=30, deadline=None)
MIRRORED = ("y", "v", "phi", "psi", "p", "r", "alpha_lower", "eta_bar")
"""States that change their sign in a mirror that swaps left and right."""


def random_case(vehicle: Vehicle, seed: int) -> tuple[np.ndarray, np.ndarray, Environment, Vehicle]:
    """A state, inputs, surroundings and a card with every switch turned on, all at random."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1.0, 1.0, len(vehicle.state_names))
    x[-2:] = rng.uniform(150.0, 280.0, 2)
    u = np.array([rng.uniform(low, high) for low, high in vehicle.input_limits])
    surroundings = Environment(*rng.uniform(-2.0, 2.0, 3), rng.uniform(1.0, 1.3), 9.81, rng.uniform(10.0, 12.5))
    zero = [name for name, value in vehicle.card.values().items() if value == 0.0]
    return x, u, surroundings, vehicle.with_values({name: rng.uniform(0.0, 0.02) for name in zero})


@pytest.mark.parametrize("options", [{}, {"bar": False}, {"mixing": "as_printed"}])
def test_floats_and_casadi_compute_the_same(options: dict[str, object]) -> None:
    vehicle = catalogue.vehicle("coax", **options)
    x, u = casadi.SX.sym("x", len(vehicle.state_names)), casadi.SX.sym("u", len(vehicle.input_names))
    p, e = casadi.SX.sym("p", len(vehicle.parameter_names)), casadi.SX.sym("e", len(Environment._fields))
    parameters = vehicle.parameters(*casadi.vertsplit(p))
    traced = vehicle.rates(x, u, parameters, Environment(*casadi.vertsplit(e)), CasadiBackend())
    with_casadi = casadi.Function("rates", [x, u, p, e], [casadi.vertcat(*traced)])
    for seed in range(30):
        state, inputs, around, flown = random_case(vehicle, seed)
        floats = np.array(flown.rates(state.tolist(), inputs.tolist(), flown.values(), around, FLOATS))
        casadied = np.asarray(with_casadi(state, inputs, np.array(flown.values()), np.array(around))).ravel()
        np.testing.assert_allclose(casadied, floats, rtol=1e-10, atol=1e-10)


@few
@given(SEED)
def test_the_air_knows_only_relative_motion(seed: int) -> None:
    """Wind from a moving frame: velocity and wind with the same vector added give the same accelerations, but for
    what turning the added velocity in body axes takes (rates zero here)."""
    vehicle = catalogue.vehicle("coax")
    x, u, around, flown = random_case(vehicle, seed)
    body = {name: vehicle.index(name) for name in ("u", "v", "w", "p", "q", "r", "phi", "theta", "psi")}
    for name in ("p", "q", "r"):
        x[body[name]] = 0.0
    added = Vector(1.3, -0.7, 0.4)
    attitude = Euler(*(float(x[body[name]]) for name in ("phi", "theta", "psi")))
    moved = x.copy()
    moved[[body["u"], body["v"], body["w"]]] += np.array(local_to_body(added, attitude, FLOATS))
    windy = around._replace(
        wind_north=around.wind_north + added.x,
        wind_east=around.wind_east + added.y,
        wind_down=around.wind_down + added.z,
    )
    still = np.array(flown.rates(x.tolist(), u.tolist(), flown.values(), around, FLOATS))
    moving = np.array(flown.rates(moved.tolist(), u.tolist(), flown.values(), windy, FLOATS))
    np.testing.assert_allclose(moving[3:], still[3:], atol=1e-10)
    np.testing.assert_allclose(moving[:3] - still[:3], added, atol=1e-10)


@few
@given(SEED)
def test_a_mirrored_helicopter_flies_the_mirrored_flight(seed: int) -> None:
    """Left and right swapped, rotors turning the other way: phase lags, off-axis flapping, and yaw torques reversed.

    The mirror of a coaxial helicopter has its rotors' senses reversed. The equations fix the senses, so the mirror is
    made by the numbers: negative lags, negative cross terms, negative torques and rotor inertias.
    """
    vehicle = catalogue.vehicle("coax")
    x, u, around, flown = random_case(vehicle, seed)
    odd = [
        name
        for name in vehicle.parameter_names
        if name.startswith(("k_zeta", "o_zeta", "k_torque", "inertia_drive", "phase_asymmetry"))
    ]
    odd += ["a_alpha_u", "a_beta_v", "a_alpha_u_linear", "a_beta_v_linear"]
    card = flown.card.values()
    numbers = flown.values()._replace(**{name: -card[name] for name in odd})
    sign = np.array([-1.0 if name in MIRRORED else 1.0 for name in vehicle.state_names])
    commands = u * np.array([-1.0 if name == "servo_roll" else 1.0 for name in vehicle.input_names])
    here = np.array(flown.rates(x.tolist(), u.tolist(), flown.values(), around, FLOATS))
    air = around._replace(wind_east=-around.wind_east)
    there = np.array(flown.rates((sign * x).tolist(), commands.tolist(), numbers, air, FLOATS))
    np.testing.assert_allclose(there, sign * here, atol=1e-10)
