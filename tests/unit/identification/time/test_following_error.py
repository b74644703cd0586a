"""The filter whose gain follows what is flown: one step, its gradient, and what it whitens."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from scipy.special import erf

import swashplate as sp
from simulated_flights import FREE, TIE, ten_seconds
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState
from swashplate.identification.core import robust
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.time import following_error
from swashplate.identification.time.beginning import seen_at_start
from swashplate.identification.time.calibration import first_part
from swashplate.identification.time.following_error import (
    _AWAY,
    _SHARES,
    Followed,
    FollowingError,
    _begun,
    _corrected,
    _off,
    _predicted,
)
from swashplate.identification.time.start_states import slopes_ahead
from swashplate.simulation.compilation import RUN_RARELY


@lru_cache(maxsize=1)
def _likelihood() -> FollowingError:
    (record,) = records(ten_seconds().condition(rate=100.0, cutoff=0.0), sp.vehicle("coax"))
    noise = Noise(wind=0.1, speed=0.2, line_hertz=-34.4, sensor_heading=1e-3)
    return FollowingError(parameterize(sp.vehicle("coax"), FREE, ties=[TIE]), [first_part(record, 2.5)], noise=noise)


@pytest.fixture
def one_lane(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows one after the other: one program where eight lanes would be a second."""
    monkeypatch.setattr(following_error, "_LANES", 1)


def test_a_step_carries_the_covariance_by_the_slopes_of_the_equations() -> None:
    """With next to nothing unknown, P+ - Q = F P F', F from the whole step by JAX instead of from the rates."""
    likelihood = _likelihood()
    model = likelihood.model
    run = likelihood._runs[0]
    numbers = run.placed(likelihood.table.card_row, np.array(likelihood.noise), likelihood.row.starts())[1]
    rng = np.random.default_rng(3)
    n, d, k = np.cumsum([len(model.vehicle.state_names), model.n_gusts, N_DISTURBANCES])
    joined = int(k) + model.n_line
    x = likelihood.constant.runs(likelihood.row.starts())[0].states.x[100]
    whole = jnp.concatenate([jnp.asarray(x), jnp.asarray(0.3 * rng.standard_normal(joined - n))])
    u, volts = run.inputs[100], run.voltage[100]
    parameters = model.vehicle.parameters(*numbers.parameters)
    noise = Noise(*numbers.noise)

    @partial(jax.jit, compiler_options=RUN_RARELY)
    def predicted(P: jax.Array) -> tuple[FilterState, jax.Array]:
        return _predicted(model, state, P, u, volts, numbers)

    def step(z: jax.Array) -> tuple[jax.Array, jax.Array]:
        state = FilterState(z[:n], z[n:d], z[d:k], z[k:])
        after = model.step(state.x, model.acting(state), u, parameters, volts)
        joined = jnp.concatenate(
            [after, model.fade(noise) * state.gust, state.drift, model.line_turn(noise) @ state.line]
        )
        return joined, joined

    root = 1e-6 * rng.standard_normal((joined, joined))
    state = FilterState(whole[:n], whole[n:d], whole[d:k], whole[k:])
    after, P = predicted(jnp.asarray(root @ root.T))
    _, still = predicted(jnp.zeros((joined, joined)))
    F, following = jax.jit(jax.jacfwd(step, has_aux=True), compiler_options=RUN_RARELY)(whole)
    np.testing.assert_allclose(np.concatenate(after), following, rtol=1e-8, atol=1e-10)
    expected = F @ root @ root.T @ F.T
    np.testing.assert_allclose(P - still, expected, atol=2e-3 * np.abs(expected).max())


def test_averages_over_the_air_speed_are_those_of_a_normal_distribution() -> None:
    """x |x| about any mean: its average and its average slope (by parts: 2 |x|), in units of the spread."""
    mean = np.linspace(-4.0, 4.0, 81)
    inside, density = erf(mean / np.sqrt(2.0)), np.exp(-0.5 * mean**2) / np.sqrt(2.0 * np.pi)
    places = np.append(_AWAY, 0.0) + mean[:, None]
    values = places * np.abs(places) @ np.append(_SHARES, 1.0 - _SHARES.sum())
    slopes = places[:, :-1] * np.abs(places[:, :-1]) @ (_SHARES * _AWAY)
    np.testing.assert_allclose(values, (mean**2 + 1.0) * inside + 2.0 * mean * density, atol=0.012)
    np.testing.assert_allclose(slopes, 2.0 * (mean * inside + 2.0 * density), rtol=0.007)
    np.testing.assert_allclose(_SHARES @ _AWAY**2, 1.0, atol=1e-4)  # and parabolas are exact


