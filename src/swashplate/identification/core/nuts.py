"""The No-U-Turn sampler on a likelihood's exact gradients, whitened by the Fisher information at its optimum.

Hoffman and Gelman (2014), by blackjax; the metric is the information with the priors' (Girolami and Calderhead 2011,
held at the optimum), so that every direction has a standard deviation of about one and only the step is to be learnt.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import blackjax
import jax
import jax.numpy as jnp
import numpy as np
from blackjax.adaptation.step_size import dual_averaging_adaptation
from blackjax.diagnostics import effective_sample_size, potential_scale_reduction
from blackjax.mcmc.hmc import HMCState

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.scoring import TracedCost
from swashplate.simulation.dynamics import enable_double_precision

Density = Callable[[Any, Any, Any], Any]
Target = tuple[Density, Hashable, Mapping[str, Any]]
_NEAR = 8.0
"""Sigmas from the optimum within which a bound bends the scale; farther ones only end it."""
_INSIDE = 0.5
"""Sigmas that the bent scale's middle keeps from a bound on which the optimum lies."""
_ACCEPTED = 0.8
"""Mean acceptance that the step is chosen for (Stan's)."""
_FIRST_STEP = 0.4
_SETTLING = 20
"""Draws that a chain drops which takes the step that another has found."""
_DOUBLINGS = 8
_STATS = ("lp", "diverging", "energy", "tree_depth", "n_steps", "acceptance_rate")


@dataclass(frozen=True)
class Chains:
    """What the sampler found: scaled rows (chains, draws, p), statistics (chains, draws) each, steps (chains,)."""

    rows: Array
    stats: Mapping[str, Array]
    step: Array


def split_rhat(draws: Array) -> Array:
    """Split-R-hat of every number, (p,): chains cut in halves, against one another. Draws (chains, draws, p)."""
    half = draws.shape[1] // 2
    split = np.concatenate([draws[:, :half], draws[:, -half:]])
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(potential_scale_reduction(jnp.asarray(split)), dtype=np.float64)


def effective(draws: Array) -> Array:
    """Effective number of draws of every number, (p,), of draws (chains, draws, p)."""
    return np.asarray(effective_sample_size(jnp.asarray(draws)), dtype=np.float64)


