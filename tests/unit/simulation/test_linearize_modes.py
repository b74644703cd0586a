"""Modes of a linear model: the eigenvalues at the origin do not depend on how rounding chooses eigenvectors."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from swashplate.simulation.linearize import LinearModel


def chain(change: Any = 0.0) -> LinearModel:
    """Place and speed integrate a damped force; a constant input drives the force; one heading integrates a rate."""
    A = np.zeros((6, 6))
    A[0, 1] = A[1, 2] = A[4, 5] = 1.0
    A[2, 2], A[2, 3], A[5, 5] = -2.0, 3.0, -7.0
    names = ("x", "u", "force", "constant", "psi", "r")
    none = np.zeros((6, 1))
    return LinearModel(A + change, none, np.eye(6), none, none, names, ("a",), ("wind",), cast(Any, SimpleNamespace()))


def test_all_states_at_the_origin_are_named_with_their_share() -> None:
    modes = chain().modes()
    assert [m.eigenvalue for m in modes] == [-7.0, -2.0, 0.0, 0.0, 0.0, 0.0]
    assert [name for name, _ in modes[-1].states] == ["x", "u", "constant", "psi"]
    np.testing.assert_allclose([share for _, share in modes[-1].states], 1.0, atol=1e-12)
    assert modes[-1].states == modes[-2].states


def test_rounding_does_not_change_what_is_said() -> None:
    noise = 1e-21 * np.random.default_rng(1).standard_normal((6, 6))
    assert repr(chain(noise)) == repr(chain())
    assert "0 (4 times)" in repr(chain())


def test_a_stable_model_has_nothing_at_the_origin() -> None:
    assert all(m.frequency > 0.0 for m in chain(-0.5 * np.eye(6)).modes())


def test_states_that_share_a_mode_equally_are_all_named_in_the_models_order() -> None:
    # Roll and pitch of something round, tilted by a late thrust: each of four states has a quarter of each mode.
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1.0
    A[2, 0] = A[3, 1] = -100.0
    A[2, 1], A[3, 0] = -5.0, 5.0
    none = np.zeros((4, 1))
    at = cast(Any, SimpleNamespace())
    for noise in np.random.default_rng(2).standard_normal((5, 4, 4)):
        whole = (A + 1e-13 * noise, none, np.eye(4), none, none)
        model = LinearModel(*whole, ("phi", "theta", "p", "q"), ("a",), ("wind",), at)
        assert [[name for name, _ in mode.states] for mode in model.modes()] == [["phi", "theta", "p", "q"]] * 2
