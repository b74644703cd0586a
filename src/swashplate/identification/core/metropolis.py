"""Draws from a likelihood by its values alone: Metropolis about a normal distribution that is learnt.

A proposal turns the whitened numbers towards a new draw of the reference and is a draw of it again (preconditioned
Crank-Nicolson: Cotter, Roberts, Stuart and White 2013; with a reference near the posterior: Rudolf and Sprungk 2018).
What is accepted depends only on how far the posterior is from the reference. One value of the likelihood is a draw: a
No-U-Turn trajectory takes ten gradients of ten to twenty values each.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core.scoring import Likelihood
from swashplate.identification.core.whitened import Chains, unbent, whitening

THIN = 20
"""Steps of a chain to a draw that is kept."""
_ROUNDS = 5
"""Of the warm-up: after each the reference is learnt anew."""
_ACCEPTED = 0.25
_WIDER = 1.1
"""Of the reference's variance over that of the draws: its tails must not be thinner than the posterior's."""
_FIRST, _NEAR = 0.3, 0.3
"""First share of a new draw in a proposal, and sigmas from the optimum at which chains start."""
_ALIKE = 30.0
"""Steps of the warm-up that are taken for one independent draw."""


@dataclass
class _Chain:
    """One chain: its own copy of the likelihood, its place and its density there."""

    likelihood: Likelihood
    random: np.random.Generator
    z: Array
    log: float


@dataclass(frozen=True)
class _Reference:
    """z = mean + root e; `share` of a proposal is new."""

    mean: Array
    root: Array
    share: float


def sample(
    likelihood: Likelihood,
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
        likelihood: with `cost` and `row`.
        optimum: scaled row to start from (p,). covariance: inverse of information and priors there (p, p).
        chains: how many.
        warmup: steps of each chain in each round in which the reference is learnt, dropped.
        block: kept draws between two looks at `enough`, which ends it; most: kept draws of a chain at most.
        seed: of all that is random.
        progress: told kept draws of a chain so far and at most.
    """
    data, p = whitening(likelihood.row, optimum, covariance), len(optimum)
    running = []
    for random in map(np.random.default_rng, np.random.SeedSequence(seed).spawn(chains)):
        mine = copy.copy(likelihood)
        z = _NEAR * random.standard_normal(p)
        for _ in range(6):
            if np.isfinite(_density(mine, data, z)):
                break
            z = 0.5 * z
        running.append(_Chain(mine, random, z, _density(mine, data, z)))
    reference = _Reference(np.zeros(p), np.eye(p), _FIRST)
    known: list[Array] = []
    with ThreadPoolExecutor(max_workers=min(chains, os.cpu_count() or 1)) as pool:
        for _ in range(_ROUNDS):
            jobs = [pool.submit(_walked, data, one, reference, warmup, 1, learns=True) for one in running]
            told = [job.result() for job in jobs]
            known.append(np.concatenate([rows for rows, _, _ in told]))
            share = float(np.exp(np.mean([np.log(last) for _, _, last in told])))
            reference = _learnt(np.concatenate(known[len(known) // 2 :]), share, p)
        parts: list[list[tuple[Array, Array]]] = [[] for _ in running]
        done, chain = 0, None
        while done < most:
            size = min(block, most - done)
            jobs = [pool.submit(_walked, data, one, reference, size * THIN, THIN, learns=False) for one in running]
            for own, job in zip(parts, jobs, strict=True):
                rows, stats, _ = job.result()
                own.append((rows, stats))
            done += size
            chain = _together(parts, data, reference.share)
            if progress is not None:
                progress(done, most)
            if enough(chain):
                break
    assert chain is not None
    return chain


def _learnt(draws: Array, share: float, p: int) -> _Reference:
    """The reference of the draws so far, between theirs and the one to begin with as far as they are few."""
    weight = len(draws) / (len(draws) + _ALIKE * p)
    covariance = _WIDER * (weight * np.cov(draws.T).reshape(p, p) + (1.0 - weight) * np.eye(p))
    values, vectors = np.linalg.eigh(covariance)
    return _Reference(weight * draws.mean(axis=0), vectors * np.sqrt(np.maximum(values, 1e-12)), share)


def _walked(
    data: Mapping[str, NDArray[Any]], chain: _Chain, reference: _Reference, steps: int, thin: int, *, learns: bool
) -> tuple[Array, Array, float]:
    """Whitened numbers (kept, p), log-density and mean acceptance of each (kept, 2), and the last share."""
    inverse, share = np.linalg.inv(reference.root), reference.share
    e = inverse @ (chain.z - reference.mean)
    beyond = chain.log + 0.5 * e @ e
    rows, stats, accepted = [], [], 0.0
    for k in range(steps):
        tried = np.sqrt(1.0 - share**2) * e + share * chain.random.standard_normal(e.size)
        z = reference.mean + reference.root @ tried
        log = _density(chain.likelihood, data, z)
        other = log + 0.5 * tried @ tried
        chance = float(np.exp(min(0.0, other - beyond))) if np.isfinite(other) else 0.0
        if chain.random.random() < chance:
            chain.z, chain.log, e, beyond = z, log, tried, other
        accepted += chance
        if learns:  # Robbins and Monro (1951)
            share = float(np.clip(share * np.exp((chance - _ACCEPTED) / np.sqrt(k + 1.0)), 1e-3, 1.0))
        if (k + 1) % thin == 0:
            rows.append(chain.z)
            stats.append((chain.log, accepted / thin))
            accepted = 0.0
    return np.array(rows), np.array(stats), share


def _density(likelihood: Likelihood, data: Mapping[str, NDArray[Any]], z: Array) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        row, stretch = unbent(data, z, np)
    if not (np.all(np.isfinite(row)) and np.all((row >= data["low"]) & (row <= data["high"]))):
        return -np.inf
    away = row - data["mean"]
    total = -likelihood.cost(row) - 0.5 * away @ data["prior"] @ away + stretch
    return float(total) if np.isfinite(total) else -np.inf


def _together(parts: list[list[tuple[Array, Array]]], data: Mapping[str, NDArray[Any]], share: float) -> Chains:
    rows = np.stack([[unbent(data, z, np)[0] for z in np.concatenate([part for part, _ in own])] for own in parts])
    stats = np.stack([np.concatenate([part for _, part in own]) for own in parts])
    told = {"lp": stats[:, :, 0], "acceptance_rate": stats[:, :, 1], "diverging": np.zeros(stats.shape[:2])}
    return Chains(rows, told, np.full(len(parts), share))
