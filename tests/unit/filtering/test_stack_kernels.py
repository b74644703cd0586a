"""The filter's products in C against plain linear algebra, for a number of vehicles that fills no vector."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from swashplate.arrays import Array
from swashplate.compiler import compiler
from swashplate.filtering import stack_kernels
from swashplate.filtering.batched_matrices import Stack, StackMatrices
from swashplate.simulation.dynamics import enable_double_precision

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

VEHICLES, N, MOVES, KEPT, READINGS, DT = 6, 13, 9, 2, 5, 1e-3
RANDOM = np.random.default_rng(0)


def thinned(*shape: int) -> Array:
    """Half of it zero, in all vehicles or in some."""
    table = RANDOM.standard_normal((*shape, VEHICLES))
    return table * (RANDOM.random(shape) < 0.5)[..., None] * (RANDOM.random(table.shape) < 0.9)


def covariances() -> Array:
    roots = RANDOM.standard_normal((N, N, VEHICLES))
    return np.einsum("ikb,jkb->ijb", roots, roots) + np.eye(N)[:, :, None]


def relative(found: Array, exact: Array) -> float:
    return float(np.max(np.abs(found - exact)) / np.max(np.abs(exact)))


@pytest.fixture(scope="module", autouse=True)
def _available() -> None:
    enable_double_precision()
    assert stack_kernels.fits(N)
    assert not stack_kernels.fits(1000)


@pytest.mark.parametrize("kept", [KEPT, 0])
def test_the_covariance_a_sample_later(kept: int) -> None:
    A, J, P, noise = thinned(MOVES, MOVES), thinned(kept, N), covariances(), RANDOM.random(N)
    given = None if kept == 0 else Stack(jnp.asarray(J))
    M = StackMatrices(VEHICLES)
    found = M.propagated(Stack(jnp.asarray(A)), given, Stack(jnp.asarray(P)), noise, DT)
    assert found is not None
    for b in range(VEHICLES):
        G = np.eye(N)
        G[:MOVES, :MOVES] = expm(A[..., b] * DT)
        G[N - kept :] = J[..., b]
        exact = G @ P[..., b] @ G.T + np.diag(noise)
        assert relative(np.asarray(found.data[..., b]), exact) < 1e-13
    np.testing.assert_array_equal(found.data, jnp.swapaxes(found.data, 0, 1))
    # The first order of the exponential alone, or no noise, would be found.
    assert relative(np.eye(MOVES) + A[..., 0] * DT, expm(A[..., 0] * DT)) > 1e-9
    assert noise.min() > 1e-6


def test_the_update() -> None:
    H, P, noise = thinned(READINGS, N), covariances(), 0.1 + RANDOM.random(READINGS)
    H[2] = 0.0  # a reading that is not due
    mean, news = RANDOM.standard_normal((N, VEHICLES)), RANDOM.standard_normal((READINGS, VEHICLES))
    news[2] = 0.0
    stacks = (Stack(jnp.asarray(part)) for part in (H, mean[:, None], P, news[:, None]))
    found = StackMatrices(VEHICLES).updated(*stacks, noise)
    assert found is not None
    for b in range(VEHICLES):
        h, p = H[..., b], P[..., b]
        S = h @ p @ h.T + np.diag(noise)
        K = p @ h.T @ np.linalg.inv(S)
        exact = (mean[:, b] + K @ news[:, b], p - K @ S @ K.T, S)
        for part, right in zip(found, exact, strict=True):
            assert relative(np.asarray(part.data[..., b]).reshape(right.shape), right) < 1e-12
        assert relative(p, exact[1]) > 1e-3
    np.testing.assert_array_equal(found[1].data, jnp.swapaxes(found[1].data, 0, 1))


def test_in_a_compiled_loop() -> None:
    P, A, noise = jnp.asarray(covariances()), jnp.asarray(thinned(MOVES, MOVES)), np.full(N, 0.1)
    none = jnp.zeros((0, N, VEHICLES))

    def step(P: jax.Array, _: None) -> tuple[jax.Array, None]:
        return stack_kernels.propagated(A, none, P, noise, DT), None

    after = jax.jit(lambda P: jax.lax.scan(step, P, None, length=3)[0])(P)
    by_hand = P
    for _ in range(3):
        by_hand, _ = step(by_hand, None)
    np.testing.assert_array_equal(after, by_hand)
    assert relative(np.asarray(after), np.asarray(P)) > 1e-3
