"""Many observers at once: stacks of matrices, and flights that are those of one after the other."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from swashplate.control.lqg.design import design
from swashplate.export.closed_loop_c import loop_in_c
from swashplate.filtering.batched_matrices import Stack, StackMatrices
from swashplate.filtering.sensor_suite import suite
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space_file import structure
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.closed_loop_batch import simulate_closed_loops
from swashplate.simulation.dynamics import enable_double_precision


def test_a_stack_computes_what_its_matrices_do() -> None:
    enable_double_precision()
    random = np.random.default_rng(0)
    a, b, e = random.standard_normal((3, 4, 5)), random.standard_normal((4, 2, 5)), random.standard_normal((2, 3))
    A, B = Stack(jnp.asarray(a)), Stack(jnp.asarray(b))
    for i in range(5):
        expected = (e @ (a[:, :, i] @ b[:, :, i])).T * 2.0 - np.eye(2)
        np.testing.assert_allclose(((e @ (A @ B)).T * 2.0 - np.eye(2)).data[:, :, i], expected, atol=1e-13)
        np.testing.assert_allclose((np.eye(2) + e[:, :2] @ B[:2, :]).data[:, :, i], np.eye(2) + e[:, :2] @ b[:2, :, i])
        np.testing.assert_allclose((A[:, :1] @ B[:1, :]).data[:, :, i], np.outer(a[:, 0, i], b[0, :, i]))


def test_slopes_of_many_are_those_of_each() -> None:
    """Against the derivatives by hand of (x y, w sin x)."""
    enable_double_precision()
    M, x, w = StackMatrices(3), np.array([[0.1, 0.4, 2.0], [3.0, -1.0, 0.5]]), np.array([[2.0, 5.0, -1.0]])

    @jax.jit
    def both(x: jax.Array, w: jax.Array) -> tuple[Stack, Stack]:
        return M.linearised(lambda e, u: [e[0] * e[1], u[0] * M.xp.sin(e[0])], Stack(x[:, None]), Stack(w[:, None]))

    value, slopes = both(jnp.asarray(x), jnp.asarray(w))
    np.testing.assert_allclose(value.data[:, 0], [x[0] * x[1], w[0] * np.sin(x[0])], atol=1e-15)
    expected = [[x[1], x[0]], [w[0] * np.cos(x[0]), np.zeros(3)]]
    np.testing.assert_allclose(slopes.data, expected, atol=1e-15)


@pytest.mark.proof
def test_a_batch_flies_as_one_does() -> None:
    """The same seeds, one after the other, with noise, offsets, late readings and late commands."""
    vehicle = linear_vehicle(structure("thirteen_state"))
    controller = design(vehicle, sensors=suite("gyro@50,mocap@25+40ms"), rate=50.0, delays=0.02)
    push = {"longitudinal": 0.05 * np.ones(40)}
    many = simulate_closed_loops(
        vehicle, controller, duration=0.8, size=3, seed=4, rate=100.0, reference={"z": -0.1}, excitation=push
    )
    again = controller.starting_at(controller.start, seed=5)
    held = np.append(np.repeat(push["longitudinal"], 2), 0.05)
    one, in_c = (
        simulate_closed_loop(
            vehicle, again, duration=0.8, rate=100.0, reference={"z": -0.1}, excitation={"longitudinal": held}, fly=fly
        )
        for fly in (None, loop_in_c(vehicle, controller, controller.start))
    )
    for name in ("u", "theta", "z", "q"):
        series = one.values(name)[:-1:2]
        assert np.max(np.abs(series)) > 1e-3
        np.testing.assert_allclose(many[name][: len(series), 1], series, atol=1e-10)
        np.testing.assert_allclose(in_c.values(name), one.values(name), atol=1e-10)
    assert np.max(np.abs(many["u"][-1, 1] - many["u"][-1, [0, 2]])) > 1e-6
