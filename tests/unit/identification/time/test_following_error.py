"""The filter whose gain follows what is flown: one step, its gradient, and what it whitens."""

from __future__ import annotations

from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import swashplate as sp
from simulated_flights import FREE, TIE, ten_seconds
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.time.following_error import FollowingError, _predicted
from swashplate.simulation.compilation import QUICK_TO_COMPILE
from swashplate.validation.calibration import first_part


@lru_cache(maxsize=1)
def _likelihood() -> FollowingError:
    (record,) = records(ten_seconds().condition(rate=100.0, cutoff=0.0), sp.vehicle("coax"))
    noise = Noise(wind=0.1, speed=0.2, line_hertz=-34.4, sensor_heading=1e-3)
    return FollowingError(parameterize(sp.vehicle("coax"), FREE, ties=[TIE]), [first_part(record, 2.5)], noise=noise)


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

    @partial(jax.jit, compiler_options=QUICK_TO_COMPILE)
    def predicted(P: jax.Array) -> tuple[FilterState, jax.Array]:
        return _predicted(model, state, P, u, volts, numbers)

    def step(z: jax.Array) -> jax.Array:
        state = FilterState(z[:n], z[n:d], z[d:k], z[k:])
        after = model.step(state.x, model.acting(state), u, parameters, volts)
        return jnp.concatenate(
            [after, model.fade(noise) * state.gust, state.drift, model.line_turn(noise) @ state.line]
        )

    root = 1e-6 * rng.standard_normal((joined, joined))
    state = FilterState(whole[:n], whole[n:d], whole[d:k], whole[k:])
    after, P = predicted(jnp.asarray(root @ root.T))
    _, still = predicted(jnp.zeros((joined, joined)))
    F = jax.jit(jax.jacfwd(step), compiler_options=QUICK_TO_COMPILE)(whole)
    np.testing.assert_allclose(np.concatenate(after), step(whole), rtol=1e-8, atol=1e-10)
    expected = F @ root @ root.T @ F.T
    np.testing.assert_allclose(P - still, expected, atol=2e-3 * np.abs(expected).max())


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