def sample(
    traced: TracedCost,
    row: Row,
    optimum: Array,
    covariance: Array,
    *,
    chains: int,
    warmup: int,
    block: int,
    most: int,
    enough: Callable[[Chains], bool],
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> Chains:
    """Draws from exp(-cost - prior).

    Args:
        traced: the cost. row: its entries, with bounds and priors.
        optimum: scaled row to start from (p,). covariance: inverse of information and priors there (p, p).
        chains: how many, each from a point of its own as far from the optimum as the metric says.
        warmup: draws of the first chain in which the step of all is found, dropped.
        block: draws between two looks at `enough`, which ends it; most: draws of a chain at most.
        seed: of all that is random.
        progress: told draws of a chain so far and at most.
    """
    data = _prepared(traced, row, optimum, covariance)
    numbers = len(row)
    random = np.random.default_rng(seed)
    starts = [jnp.asarray(random.standard_normal(numbers)) for _ in range(chains)]
    keys = list(jax.random.split(jax.random.key(seed), chains))
    target = (traced.function, traced.plan, data)
    states = [_alive(target, start) for start in starts]
    np.asarray(_step(*target, keys[0], states[0], _FIRST_STEP)[1])  # compiled once, before there are threads
    found: list[list[tuple[Array, Array]]] = [[] for _ in range(chains)]
    with ThreadPoolExecutor(max_workers=min(chains, os.cpu_count() or 1)) as pool:
        states[0], step = _warmed(target, warmup, keys[0], states[0])
        settle, steps = min(warmup, _SETTLING), np.full(chains, step)
        # The metric is one, and so is the step: the other chains only leave where they began.
        settled = [pool.submit(_drawn, target, keys[c], states[c], step, -settle, settle) for c in range(1, chains)]
        states[1:] = [job.result()[0] for job in settled]
        done, chain = 0, None
        while done < most:
            size = min(block, most - done)
            jobs = [pool.submit(_drawn, target, keys[c], states[c], steps[c], done, size) for c in range(chains)]
            for c, job in enumerate(jobs):
                states[c], rows, stats = job.result()
                found[c].append((rows, stats))
            done += size
            chain = _together(found, steps)
            if progress is not None:
                progress(done, most)
            if enough(chain):
                break
    assert chain is not None
    return chain


def _alive(target: Target, start: jax.Array) -> Any:
    """The sampler's state at a start, which comes nearer to the optimum as long as the model diverges there."""
    state = _begin(*target, start)
    for _ in range(6):
        if np.isfinite(float(state.logdensity)):
            break
        start = 0.5 * start
        state = _begin(*target, start)
    return state


def _together(found: list[list[tuple[Array, Array]]], steps: Array) -> Chains:
    rows = np.stack([np.concatenate([rows for rows, _ in one]) for one in found])
    stats = np.stack([np.concatenate([stats for _, stats in one]) for one in found])
    return Chains(rows, {name: stats[:, :, i] for i, name in enumerate(_STATS)}, steps)


def _warmed(target: Target, warmup: int, key: jax.Array, state: HMCState) -> tuple[Any, float]:
    begin, update, final = dual_averaging_adaptation(_ACCEPTED)
    adapting = begin(_FIRST_STEP)
    for k in range(warmup):
        step = float(np.exp(adapting.log_step_size))
        state, _, stats = _step(*target, jax.random.fold_in(key, k), state, min(step, 2.0))
        adapting = update(adapting, stats[_STATS.index("acceptance_rate")])
    return state, float(final(adapting)) if warmup else _FIRST_STEP


def _drawn(
    target: Target, key: jax.Array, state: HMCState, step: float, first: int, count: int
) -> tuple[Any, Array, Array]:
    rows: list[Array] = []
    stats: list[Array] = []
    for k in range(first, first + count):
        state, row, told = _step(*target, jax.random.fold_in(key, (1 << 20) + k), state, step)
        rows.append(np.asarray(row))
        stats.append(np.asarray(told))
    return state, np.array(rows), np.array(stats)


# ---- the density in whitened numbers ---------------------------------------------------------------------------------
def _prepared(traced: TracedCost, row: Row, optimum: Array, covariance: Array) -> dict[str, Any]:
    """The arrays that the density needs, those of the likelihood among them."""
    enable_double_precision()
    sigma = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    low, high = row.bounds()
    middle = np.minimum(np.maximum(optimum, low + _INSIDE * sigma), high - _INSIDE * sigma)
    tight = ~(low < middle) | ~(middle < high)
    middle = np.where(tight, 0.5 * (np.where(tight, low, 0.0) + np.where(tight, high, 0.0)), middle)
    below, above = middle - low < _NEAR * sigma, high - middle < _NEAR * sigma
    values, vectors = np.linalg.eigh(covariance / np.outer(sigma, sigma))
    root = sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    numbers = {
        "middle": middle,
        "low": low,
        "high": high,
        "gap_low": np.where(below, middle - low, 1.0),
        "gap_high": np.where(above, high - middle, 1.0),
        "below": below,
        "above": above,
        "root": root,
        "mean": row.column("mean") / row.scale,
        "prior": row.prior_information,
    }
    return {"likelihood": traced.data, **{name: jnp.asarray(value) for name, value in numbers.items()}}


def _unbent(data: Mapping[str, Any], z: jax.Array) -> tuple[Any, Any]:
    """The scaled row of whitened numbers, and the logarithm of what the bent scales stretch.

    A scale with a near bound is bent so that the bound lies at infinity: exponential for one bound, logistic for two;
    at the middle its slope is one.
    """
    away = data["root"] @ z
    a, b = data["gap_low"], data["gap_high"]
    up, down = jnp.exp(away / a), jnp.exp(-away / b)
    both = data["below"] & data["above"]
    width, share = a + b, a / (a + b)
    steep = width / (a * b)
    place = jnp.log(a / b) + steep * away
    value = jnp.where(
        both,
        data["low"] + width * jax.nn.sigmoid(place),
        jnp.where(
            data["below"],
            data["low"] + a * up,
            jnp.where(data["above"], data["high"] - b * down, data["middle"] + away),
        ),
    )
    logistic = jax.nn.log_sigmoid(place) + jax.nn.log_sigmoid(-place) - jnp.log(share * (1.0 - share))
    stretch = jnp.where(both, logistic, jnp.where(data["below"], away / a, jnp.where(data["above"], -away / b, 0.0)))
    return value, stretch.sum()


def _density(function: Density, plan: Hashable, data: Mapping[str, Any], z: jax.Array) -> Any:
    row, stretch = _unbent(data, z)
    away = row - data["mean"]
    total = -function(plan, data["likelihood"], row) - 0.5 * away @ data["prior"] @ away + stretch
    allowed = jnp.all((row >= data["low"]) & (row <= data["high"]))
    return jnp.where(jnp.isfinite(total) & allowed, total, -jnp.inf)


@partial(jax.jit, static_argnums=(0, 1))
def _begin(function: Density, plan: Hashable, data: Mapping[str, Any], z: jax.Array) -> Any:
    return blackjax.nuts.init(z, lambda place: _density(function, plan, data, place))


@partial(jax.jit, static_argnums=(0, 1))
def _step(
    function: Density, plan: Hashable, data: Mapping[str, Any], key: jax.Array, state: HMCState, step: float
) -> tuple[Any, Any, Any]:
    """The next state, its scaled row and its statistics."""
    following, info = blackjax.nuts.build_kernel()(
        key,
        state,
        lambda place: _density(function, plan, data, place),
        step,
        jnp.ones(data["middle"].shape[0]),
        _DOUBLINGS,
    )
    told = (
        following.logdensity,
        info.is_divergent,
        info.energy,
        info.num_trajectory_expansions,
        info.num_integration_steps,
        info.acceptance_rate,
    )
    stats = jnp.stack([jnp.asarray(value, dtype=following.logdensity.dtype) for value in told])
    return following, _unbent(data, following.position)[0], stats
