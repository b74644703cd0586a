"""Static and dynamic decoupling of linear models: a hybrid helicopter with flapping states, and the CoaX's own."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.control.laws.linear_decoupling import (
    LinearSystem,
    control_matrix,
    coupling,
    dynamic_decoupling,
    in_series,
    response_at,
    static_decoupling,
    step_answers,
    unmixed,
)
from swashplate.errors import SwashError
from swashplate.models.catalogue import vehicle
from swashplate.simulation.linearize import linearize

INPUTS, RATES = ("lateral", "longitudinal"), ("p", "q")
FREQUENCIES = np.array([0.5, 2.0, 5.0, 10.0, 20.0])


def hybrid(*, cross: float = 1.0) -> LinearSystem:
    """Roll and pitch with flapping as Mettler's structure has it (numbers of the order of a 60-size helicopter)."""
    A = np.array(
        # u      v      p     q      phi   theta  a      b
        [
            [-0.05, 0.0, 0.0, 0.0, 0.0, -9.81, -9.81, 0.0],
            [0.0, -0.15, 0.0, 0.0, 9.81, 0.0, 0.0, 9.81],
            [-0.1, -0.2, 0.0, 0.0, 0.0, 0.0, 30.0 * cross, 160.0],
            [0.05, -0.1, 0.0, 0.0, 0.0, 0.0, 80.0, -10.0 * cross],
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, -1.0, 0.0, 0.0, -8.0, -3.0 * cross],
            [0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 3.0 * cross, -8.0],
        ]
    )
    B = np.zeros((8, 2))
    B[6], B[7] = [0.3 * cross, 2.0], [2.2, -0.4 * cross]
    states = ("u", "v", "p", "q", "phi", "theta", "a", "b")
    return LinearSystem(A, B, np.eye(8), np.zeros((8, 2)), states, INPUTS, states)


def test_a_static_matrix_decouples_best_where_it_was_made() -> None:
    model = hybrid()
    pair = {"inputs": INPUTS, "outputs": RATES}
    bare = coupling(model, FREQUENCIES, **pair)  # type: ignore[arg-type]
    best = np.full(FREQUENCIES.size, np.inf)
    reached = []
    for w in FREQUENCIES:
        ratio = coupling(model, FREQUENCIES, by=static_decoupling(model, frequency=float(w), **pair), **pair)  # type: ignore[arg-type]
        reached.append(ratio[0, 1])
        best = np.minimum(best, ratio[0, 1])
    # No matrix made elsewhere is better at w than the one made at w.
    np.testing.assert_allclose(np.diag(np.array(reached)), best, rtol=1e-9)
    assert np.all(best < bare[0, 1])


def test_the_optimum_at_a_frequency_is_found_by_brute_force_too() -> None:
    model = hybrid()
    w = 5.0
    found = static_decoupling(model, inputs=INPUTS, outputs=RATES, frequency=w)
    ratio = coupling(model, w, inputs=INPUTS, outputs=RATES, by=found)[1, 0, 0]
    G = response_at(model, w)[np.ix_([2, 3], [0, 1])]
    angles = np.linspace(0.0, np.pi, 200001)
    columns = G @ np.stack([np.cos(angles), np.sin(angles)])
    assert ratio == pytest.approx(np.min(np.abs(columns[1] / columns[0])), rel=1e-6)
    # On-axis gains stay what they were.
    np.testing.assert_allclose(np.abs(np.diag(G @ found.matrix)), np.abs(np.diag(G)))


def test_without_a_frequency_the_control_matrix_is_inverted() -> None:
    model = hybrid()
    matrix, degrees = control_matrix(model, inputs=INPUTS, outputs=RATES)
    assert degrees == (2, 2)  # command to flapping, flapping to rate
    A, B = np.asarray(model.A), np.asarray(model.B)
    np.testing.assert_allclose(matrix, (A @ B)[[2, 3]])
    by = static_decoupling(model, inputs=INPUTS, outputs=RATES)
    high = coupling(model, [1e2, 1e4], inputs=INPUTS, outputs=RATES, by=by)
    assert np.all(high[[0, 1], [1, 0], 1] < 1e-3)


