"""Blades that lift from a cut-out to a tip loss factor: closed forms against quadrature over the blade element."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.physics import blade_element
from swashplate.physics.blade_element import WHOLE, Disc, span

SOLIDITY, SLOPE, DRAG = 0.08, 5.7, 0.012


def some_disc(seed: int) -> Disc:
    rng = np.random.default_rng(seed)
    sizes = Disc(0.35, 0.2, 0.05, 0.06, 0.05, 0.05, 0.02, 0.02, 0.2, 0.15, 0.1, 0.1, 0.1, 0.1, 0.1)
    return Disc(*(float(rng.uniform(-size, size)) for size in sizes))


def by_quadrature(d: Disc, low: float, high: float, root: float) -> tuple[np.ndarray, np.ndarray]:
    """C_T, C_X, C_Y, C_Q and the flap moments: lift from `low` to `high`, drag from `root` to the tip."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    psi = np.arange(16)[None, :] * 2.0 * np.pi / 16
    c, s = np.cos(psi), np.sin(psi)
    beta, beta_dash = d.a0 - d.a1 * c - d.b1 * s, d.a1 * s - d.b1 * c

    def summed(begin: float, end: float, lifts: float, drags: float) -> np.ndarray:
        x = 0.5 * (end - begin) * nodes[:, None] + 0.5 * (end + begin)
        w = 0.5 * (end - begin) * weights[:, None] / 16
        u_t = x + d.mu_x * s + d.mu_y * c
        u_p = d.mu_z - d.lam0 - x * (d.lam_c * c + d.lam_s * s) + beta * (-d.mu_x * c + d.mu_y * s)
        u_p = u_p - x * beta_dash + x * (d.p * s + d.q * c)
        theta = d.theta0 + d.twist * x - d.A1 * c - d.B1 * s
        lift = lifts * (u_t**2 * theta + u_t * u_p)
        against = drags * DRAG / SLOPE * u_t**2 - lifts * u_p * (u_t * theta + u_p)
        parts = (
            lift,
            -against * s + lift * beta * c,
            -against * c - lift * beta * s,
            against * x,
            x * lift / (0.5 * SLOPE * SOLIDITY),
            2.0 * c * x * lift / (0.5 * SLOPE * SOLIDITY),
            2.0 * s * x * lift / (0.5 * SLOPE * SOLIDITY),
        )
        return np.array([0.5 * SLOPE * SOLIDITY * np.sum(w * part) for part in parts])

    found = summed(low, high, 1.0, 0.0) + summed(root, 1.0, 0.0, 1.0)
    return found[:4], found[4:]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(("tip", "root"), [(0.97, 0.15), (0.9, 0.0), (1.0, 0.3)])
def test_closed_forms_are_the_quadrature(seed: int, tip: float, root: float) -> None:
    d, blade = some_disc(seed), span(tip, root)
    loads, moments = by_quadrature(d, root, tip, root)
    np.testing.assert_allclose(blade_element.disc_loads(d, SOLIDITY, SLOPE, DRAG, blade), loads, atol=1e-15)
    np.testing.assert_allclose(blade_element.flap_moments(d, blade), moments, atol=1e-15)
    assert blade_element.thrust_coefficient(d, SOLIDITY, SLOPE, blade) == pytest.approx(loads[0], abs=1e-16)


def test_a_blade_without_losses_is_whole() -> None:
    np.testing.assert_allclose(span(1.0, 0.0), WHOLE, rtol=1e-15)
