"""Collocation against a Kalman filter written here and the other estimators, and what is said where it cannot be."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from rolling import SAME, TRUTH, gusty, rolling
from swashplate.errors import FlightError, IdentificationError
from swashplate.identification.core.banded_least_squares import Border, Chain, eliminated, factor
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.time import collocation
from swashplate.identification.time.collocation import vehicle_errors
from swashplate.identification.time.collocation_likelihood import CollocationErrors
from swashplate.models.linear.state_space_file import parse
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.simulation.dynamics import enable_double_precision
from tipping import Tilt, tipped, tipping

OUTPUTS = ("p", "pdot", "ay")


@pytest.fixture(scope="module")
def likelihood() -> CollocationErrors:
    enable_double_precision()  # before the numbers become arrays: as in a fit, whose programs these are then
    table = parameterize(rolling(), list(TRUTH))
    return vehicle_errors(table, records(gusty(), rolling(), outputs=OUTPUTS), Environment(), shifts=False, biases=())


@lru_cache(maxsize=1)
def fitted() -> sp.Result[Any, Any]:
    return sp.identify(rolling(), gusty(), free=list(TRUTH), outputs=OUTPUTS, method="collocation")


def kalman(record: Record, row: np.ndarray) -> float:
    """Negative log-likelihood of the same discrete model by a Kalman filter in covariances, its start hardly known."""
    lb, tau, a = row[:3]
    q, r = np.exp(row[3:5]), np.exp(row[5:8])
    h, eye = record.dt, np.eye(2)
    A, B = np.array([[0.0, lb], [-1.0, -1.0 / tau]]), np.array([0.0, a / tau])
    left, right = eye - h / 2 * A + h**2 / 12 * A @ A, eye + h / 2 * A + h**2 / 12 * A @ A
    C = np.array([[1.0, 0.0], [0.0, lb], [0.0, LABORATORY_GRAVITY]])
    x, P, total = np.zeros(2), 100.0 * eye, 0.0
    u = record.inputs[:, 0]
    for k in range(len(u)):
        S = C @ P @ C.T + np.diag(r**2)
        nu = record.outputs[k] - C @ x
        total += 0.5 * nu @ np.linalg.solve(S, nu) + 0.5 * np.linalg.slogdet(S)[1]
        K = P @ C.T @ np.linalg.inv(S)
        kept = eye - K @ C
        x, P = x + K @ nu, kept @ P @ kept.T + K @ np.diag(r**2) @ K.T
        if k + 1 < len(u):
            push = h / 6 * (B * u[k] + B * u[k + 1] + 4 * B * (u[k] + u[k + 1]) / 2 + h / 2 * A @ B * (u[k] - u[k + 1]))
            x = np.linalg.solve(left, right @ x + push)
            moved = np.linalg.solve(left, right)
            gathered = np.linalg.solve(left, np.diag(q * np.sqrt(h)))
            P = moved @ P @ moved.T + gathered @ gathered.T
    return float(total)


def rows(likelihood: CollocationErrors) -> tuple[np.ndarray, np.ndarray]:
    """Two rows that are no optimum, unscaled."""
    first = np.array([50.0, 0.25, 0.45, np.log(0.3), np.log(0.02), np.log(0.02), np.log(0.2), np.log(0.03)])
    return first, first + np.array([6.0, -0.04, 0.06, 0.4, -0.6, -0.5, 0.3, 0.2])


def test_it_is_the_likelihood_of_a_kalman_filter(likelihood: CollocationErrors) -> None:
    """Exactly, for linear equations, but for what the filter is told of its start: 10 with sizes of 0.1."""
    record, scale = likelihood.records[0], likelihood.row.scale
    one, other = rows(likelihood)
    there = kalman(record, other) - kalman(record, one)
    assert likelihood.cost(other / scale) - likelihood.cost(one / scale) == pytest.approx(there, abs=1e-3)
    assert abs(there) > 10.0
    _, gradient, _ = likelihood.scores(one / scale)
    for i in range(len(scale)):
        step = np.zeros(len(scale))
        step[i] = 1e-5 * scale[i]
        slope = (kalman(record, one + step) - kalman(record, one - step)) / 2e-5
        assert gradient[i] == pytest.approx(slope, rel=1e-4, abs=1e-2), likelihood.row.names[i]


def test_its_optimum_is_that_of_the_kalman_filter() -> None:
    fit = fitted()
    record = fit.in_time[0].record
    noise = [np.log(c.value) for c in fit.constants]
    best = np.array([*(fit[name].value for name in TRUTH), *noise])
    sigma = np.array([*(fit[name].sigma for name in TRUTH), *(c.sigma / c.value for c in fit.constants)])
    least = kalman(record, best)
    for i, spread in enumerate(sigma):
        for side in (-1.0, 1.0):
            moved = best.copy()
            moved[i] += 0.3 * side * spread
            assert kalman(record, moved) > least - 1e-3, i
    for name, value in TRUTH.items():
        assert abs(fit[name].value - value) < 3.0 * fit[name].sigma
    assert fit.to_document()["method"] == "collocation"
    assert sp.Result.from_document(fit.to_document(), equations=rolling())["Lb"].value == fit["Lb"].value
    other = sp.identify(rolling(), gusty(), free=list(TRUTH), outputs=OUTPUTS, method="prediction-error")
    for name in TRUTH:  # a free gain in place of noise of known origin: other noise, the same maximum but for that
        assert fit[name].value == pytest.approx(other[name].value, abs=0.5 * fit[name].sigma)
        assert fit[name].sigma == pytest.approx(other[name].sigma, rel=0.15)


def test_a_structure_is_fitted_as_the_vehicle_with_the_delay_of_its_input() -> None:
    """The log says three samples early what is held for one sample, so half a sample more, in straight lines."""
    late = SAME.replace("[parameters]", '[delays]\nstick = "late"\n[parameters]\nlate = {value = 0.05, lower = 0.0}')
    flown = gusty()
    data = flown.streams["uniform"]
    behind = np.roll(data["stick"].values, -3)
    behind[-3:] = behind[-4]
    early = flown.with_streams({"uniform": data.assign({"stick": ("time", behind)})})
    one = sp.identify(parse(late), early, method="collocation", shifts=False)
    two = fitted()
    for name in TRUTH:
        assert one[name].value == pytest.approx(two[name].value, abs=two[name].sigma)
        assert one.solution.parameters[name].value == one[name].value
    assert one["late"].value == pytest.approx(0.07, abs=3.0 * one["late"].sigma)
    assert one["late"].sigma < 0.005


def test_what_cannot_be_estimated_is_said() -> None:
    flown = gusty()
    asked = {"free": list(TRUTH), "method": "collocation"}
    tilted = tipped(0, seconds=2.0)
    with pytest.raises(IdentificationError, match="do not tell every state"):
        sp.identify(tipping(Md=6.0), tilted, free=["Md"], method="collocation", outputs=("q",))
    idle = tipping(Md=6.0)
    dead = replace(idle, derivatives=lambda s, u, p, env, xp: Tilt(s.q, p.Md * u.stick + 0.0 * p.Mt))
    with pytest.raises(IdentificationError, match=r"Mt: leaves no trace.*another value than zero"):
        sp.identify(dead, tilted, free=["Mt", "Md"], method="collocation", outputs=("theta", "q"))
    with pytest.raises(IdentificationError, match="does not predict it"):
        sp.identify(rolling(), flown, outputs=("p", "stick"), **asked)
    with pytest.raises(IdentificationError, match="says itself what is free"):
        sp.identify(parse(SAME), flown, free=["Lb"], method="collocation")
    smooth = flown.condition(rate=50.0, cutoff=5.0, derive=False)
    with pytest.raises(FlightError, match="low-pass"):
        sp.identify(rolling(), smooth, outputs=("p",), **asked)


def test_steps_that_are_too_long_are_said(likelihood: CollocationErrors, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lag of 0.2 s is slow for samples every 0.02 s; one of 5 ms is not."""
    made = likelihood
    fine, error = made.fastest(made.begin)
    assert error < 1e-3 < collocation.COARSE
    fast = made.begin.copy()
    fast[1] = 0.005 / made.row.scale[1]
    mode, error = made.fastest(fast)
    assert mode.real == pytest.approx(-200.0, rel=0.1)
    assert error > 0.05 > collocation.COARSE
    assert not any("too fast" in words for words in fitted().warnings)
    monkeypatch.setattr(collocation, "COARSE", 1e-9)  # the same fit, and a stricter judge
    how = {"outputs": OUTPUTS, "method": "collocation", "iterations": 2}
    fit = sp.identify(rolling(), gusty(), free=list(TRUTH), **how)
    assert any("too fast for samples every 0.02 s" in words for words in fit.warnings)
    assert abs(fine) < 20.0