def test_a_dynamic_filter_decouples_its_copy_exactly_and_the_full_model_nearly() -> None:
    model = hybrid()
    fast = ("p", "q", "a", "b")
    pair = {"inputs": INPUTS, "outputs": RATES}
    by = dynamic_decoupling(model, bandwidth=6.0, keep=fast, **pair)  # type: ignore[arg-type]
    places = [2, 3, 6, 7]
    A, B, C = (np.asarray(part) for part in (model.A, model.B, model.C))
    part = A[np.ix_(places, places)], B[places], C[[2, 3]][:, places], np.zeros((2, 2))
    copy = LinearSystem(*part, fast, INPUTS, RATES)
    on_copy = coupling(copy, FREQUENCIES, by=by, **pair)  # type: ignore[arg-type]
    assert np.max(on_copy[[0, 1], [1, 0]]) < 1e-9
    for w in FREQUENCIES:  # and the on-axis response is (6 / (s + 6))^2
        reached = response_at(copy, w) @ response_at(by.system, w)
        np.testing.assert_allclose(np.diag(reached), (6.0 / (1j * w + 6.0)) ** 2, rtol=1e-9)
    bare = coupling(model, FREQUENCIES, **pair)  # type: ignore[arg-type]
    full = coupling(model, FREQUENCIES, by=by, **pair)  # type: ignore[arg-type]
    assert np.all(full[0, 1, 1:] < 0.1 * bare[0, 1, 1:])
    static = coupling(model, FREQUENCIES, by=static_decoupling(model, frequency=5.0, **pair), **pair)  # type: ignore[arg-type]
    assert np.max(full[0, 1, 1:]) < np.max(static[0, 1, 1:])


def test_the_coaxs_lower_lag_appears_in_its_linear_model() -> None:
    """The static matrix at high frequency is the nonlinear law at rest: a rotation by D = 17 deg."""
    model = linearize(vehicle("coax"))
    by = static_decoupling(model, inputs=("servo_roll", "servo_pitch"), outputs=("p", "q"))
    d = np.arctan2(by.matrix[1, 0], by.matrix[0, 0])
    assert np.degrees(d) == pytest.approx(17.0, abs=0.1)
    assert np.arctan2(-by.matrix[0, 1], by.matrix[1, 1]) == pytest.approx(d)


def test_bad_input_is_named() -> None:
    model = hybrid()
    with pytest.raises(SwashError, match="has no output r; it has u, v"):
        static_decoupling(model, inputs=INPUTS, outputs=("p", "r"))
    with pytest.raises(SwashError, match="2 inputs cannot decouple 1 outputs"):
        static_decoupling(model, inputs=INPUTS, outputs=("p",))
    with pytest.raises(SwashError, match=r"cannot move .*p .*phi"):
        control_matrix(model, inputs=INPUTS, outputs=("p", "phi"))
    with pytest.raises(SwashError, match=r"would not come to rest: .* zero"):
        dynamic_decoupling(model, inputs=INPUTS, outputs=RATES, bandwidth=5.0)
    with pytest.raises(SwashError, match=r"bandwidth: is .* positive"):
        dynamic_decoupling(model, inputs=INPUTS, outputs=RATES, bandwidth=-1.0, keep=("p", "q", "a", "b"))


def test_steps_and_series_are_those_of_python_control() -> None:
    control = pytest.importorskip("control", reason="the oracle python-control is not installed")
    model, pair = hybrid(), {"inputs": INPUTS, "outputs": RATES}
    by = dynamic_decoupling(model, bandwidth=6.0, keep=("p", "q", "a", "b"), **pair)  # type: ignore[arg-type]
    time = np.linspace(0.0, 2.0, 201)
    plant = control.ss(model.A, model.B, model.C[[2, 3]], 0)
    for decoupling in (by, unmixed(**pair)):  # type: ignore[arg-type]
        law = decoupling.system
        oracle = plant * control.ss(law.A, law.B, law.C, law.D)
        for axis in range(2):
            push = np.zeros((2, time.size))
            push[axis] = 1.0
            found = step_answers(in_series(decoupling, model), axis, time)
            np.testing.assert_allclose(found, control.forced_response(oracle, time, push).outputs, atol=1e-8)
