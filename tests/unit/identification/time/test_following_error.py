"""The filter whose gain follows what is flown: one step, its gradient, and what it whitens."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy.special import erf

import swashplate as sp
from simulated_flights import FREE, TIE, ten_seconds
from swashplate.compiled import can_compile
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState
from swashplate.filtering.filter_code import Followed, RecordSeries, driving_rows
from swashplate.filtering.filter_library import VirtualFilter, filter_code
from swashplate.filtering.following import AWAY, SHARES, FollowingRows
from swashplate.identification.core import robust
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.scoring import Solver, minimise
from swashplate.identification.time.beginning import FilterNumbers, FirstMotion, numbers_and_constants, seen_at_start
from swashplate.identification.time.calibration import first_part
from swashplate.identification.time.following_error import (
    CarriedSlopes,
    FollowingError,
    _off,
    following_from,
    searched,
)
from swashplate.identification.time.record_filter import record_filter
from swashplate.identification.time.start_states import slopes_ahead


@lru_cache(maxsize=1)
def _likelihood() -> FollowingError:
    (record,) = records(ten_seconds().condition(rate=100.0, cutoff=0.0), sp.vehicle("coax"))
    noise = Noise(wind=0.1, speed=0.2, sensor_heading=1e-3)
    return FollowingError(parameterize(sp.vehicle("coax"), FREE, ties=[TIE]), [first_part(record, 2.5)], noise=noise)


def _rows(likelihood: FollowingError, numbers: FilterNumbers, seen: FirstMotion, spread: np.ndarray) -> FollowingRows:
    model = likelihood.model
    return FollowingRows(model, filter_code(model), following_from(model, numbers, seen, spread))


def _beside(rows: int = 1) -> FollowingRows:
    """Rows of a filter somewhere along the flight, alike."""
    likelihood = _likelihood()
    run, start = likelihood._runs[0], likelihood.row.starts()
    numbers = run.placed(likelihood.table.card_row, np.array(likelihood.noise), start)[1]
    many = FilterNumbers(*(np.repeat(np.asarray(part)[None], rows, axis=0) for part in numbers))
    beside = _rows(likelihood, many, run.motion, likelihood._spread[0])
    states = likelihood.constant.runs(start)[0].states
    beside.state = FilterState(*(np.repeat(part[100][None], rows, axis=0) for part in states))
    return beside


def test_a_step_carries_the_covariance_by_the_slopes_of_the_equations() -> None:
    """With next to nothing unknown, P+ - Q = F P F', F by differences of whole steps instead of from the rates."""
    likelihood, rng = _likelihood(), np.random.default_rng(3)
    model, run = likelihood.model, likelihood._runs[0]
    n, d, joined = np.cumsum([len(model.vehicle.state_names), model.n_gusts, N_DISTURBANCES]).tolist()
    drives = driving_rows(run.inputs[100:101], run.voltage[100:101])[0]
    whole = np.concatenate([_beside().state.x[0], 0.3 * rng.standard_normal(joined - n)])

    def after(states: np.ndarray, P: np.ndarray) -> FollowingRows:
        beside = _beside(len(states))
        beside.state = FilterState(*np.split(states, [n, d], axis=1))
        beside.covariance = np.broadcast_to(P, (len(states), joined, joined))
        beside.predicted(np.broadcast_to(drives, (len(states), len(drives))))
        return beside

    nothing, root, step = np.zeros((joined, joined)), 1e-6 * rng.standard_normal((joined, joined)), 1e-5
    ways = step * np.eye(joined)
    around = [np.concatenate(after(whole + factor * ways, nothing).state, axis=1) for factor in (1.0, -1.0)]
    F = (around[0] - around[1]).T / (2.0 * step)
    found = after(whole[None], root @ root.T).covariance[0] - after(whole[None], nothing).covariance[0]
    expected = F @ root @ root.T @ F.T
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


