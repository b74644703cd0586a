"""The No-U-Turn sampler on a likelihood's exact gradients, whitened by the Fisher information at its optimum.

Hoffman and Gelman (2014), by blackjax; the metric is the information with the priors' (Girolami and Calderhead 2011,
held at the optimum), and in it the slope of the gradients a little to either side: what one flight says of a number at
its bound, or of a noise that it hardly shows, is not what the information expects of all flights. So every direction
has a standard deviation of about one and only the step is to be learnt.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import blackjax
import numpy as np
from blackjax.mcmc.hmc import HMCState

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.scoring import TracedCost
from swashplate.identification.core.whitened import Chains, unbent, whitening
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.simulation.dynamics import enable_double_precision

Density = Callable[[Any, Any, Any], Any]
Target = tuple[Density, Hashable, Mapping[str, Any]]
_ACCEPTED = 0.8
"""Mean acceptance that the step is chosen for: longer steps mix worse on a real flight (decision 119)."""
_FIRST_STEP = 0.5
_ASIDE = 0.3
"""Standard deviations to either side at which gradients say how the density bends."""
_FLATTEST = 0.04
"""Of the information: less bending than this is taken for as much, so that no direction is made wider than five."""
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
        warmup: draws of each chain, dropped, in which it looks for a step; all then take the mean of these.
        block: draws between two looks at `enough`, which ends it; most: draws of a chain at most.
        seed: of all that is random.
        progress: told draws of a chain so far and at most.
    """
    data = _prepared(traced, row, optimum, covariance)
    numbers = len(row)
    random = np.random.default_rng(seed)
    starts = [jnp.asarray(random.standard_normal(numbers)) for _ in range(chains)]
    keys = list(jax.random.split(jax.random.key(seed), chains))
    target: Target = (traced.function, traced.plan, data)
    np.asarray(_step(*target, keys[0], _begin(*target, starts[0]), _FIRST_STEP)[1])  # compiled before there are threads
    parts: list[list[tuple[Array, Array]]] = [[] for _ in range(chains)]
    with ThreadPoolExecutor(max_workers=min(chains, os.cpu_count() or 1)) as pool:
        target = _evened(target, pool)
        warmed = [pool.submit(_warmed, target, warmup, keys[c], _alive(target, starts[c])) for c in range(chains)]
        states = [job.result()[0] for job in warmed]
        # The metric is one, and so is the step; a float as while they warmed, for which it is compiled.
        step = float(np.exp(np.mean([np.log(job.result()[1]) for job in warmed])))
        done, chain = 0, None
        while done < most:
            size = min(block, most - done)
            jobs = [pool.submit(_drawn, target, keys[c], states[c], step, done, size) for c in range(chains)]
            for c, job in enumerate(jobs):
                states[c], rows, stats = job.result()
                parts[c].append((rows, stats))
            done += size
            chain = _together(parts, np.full(chains, step))
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
    """The state after some draws, and the step that the second half of them took, by Robbins and Monro (1951)."""
    log, taken = float(np.log(_FIRST_STEP)), [float(np.log(_FIRST_STEP))]
    for k in range(warmup):
        state, _, stats = _step(*target, jax.random.fold_in(key, k), state, float(np.exp(log)))
        accepted = float(stats[_STATS.index("acceptance_rate")])
        log += ((accepted if np.isfinite(accepted) else 0.0) - _ACCEPTED) / np.sqrt(k + 1.0)
        taken.append(log)
    return state, float(np.exp(np.mean(taken[len(taken) // 2 :])))


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


def _evened(target: Target, pool: ThreadPoolExecutor) -> Target:
    """The target in numbers in which it bends alike in every direction, by differences of gradients at the optimum."""
    function, plan, data = target
    numbers = data["middle"].shape[0]
    sides = _ASIDE * np.stack([np.eye(numbers), -np.eye(numbers)], axis=1).reshape(-1, numbers)
    slopes = list(pool.map(lambda z: np.asarray(_begin(*target, jnp.asarray(z)).logdensity_grad), sides))
    high, low = np.array(slopes).reshape(numbers, 2, numbers).transpose(1, 0, 2)
    bends = (low - high) / (2.0 * _ASIDE)
    lost = ~np.all(np.isfinite(bends), axis=1)  # the model diverges there: as the information has it
    bends[lost] = bends[:, lost] = 0.0
    values, vectors = np.linalg.eigh(0.5 * (bends + bends.T) + np.diag(lost.astype(float)))
    stretched = vectors / np.sqrt(np.maximum(values, _FLATTEST))
    return function, plan, {**data, "root": data["root"] @ stretched}


def _density(function: Density, plan: Hashable, data: Mapping[str, Any], z: jax.Array) -> Any:
    row, stretch = unbent(data, z, jnp)
    away = row - data["mean"]
    total = -function(plan, data["likelihood"], row) - 0.5 * away @ data["prior"] @ away + stretch
    allowed = jnp.all((row >= data["low"]) & (row <= data["high"]))
    return jnp.where(jnp.isfinite(total) & allowed, total, -jnp.inf)


@jit(static_argnums=(0, 1))
def _begin(function: Density, plan: Hashable, data: Mapping[str, Any], z: jax.Array) -> Any:
    return blackjax.nuts.init(z, lambda place: _density(function, plan, data, place))


@jit(static_argnums=(0, 1))
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
