"""Broken loops of a cascade: their margins are those of textbook loops."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.control.analysis.cascade import FREQUENCIES, BrokenLoops


def broken(*loops: np.ndarray) -> BrokenLoops:
    return BrokenLoops(FREQUENCIES, np.stack(loops, axis=-1)[None], np.zeros(1))


def test_margins_of_an_integrator_with_two_lags() -> None:
    """L = 4 / (s (s + 1) (s + 4)): gain margin 5 at 2 rad/s, where the phase is -180 degrees."""
    s = 1j * FREQUENCIES
    found = broken(4.0 / (s * (s + 1.0) * (s + 4.0)), 1.0 / s)
    assert found.gain[0, 0] == pytest.approx(20.0 * np.log10(5.0), abs=0.02)
    dense = np.geomspace(0.5, 2.0, 200_001)
    loop = 4.0 / (1j * dense * (1j * dense + 1.0) * (1j * dense + 4.0))
    at = int(np.argmin(np.abs(np.abs(loop) - 1.0)))
    margin = np.pi + np.angle(loop[at])
    assert found.phase[0, 0] == pytest.approx(np.degrees(margin), abs=0.2)
    assert found.delay[0, 0] == pytest.approx(margin / dense[at], rel=0.02)
    assert found.crossover[0, 0] == pytest.approx(dense[at], rel=0.03)


def test_an_integrator_keeps_ninety_degrees() -> None:
    found = broken(1.0 / (1j * FREQUENCIES))
    assert found.phase[0, 0] == pytest.approx(90.0)
    assert found.gain[0, 0] == np.inf
    assert found.peak[0, 0] <= 1.0
    assert found.rejection[0, 0] == pytest.approx(1.0, rel=0.05)


def test_a_later_loop_has_less_of_both() -> None:
    """Mutation: 0.3 s of delay take 0.3 rad at the crossover, and a gain margin that there was not."""
    s = 1j * FREQUENCIES
    found = broken(np.exp(-0.3 * s) / s)
    assert found.phase[0, 0] == pytest.approx(90.0 - np.degrees(0.3), abs=0.1)
    assert found.gain[0, 0] == pytest.approx(20.0 * np.log10(np.pi / 2.0 / 0.3), abs=0.1)
    assert found.delay[0, 0] == pytest.approx(np.pi / 2.0 - 0.3, rel=0.05)
    assert found.quiet(0.05, 1.0)[0, 0] > broken(0.5 * np.exp(-0.3 * s) / s).quiet(0.05, 1.0)[0, 0]
