"""Linear models from sample to sample: closed forms, finer steps, and each way against another."""

from __future__ import annotations

import numpy as np

from swashplate.simulation.discretisation import (
    first_order_hold,
    held_series,
    with_late_inputs,
    zero_order_hold,
)

A = np.array([[0.0, 1.0, 0.0], [-40.0, -1.2, 3.0], [0.0, 0.0, -8.0]])
B = np.array([[0.0, 0.1], [2.0, 0.0], [0.0, 8.0]])
DT = 0.02


def test_a_first_order_lag_has_its_closed_forms() -> None:
    lag, gain, keep = np.array([[-5.0]]), np.array([[10.0]]), np.exp(-0.1)
    F, G = zero_order_hold(lag, gain, DT)
    np.testing.assert_allclose([F[0, 0], G[0, 0]], [keep, 2.0 * (1.0 - keep)], rtol=1e-14)
    F, G0, G1 = first_order_hold(lag, gain, DT)
    np.testing.assert_allclose([F[0, 0], G0[0, 0]], [keep, 2.0 * (1.0 - keep)], rtol=1e-14)
    np.testing.assert_allclose(G1[0, 0], 2.0 * (1.0 - (1.0 - keep) / 0.1), rtol=1e-13)  # the answer to a ramp


def test_an_integrator_gathers_its_input() -> None:
    """Where A has no inverse."""
    F, G = zero_order_hold(np.zeros((1, 1)), np.ones((1, 1)), DT)
    np.testing.assert_allclose([F[0, 0], G[0, 0]], [1.0, DT], rtol=1e-15)
    assert abs(first_order_hold(np.zeros((1, 1)), np.ones((1, 1)), DT)[2][0, 0] - 0.5 * DT) < 1e-17


def test_a_batch_of_complex_models_is_each_of_them() -> None:
    many = np.stack([A, 0.5 * A + 0.1j * np.eye(3)])
    both = np.stack([B, B]).astype(complex)
    for i in range(2):
        for found, one in zip(first_order_hold(many, both, DT), first_order_hold(many[i], both[i], DT), strict=True):
            np.testing.assert_allclose(found[i], one, rtol=1e-14, atol=1e-16)


def test_the_series_is_the_exponential_to_its_order() -> None:
    """Half the step, a 32nd of what is left out at order four."""
    F, G = zero_order_hold(A, B, DT)
    off = []
    for dt in (DT, 0.5 * DT):
        exact, _ = zero_order_hold(A, B, dt)
        off.append(np.max(np.abs(held_series(A, dt, np.eye(3))[0] - exact)))
    assert 28.0 < off[0] / off[1] < 36.0
    transition, held = held_series(A, DT, np.eye(3), terms=12)
    np.testing.assert_allclose(transition, F, atol=1e-14)
    np.testing.assert_allclose(DT * held @ B, G, atol=1e-15)


def test_a_late_input_waits_in_states_of_its_own() -> None:
    F, G = zero_order_hold(A, B, DT)
    larger, entering, added = with_late_inputs(F, G, (2, 0))
    assert added == ((0, 1), (0, 2))
    x = np.zeros(5)
    for command in ([1.0, 0.0], [0.0, 0.0], [0.0, 0.0]):
        assert not np.any(x[:3])
        x = larger @ x + entering @ np.array(command)
    np.testing.assert_allclose(x[:3], G[:, 0], rtol=1e-14)