def test_what_was_not_read_tells_nothing() -> None:
    """A bridge over a gap is no reading: it moves neither state nor covariance, and is not counted."""
    likelihood = _likelihood()
    run, (piece,) = likelihood._runs[0], likelihood.pieces
    numbers = run.placed(likelihood.table.card_row, np.array(likelihood.noise), likelihood.row.starts())[1]
    states = likelihood.constant.runs(likelihood.row.starts())[0].states
    state = jax.tree.map(lambda rows: jnp.asarray(rows[100]), states)
    joined = sum(len(part) for part in state)
    P = 1e-4 * jnp.eye(joined)

    @partial(jax.jit, compiler_options=RUN_RARELY)
    def corrected(y: jax.Array) -> tuple[FilterState, jax.Array, jax.Array, jax.Array]:
        return _corrected(likelihood.model, state, P, y, numbers)

    reading = jnp.asarray(piece.outputs[100])
    after, told, _, _ = corrected(reading)
    same, still, nu, _ = corrected(jnp.full_like(reading, jnp.nan))
    assert np.trace(told) < np.trace(P)
    assert not np.allclose(after.x, state.x, atol=1e-6)
    np.testing.assert_array_equal(np.concatenate(same), np.concatenate(state))
    np.testing.assert_array_equal(still, P)
    assert not np.any(nu)
    holed = replace(piece, bridged=((piece.time[199], piece.time[203]),))
    other = FollowingError(likelihood.table, [holed], noise=likelihood.noise)
    assert list(np.flatnonzero(np.isnan(other._readings[0][:, 0]))) == [200, 201, 202]
    assert list(np.flatnonzero(likelihood.counted[0] & ~other.counted[0])) == [200, 201, 202]


def test_a_record_that_begins_in_a_maneuver_says_how_far_off_its_states_may_be() -> None:
    """Rates by a line through 0.15 s, rotors and bars as if settled, and air of which nothing is known."""
    likelihood = _likelihood()
    run, (piece,), (spread,) = likelihood._runs[0], likelihood.pieces, likelihood._spread
    (went,) = likelihood.constant.runs(likelihood.row.starts())
    n, noise = len(spread), likelihood.noise
    off, sure = [], np.zeros(0)
    for place in range(0, piece.time.size - 50, 4):
        later = replace(piece, **{k: getattr(piece, k)[place:] for k in ("time", "inputs", "outputs", "voltage")})
        seen = seen_at_start(likelihood.table.vehicle, later)
        np.testing.assert_allclose([part[place] for part in slopes_ahead(piece)], [seen.value, seen.rate], atol=1e-9)
        numbers = went.numbers._replace(inputs=went.commands[place : place + 50].mean(axis=0))
        numbers = jax.tree.map(lambda row: np.asarray(row)[None], numbers)
        state, P = _begun(likelihood.model, numbers, run.seen._replace(value=seen.value, rate=seen.rate), spread)
        off.append(np.asarray(state.x)[0] - went.states.x[place])
        sure = np.asarray(P)[0] - scipy.linalg.block_diag(spread, np.zeros((len(P[0]) - n,) * 2))
    distance = np.sqrt(np.mean(np.array(off) ** 2, axis=0) / np.diag(spread))
    assert np.all((distance > 0.8) & (distance < 1.25))  # every fourth place stands for all
    moved = [likelihood.table.vehicle.index(name) for name in ("p", "q", "eta_bar", "zeta_bar")]
    assert np.all(np.diag(spread)[moved] > np.diag(sure)[moved])  # more than a filter leaves open that has settled
    wind = float(noise.wind) * np.sqrt(0.5 * float(noise.tau_wind))
    assert np.all(np.sqrt(np.diag(sure))[n + N_DISTURBANCES : n + N_DISTURBANCES + 2] > 0.99 * wind)
    lost = went._replace(states=went.states._replace(x=np.full_like(went.states.x, np.nan)))
    assert not np.any(_off(likelihood.table.vehicle, piece, run, lost))