def test_a_chain_with_a_border_is_solved_as_a_dense_matrix() -> None:
    random, n, s, o, p = np.random.default_rng(0), 6, 2, 1, 3
    w, v = random.standard_normal((n - 1, s)), random.standard_normal((n, o))
    before, after = random.standard_normal((2, n - 1, s, s))
    chain = Chain(w, v, before, after, random.standard_normal((n, o, s)))
    border = Border(chain, random.standard_normal((n - 1, s, p)), random.standard_normal((n, o, p)))
    dense = np.zeros((w.size + v.size, n * s + p))
    for k in range(n - 1):
        dense[k * s : (k + 1) * s, k * s : (k + 2) * s] = np.hstack([before[k], after[k]])
    for k in range(n):
        dense[w.size + k * o : w.size + (k + 1) * o, k * s : (k + 1) * s] = chain.here[k]
    dense[:, n * s :] = np.concatenate([border.w.reshape(-1, p), border.v.reshape(-1, p)])
    right = np.concatenate([w.ravel(), v.ravel()])
    whole = -np.linalg.lstsq(dense, right)[0]
    found = eliminated([border])
    assert found is not None
    step = -np.linalg.solve(found.information, found.pull)
    assert step == pytest.approx(whole[n * s :])
    assert found.states(step)[0] == pytest.approx(whole[: n * s])
    covariance = np.linalg.inv(dense.T @ dense)
    assert np.linalg.inv(found.information) == pytest.approx(covariance[n * s :, n * s :])
    blind = Chain(w, v, 0.0 * before, 0.0 * after, chain.here)
    assert factor(blind.band()) is None
    assert eliminated([Border(blind, border.w, border.v)]) is None
