"""The No-U-Turn sampler on a likelihood's exact gradients, whitened by the Fisher information at its optimum.

Hoffman and Gelman (2014), by blackjax; the metric is the information with the priors' (Girolami and Calderhead 2011,
held at the optimum), so that every direction has a standard deviation of about one and only the step is to be learnt.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import blackjax
import jax
import jax.numpy as jnp
import numpy as np
from blackjax.adaptation.step_size import dual_averaging_adaptation
from blackjax.mcmc.hmc import HMCState

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.scoring import TracedCost
from swashplate.identification.core.whitened import Chains, unbent, whitening
from swashplate.simulation.dynamics import enable_double_precision

Density = Callable[[Any, Any, Any], Any]
Target = tuple[Density, Hashable, Mapping[str, Any]]
_ACCEPTED = 0.8
"""Mean acceptance that the step is chosen for: longer steps mix worse on a real flight (decision 119)."""
_FIRST_STEP = 0.4
_SETTLING = 20
"""Draws that a chain drops which takes the step that another has found."""
_DOUBLINGS = 8
_STATS = ("lp", "diverging", "energy", "tree_depth", "n_steps", "acceptance_rate")


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
    parts: list[list[tuple[Array, Array]]] = [[] for _ in range(chains)]
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
                parts[c].append((rows, stats))
            done += size
            chain = _together(parts, steps)
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


def _together(parts: list[list[tuple[Array, Array]]], steps: Array) -> Chains:
    rows = np.stack([np.concatenate([rows for rows, _ in one]) for one in parts])
    stats = np.stack([np.concatenate([stats for _, stats in one]) for one in parts])
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
    numbers = whitening(row, optimum, covariance)
    return {"likelihood": traced.data, **{name: jnp.asarray(value) for name, value in numbers.items()}}


def _density(function: Density, plan: Hashable, data: Mapping[str, Any], z: jax.Array) -> Any:
    row, stretch = unbent(data, z, jnp)
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
    return following, unbent(data, following.position, jnp)[0], stats