def test_a_calm_step_is_that_of_the_equations() -> None:
    """Of nothing unknown in still air: the state of the filter with a constant gain."""
    likelihood, beside = _likelihood(), _beside()
    run = likelihood._runs[0]
    beside.covariance = 0.0 * beside.covariance
    before = beside.state
    beside.predicted(driving_rows(run.inputs[100:101], run.voltage[100:101]))
    numbers = likelihood.numbers(likelihood.row.starts())[0].parameters
    told = numbers_and_constants(likelihood.table.vehicle, numbers)
    step = record_filter(likelihood.model).step
    plain = step(before.x, before.gust, before.drift, run.inputs[100][None], run.voltage[100][None], told)
    np.testing.assert_allclose(beside.state.x, plain, atol=2e-6)  # the air speed is held to be unsure by 0.1 mm/s


def test_averages_over_the_air_speed_are_those_of_a_normal_distribution() -> None:
    """x |x| about any mean: its average and its average slope (by parts: 2 |x|), in units of the spread."""
    mean = np.linspace(-4.0, 4.0, 81)
    inside, density = erf(mean / np.sqrt(2.0)), np.exp(-0.5 * mean**2) / np.sqrt(2.0 * np.pi)
    places = np.append(np.array(AWAY), 0.0) + mean[:, None]
    values = places * np.abs(places) @ np.append(np.array(SHARES), 1.0 - np.array(SHARES).sum())
    slopes = places[:, :-1] * np.abs(places[:, :-1]) @ (np.array(SHARES) * np.array(AWAY))
    np.testing.assert_allclose(values, (mean**2 + 1.0) * inside + 2.0 * mean * density, atol=0.012)
    np.testing.assert_allclose(slopes, 2.0 * (mean * inside + 2.0 * density), rtol=0.007)
    np.testing.assert_allclose(np.array(SHARES) @ np.array(AWAY) ** 2, 1.0, atol=1e-4)  # and parabolas are exact


def test_what_was_not_read_tells_nothing() -> None:
    """A bridge over a gap is no reading: it moves neither state nor covariance, and is not counted."""
    likelihood = _likelihood()
    (piece,), beside = likelihood.records, _beside()
    before = beside.state
    beside.covariance = P = 1e-4 * np.eye(beside.covariance.shape[1])[None]
    nu, _ = beside.corrected(np.full_like(piece.outputs[100], np.nan))
    np.testing.assert_array_equal(np.concatenate(beside.state, axis=1), np.concatenate(before, axis=1))
    np.testing.assert_array_equal(beside.covariance, P)
    assert not np.any(nu)
    beside.corrected(piece.outputs[100])
    assert np.trace(beside.covariance[0]) < np.trace(P[0])
    assert not np.allclose(beside.state.x, before.x, atol=1e-6)
    holed = replace(piece, bridged=((piece.time[199], piece.time[203]),))
    other = FollowingError(likelihood.table, [holed], noise=likelihood.noise)
    assert list(np.flatnonzero(np.isnan(other._readings[0][:, 0]))) == [200, 201, 202]
    assert list(np.flatnonzero(likelihood.counted[0] & ~other.counted[0])) == [200, 201, 202]


def test_a_record_that_begins_in_a_maneuver_says_how_far_off_its_states_may_be() -> None:
    """Rates by a line through 0.15 s, rotors and bars as if settled, and air of which nothing is known."""
    likelihood = _likelihood()
    run, (piece,), (spread,) = likelihood._runs[0], likelihood.records, likelihood._spread
    (went,) = likelihood.constant.runs(likelihood.row.starts())
    n, noise = len(spread), likelihood.noise
    off, sure = [], np.zeros(0)
    for place in range(0, piece.time.size - 50, 4):
        later = replace(piece, **{k: getattr(piece, k)[place:] for k in ("time", "inputs", "outputs", "voltage")})
        seen = seen_at_start(likelihood.table.vehicle, later)
        np.testing.assert_allclose([part[place] for part in slopes_ahead(piece)], [seen.value, seen.rate], atol=1e-9)
        numbers = went.numbers._replace(inputs=went.commands[place : place + 50].mean(axis=0))
        rows = FilterNumbers(*(np.asarray(row)[None] for row in numbers))
        begun = _rows(likelihood, rows, run.motion._replace(value=seen.value, rate=seen.rate), spread)
        off.append(begun.state.x[0] - went.states.x[place])
        sure = begun.covariance[0].copy()
        sure[:n, :n] -= spread
    distance = np.sqrt(np.mean(np.array(off) ** 2, axis=0) / np.diag(spread))
    assert np.all((distance > 0.8) & (distance < 1.25))  # every fourth place stands for all
    moved = [likelihood.table.vehicle.index(name) for name in ("p", "q", "eta_bar", "zeta_bar")]
    assert np.all(np.diag(spread)[moved] > np.diag(sure)[moved])  # more than a filter leaves open that has settled
    wind = float(noise.wind) * np.sqrt(0.5 * float(noise.tau_wind))
    assert np.all(np.sqrt(np.diag(sure))[n + N_DISTURBANCES : n + N_DISTURBANCES + 2] > 0.99 * wind)
    states = went.states._replace(x=np.full_like(went.states.x, np.nan))
    lost = went._replace(run=went.run._replace(states=states))
    assert not np.any(_off(likelihood.table.vehicle, piece, run, lost))


