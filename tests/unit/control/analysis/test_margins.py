"""Margins against closed forms, brute force and a classic that fools single loops; the autopilot's own."""

from __future__ import annotations

import control
import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.margins import margins
from swashplate.control.analysis.stability import loop_margins, loop_modes
from swashplate.errors import ControllerError

W = np.geomspace(1e-2, 1e3, 4000)


def test_one_loop_in_closed_form() -> None:
    """L = 4 / (s + 1)^3: a gain of 8 is the limit at sqrt 3 rad/s; |L| = 1 where 1 + w^2 = 4^(2/3)."""
    L = (4.0 / (1j * W + 1.0) ** 3)[:, None, None]
    (axis,) = margins(W, L, ("one",)).axes
    assert axis.gain == pytest.approx(2.0, rel=1e-4)
    crossover = np.sqrt(4.0 ** (2.0 / 3.0) - 1.0)
    assert axis.crossover == pytest.approx(crossover, rel=1e-3)
    assert axis.phase == pytest.approx(np.pi - 3.0 * np.arctan(crossover), rel=1e-3)
    assert axis.delay == pytest.approx((np.pi - 3.0 * np.arctan(crossover)) / crossover, rel=2e-3)
    # The disc never promises more than either of them.
    assert axis.disc.gain < 2.0
    assert axis.disc.phase < axis.phase


def test_gain_and_phase_are_those_of_python_control() -> None:
    random, w = np.random.default_rng(0), np.geomspace(0.05, 300.0, 600)
    s = 1j * w
    for _ in range(5):
        gain, lag, mode, wait = random.uniform((5.0, 0.01, 3.0, 0.0), (30.0, 0.5, 30.0, 0.1))
        L = gain / (s * (1.0 + lag * s) * (1.0 + 0.1 * s + (s / mode) ** 2)) * np.exp(-wait * s)
        up, turned, _, _, crossings, _ = control.stability_margins(control.frd(L, w, smooth=True), returnall=True)
        (axis,) = margins(w, L[:, None, None], ("one",)).axes
        assert axis.gain == pytest.approx(min(up[up > 1.0], default=np.inf), rel=1e-9)
        assert axis.gain_down == pytest.approx(max(up[up < 1.0], default=0.0), rel=1e-9)
        assert axis.phase == pytest.approx(np.radians(np.abs((turned + 180.0) % 360.0 - 180.0)).min(), rel=1e-9)
        assert axis.crossover == pytest.approx(crossings.max(), rel=1e-9)


def test_the_disc_margin_is_reached_by_a_factor_on_its_circle() -> None:
    L = (4.0 / (1j * W + 1.0) ** 3)[:, None, None]
    disc = margins(W, L, ("one",)).axes[0].disc
    angles = np.linspace(0.0, 2.0 * np.pi, 4001)

    def smallest(size: float) -> float:
        delta = size * np.exp(1j * angles)
        factors = (1.0 + 0.5 * delta) / (1.0 - 0.5 * delta)
        near = np.abs(W - disc.frequency) < 0.5 * disc.frequency
        return float(np.min(np.abs(1.0 + factors[:, None] * L[near, 0, 0])))

    assert smallest(disc.alpha) < 5e-3
    assert smallest(0.9 * disc.alpha) > 0.02


def test_the_spinning_satellite_fools_single_loops() -> None:
    """Doyle's example, a = 10: each loop alone is 1 / s; both together fall at gains of 1.105 and 1 / 1.105.

    With diag(g, 1/g) the polynomial is s^2 + (2 + h) s + 1 - 100 h, h = g + 1/g - 2: stable to h = 0.01.
    """
    a, s = 10.0, 1j * W
    L = np.array([[s - a * a, a * (s + 1.0)], [-a * (s + 1.0), s - a * a]]) / (s * s + a * a)
    found = margins(W, np.moveaxis(L, 2, 0), ("one", "two"))
    for axis in found.axes:
        assert axis.gain == np.inf
        assert np.degrees(axis.phase) == pytest.approx(90.0, abs=0.1)
        assert axis.disc.alpha == pytest.approx(2.0, abs=1e-3)
    g = float(np.roots([1.0, -2.01, 1.0]).real.max())
    assert found.together.gain == pytest.approx(g, rel=2e-3)
    assert found.together.gain <= g * (1.0 + 1e-4)


def test_scaling_makes_the_bound_independent_of_units() -> None:
    random = np.random.default_rng(1)
    w = np.geomspace(0.1, 10.0, 50)
    blocks = random.standard_normal((3, 3))
    L = blocks[None] / (1j * w[:, None, None] + 1.0) * 0.4 + np.eye(3)[None] * 3.0 / (1j * w[:, None, None] + 0.5)
    units = np.diag([1.0, 100.0, 0.01])
    one = margins(w, L, ("a", "b", "c")).together
    other = margins(w, units @ L @ np.linalg.inv(units), ("a", "b", "c")).together
    assert other.alpha == pytest.approx(one.alpha, rel=1e-3)


def test_the_autopilots_margins_are_where_its_modes_cross() -> None:
    """A servo's gain at its margin puts a mode of the closed loop on the axis: an independent route by eigenvalues."""
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    controller = sp.autopilot(coax, hover)
    found = loop_margins(coax, controller, hover)
    motors = {axis.name: axis for axis in found.axes}
    assert motors["servo_roll"].gain > 1.4
    assert found.together.alpha < min(axis.disc.alpha for axis in found.axes) + 1e-6
    # The gains of lean and rate are those of both servos: what the disc of all loops promises holds, and beyond the
    # single loops' margins it does not.
    cyclic = controller.numbers.cyclic

    def scaled(factor: float) -> float:
        louder = controller.with_gains(lean=factor * cyclic.lean, lean_rate=factor * cyclic.lean_rate)
        return float(loop_modes(coax, louder, hover)[0].real)

    assert scaled(found.together.gain) < 0.0
    assert scaled(1.0 / found.together.gain) < 0.0
    assert scaled(30.0) > 0.0  # 23 dB up
    assert scaled(0.15) > 0.0  # 10 dB down: the bar circles again


def test_bad_input_is_named() -> None:
    with pytest.raises(ControllerError, match=r"shape \(3, 1, 1\), expected finite numbers \(3, 2, 2\)"):
        margins([1.0, 2.0, 3.0], np.ones((3, 1, 1)), ("a", "b"))
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    with pytest.raises(ControllerError, match=r"at 100 Hz has a growing mode at \+0\.247"):
        loop_margins(coax, sp.autopilot(coax, hover, mode="manual"), hover)