@pytest.mark.parametrize("name", [*FREE, "wind", "line_angle"])
def test_scores_are_slopes_of_the_cost_whatever_the_filter(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Innovations and covariances that bend with all numbers, in the place of the filter's own."""
    likelihood = FollowingError(_likelihood().table, _likelihood().pieces, noise=_likelihood().noise)

    def some(model: Any, run: Any, readings: Any, spread: Any, placed: list[tuple[Any, Any]]) -> Followed:
        told = np.array([np.concatenate([n.parameters, n.noise, n.nuisance]) for _, n in placed])
        rng, (count, outputs) = np.random.default_rng(6), readings.shape
        bent = np.sin(told * 10.0 ** -np.round(np.log10(np.abs(told) + 1e-6)) + 1.0)
        ways = rng.standard_normal((bent.shape[1], count + outputs, outputs))
        turned = np.tensordot(bent, ways, 1)
        nu = rng.standard_normal((count, outputs)) + 0.3 * turned[:, :count]
        root = np.eye(outputs) + 0.03 * np.tril(turned[:, count:])
        S = np.repeat((root @ np.swapaxes(root, 1, 2))[:, None], count, axis=1)
        return Followed(nu, S, FilterState(*[nu] * 4))

    monkeypatch.setattr(following_error, "_along_some", some)
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


@pytest.mark.proof
@pytest.mark.usefixtures("one_lane")
def test_the_gradient_is_the_slope_of_the_cost() -> None:
    likelihood = _likelihood()
    row = likelihood.row.starts() + 0.05 * np.random.default_rng(1).standard_normal(len(likelihood.row))
    cost, gradient, information = likelihood.scores(row)
    assert cost == pytest.approx(likelihood.cost(row), rel=1e-12)
    size = np.sqrt(np.diag(information))
    for name in ("tau_f_upper", "wind", "line_angle"):
        step = np.zeros(row.size)
        place = likelihood.row.names.index(name)
        step[place] = 1e-2 / max(size[place], 1.0)
        slope = (likelihood.cost(row + step) - likelihood.cost(row - step)) / (2.0 * step[place])
        assert gradient[place] == pytest.approx(slope, rel=0.01, abs=0.02 * size[place]), name


@pytest.mark.proof
def test_rows_side_by_side_are_those_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    likelihood = _likelihood()
    row = likelihood.row.starts()
    rows = [row, *(row + step for step in 1e-3 * np.eye(len(row)))]
    (eight,) = likelihood._followed(rows)
    monkeypatch.setattr(following_error, "_LANES", 1)
    (one,) = likelihood._followed(rows)
    for side, alone in zip(jax.tree.leaves(eight), jax.tree.leaves(one), strict=True):
        np.testing.assert_allclose(side, alone, rtol=1e-9, atol=1e-11 * np.abs(alone).max())


@pytest.mark.parametrize("count", [1, 3, 8, 11])
def test_every_row_comes_back_in_its_place(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lanes that are left over repeat the last row; a row alone has one lane."""
    likelihood, lanes = _likelihood(), []

    def some(
        model: object, run: object, readings: object, spread: object, placed: list[tuple[object, Any]]
    ) -> Followed:
        lanes.append(len(placed))
        parameters = np.array([numbers.parameters for _, numbers in placed])
        return Followed(parameters, parameters, FilterState(*[parameters] * 4))

    monkeypatch.setattr(following_error, "_along_some", some)
    row = likelihood.row.starts()
    rows = [row * (1.0 + 0.01 * k) for k in range(count)]
    (found,) = likelihood._followed(rows)
    given = likelihood.table.card_row, np.array(likelihood.noise)
    expected = [likelihood._runs[0].placed(*given, one * likelihood.row.scale)[1].parameters for one in rows]
    np.testing.assert_array_equal(found.innovations, expected)
    assert lanes == ([1] if count == 1 else [8] * -(-count // 8))


@pytest.mark.proof
@pytest.mark.usefixtures("one_lane")
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
        _likelihood().traced()