@pytest.mark.parametrize("name", [*FREE, "wind", "sensor_heading"])
def test_scores_are_slopes_of_the_cost_whatever_the_filter(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Innovations and covariances that bend with all numbers, in the place of the filter's own."""
    likelihood = FollowingError(_likelihood().table, _likelihood().records, noise=_likelihood().noise)

    def some(rows: list[Any]) -> list[Followed]:
        run, readings = likelihood._runs[0], likelihood._readings[0]
        placed = [
            run.placed(likelihood.table.card_row, np.array(likelihood.noise), r * likelihood.row.scale)[1] for r in rows
        ]
        told = np.array([np.concatenate([n.parameters, n.noise, n.nuisance]) for n in placed])
        rng, (count, outputs) = np.random.default_rng(6), readings.shape
        bent = np.sin(told * 10.0 ** -np.round(np.log10(np.abs(told) + 1e-6)) + 1.0)
        ways = rng.standard_normal((bent.shape[1], count + outputs, outputs))
        turned = np.tensordot(bent, ways, 1)
        nu = rng.standard_normal((count, outputs)) + 0.3 * turned[:, :count]
        root = np.eye(outputs) + 0.03 * np.tril(turned[:, count:])
        S = np.repeat((root @ np.swapaxes(root, 1, 2))[:, None], count, axis=1)
        return [Followed(nu, S, nu)]

    monkeypatch.setattr(likelihood, "_followed", some)
    row = likelihood.row.starts() + 0.05 * np.random.default_rng(1).standard_normal(len(likelihood.row))
    cost, gradient, information = likelihood.scores(row)
    assert cost == pytest.approx(likelihood.cost(row), rel=1e-12)
    place = likelihood.row.names.index(name)
    step = 1e-4 * (np.arange(row.size) == place)
    slope = (likelihood.cost(row + step) - likelihood.cost(row - step)) / 2e-4
    assert gradient[place] == pytest.approx(slope, rel=1e-3, abs=1e-3 * np.sqrt(information[place, place]))
    white, moved, rest = likelihood.whitened(row)
    weighed = robust.weights(white[0])[None]
    assert information == pytest.approx(np.einsum("pno,qno->pq", weighed * moved[0], moved[0]) + rest, rel=1e-9)


def test_a_search_by_carried_slopes_ends_where_one_by_exact_ones_does() -> None:
    likelihood, solver = _likelihood(), Solver(iterations=30, tolerance=0.2)
    start = minimise(likelihood.constant, Solver(tolerance=1.0)).row
    exact, carried = minimise(likelihood, solver, start=start), searched(likelihood, solver, start=start)
    assert carried.converged
    assert carried.cost < exact.history[0]
    assert abs(carried.cost - exact.cost) < 1.0  # of log-likelihood, in 27 numbers
    np.testing.assert_array_equal(carried.information, likelihood.scores(carried.row)[2])


def test_a_secant_shows_the_step_that_it_was_taken_from() -> None:
    """Carried slopes times the step are the change of the errors and of their covariance, to the letter."""
    likelihood = _likelihood()
    slopes, start = CarriedSlopes(likelihood), likelihood.row.starts()
    (before,) = slopes.moved_errors(start)
    way = 1e-2 * np.random.default_rng(1).standard_normal(start.size)
    (after,) = slopes.moved_errors(start + way)
    np.testing.assert_allclose(np.tensordot(way, after.slopes, 1), after.errors - before.errors, atol=1e-12)
    assert after.turned is not None
    L = after.factor
    changed = L @ np.tensordot(way, after.turned, 1) @ np.swapaxes(L, 1, 2)
    old = before.factor @ np.swapaxes(before.factor, 1, 2)
    np.testing.assert_allclose(changed, L @ np.swapaxes(L, 1, 2) - old, atol=1e-12)


@pytest.mark.proof
def test_the_gradient_is_the_slope_of_the_cost() -> None:
    likelihood = _likelihood()
    row = likelihood.row.starts() + 0.05 * np.random.default_rng(1).standard_normal(len(likelihood.row))
    cost, gradient, information = likelihood.scores(row)
    assert cost == pytest.approx(likelihood.cost(row), rel=1e-12)
    size = np.sqrt(np.diag(information))
    for name in ("tau_f_upper", "wind"):
        step = np.zeros(row.size)
        place = likelihood.row.names.index(name)
        step[place] = 1e-2 / max(size[place], 1.0)
        slope = (likelihood.cost(row + step) - likelihood.cost(row - step)) / (2.0 * step[place])
        assert gradient[place] == pytest.approx(slope, rel=0.01, abs=0.02 * size[place]), name


def test_rows_side_by_side_are_those_one_after_the_other() -> None:
    likelihood = _likelihood()
    row = likelihood.row.starts()
    rows = [row, *(row + step for step in 1e-3 * np.eye(len(row))[:2])]
    (beside,), alone = likelihood._followed(rows), [likelihood._followed([one])[0] for one in rows]
    for k, one in enumerate(alone):
        for found, expected in ((beside.innovations, one.innovations), (beside.covariances, one.covariances)):
            # Slopes and equilibria of rows beside the first are one step of Newton's method away from its own.
            np.testing.assert_allclose(found[k], expected[0], rtol=1e-6, atol=1e-7 * np.abs(expected).max())


@pytest.mark.skipif(not can_compile(), reason="no C compiler")
def test_in_c_it_is_the_same() -> None:
    """With a gap, a line and rows of other numbers."""
    likelihood = _likelihood()
    row, run, readings = likelihood.row.starts(), likelihood._runs[0], likelihood._readings[0].copy()
    readings[40:44] = np.nan
    given = likelihood.table.card_row, np.array(likelihood.noise)
    placed = [run.placed(*given, one * likelihood.row.scale) for one in (row, row + 0.01)]
    numbers = FilterNumbers(*map(np.stack, zip(*(each for _, each in placed), strict=True)))
    series = RecordSeries(readings, driving_rows(np.stack([u for u, _ in placed], axis=1), run.voltage))
    begin = following_from(likelihood.model, numbers, run.motion, likelihood._spread[0])
    codes = filter_code(likelihood.model), VirtualFilter(likelihood.model)
    assert [code.compiled_by for code in codes] == ["C", "NumPy"]
    for found, expected in zip(*(code.follow(likelihood.model.dt, begin, series) for code in codes), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-11 * np.abs(expected).max())


@pytest.mark.proof
def test_slopes_whiten_as_the_scores_count_them() -> None:
    likelihood = _likelihood()
    row = likelihood.row.starts()
    white, moved, rest = likelihood.whitened(row)
    information = likelihood.scores(row)[2]
    flat = moved[0].reshape(len(row), -1)
    assert white[0].shape[1] == len(likelihood.model.output_names)
    np.testing.assert_allclose(np.diag(flat @ flat.T + rest), np.diag(information), rtol=0.2)


def test_nuts_is_refused_where_it_would_draw_from_another_likelihood() -> None:
    with pytest.raises(IdentificationError, match=r"has a wind.*NUTS does not draw from"):
        _likelihood().slope(_likelihood().row.starts())
