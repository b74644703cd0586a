"""The No-U-Turn sampler on a likelihood's exact gradients, whitened by the Fisher information at its optimum.

Hoffman and Gelman (2014), with draws by their weight along the path and turns told by the summed momentum (Betancourt
2017, appendix A). The metric is the information with the priors' (Girolami and Calderhead 2011, held at the optimum),
and in it the slope of the gradients a little to either side: what one flight says of a number at its bound, or of a
noise that it hardly shows, is not what the information expects of all flights. So every direction has a standard
deviation of about one and only the step is to be learnt.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.whitened import Chains, evened, unbent, whitening

Slope = Callable[[Array], tuple[float, Array]]
"""Cost and gradient at a scaled row, priors not included; several threads ask it."""

_ACCEPTED = 0.8
"""Mean acceptance that the step is chosen for: longer steps mix worse on a real flight (decision 167)."""
_FIRST_STEP = 0.5
_DOUBLINGS = 8
_RAN_AWAY = 1000.0
"""Loss of log-density along a path that no draw comes from."""
_STATS = ("lp", "diverging", "energy", "tree_depth", "n_steps", "acceptance_rate")


class PhasePoint(NamedTuple):
    """A place in whitened numbers, the density's logarithm there and its gradient, and the scaled row."""

    z: Array
    density: float
    slope: Array
    row: Array


Density = Callable[[Array], PhasePoint]


def sample(
    slope: Slope,
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
        slope: cost and gradient. row: its entries, with bounds and priors.
        optimum: scaled row to start from (p,). covariance: inverse of information and priors there (p, p).
        chains: how many, each from a point of its own as far from the optimum as the metric says.
        warmup: draws of each chain, dropped, in which it looks for a step; all then take the mean of these.
        block: draws between two looks at `enough`, which ends it; most: draws of a chain at most.
        seed: of all that is random.
        progress: told draws of a chain so far and at most.
    """
    samplers = [_Chain(np.random.default_rng([seed, number])) for number in range(chains)]
    with ThreadPoolExecutor(max_workers=min(chains, os.cpu_count() or 1)) as pool:
        data = whitening(row, optimum, covariance)
        data = evened(data, lambda sides: [p.slope for p in pool.map(density_of(slope, row, data), sides)])
        density, done, draws = density_of(slope, row, data), 0, None
        steps = list(pool.map(lambda chain: chain.warmed(density, len(row), warmup), samplers))
        step = float(np.exp(np.mean(np.log(steps))))  # the metric is one, and so is the step
        while done < most:
            size = min(block, most - done)
            list(pool.map(lambda chain, size=size: chain.draw(density, step, size), samplers))
            done += size
            stats = np.array([chain.stats for chain in samplers])
            named = {name: stats[:, :, i] for i, name in enumerate(_STATS)}
            draws = Chains(np.array([chain.rows for chain in samplers]), named, np.full(chains, step))
            if progress is not None:
                progress(done, most)
            if enough(draws):
                break
    assert draws is not None
    return draws


def density_of(slope: Slope, row: Row, data: dict[str, Any]) -> Density:
    """The density in whitened numbers; nothing lies beyond the bounds and where the model diverges."""
    low, high = row.bounds()

    def density(z: Array) -> PhasePoint:
        with np.errstate(all="ignore"):  # a sampler looks far out too
            place = unbent(data, z)
            lost = PhasePoint(z, -np.inf, np.zeros_like(z), place.row)
            if not np.all((place.row >= low) & (place.row <= high)):
                return lost
            try:
                cost, gradient = slope(place.row)
            except np.linalg.LinAlgError:  # no filter settles there
                return lost
            prior, by_prior, _ = row.prior(place.row)
            total = place.stretch - cost - prior
            pull = (place.bend - place.slope * (gradient + by_prior)) @ data["root"]
        return (
            PhasePoint(z, float(total), pull, place.row) if np.isfinite(total) and np.all(np.isfinite(pull)) else lost
        )

    return density


@dataclass
class _Chain:
    """One chain: where it is, and what it drew."""

    random: np.random.Generator
    at: Any = None
    rows: list[Array] = field(default_factory=list)
    stats: list[tuple[float, ...]] = field(default_factory=list)

    def warmed(self, density: Density, numbers: int, warmup: int) -> float:
        """The step that the second half of some draws took, by Robbins and Monro (1951)."""
        z = self.random.standard_normal(numbers)
        self.at = density(z)
        for _ in range(6):  # nearer to the optimum as long as the model diverges
            if np.isfinite(self.at.density):
                break
            z = 0.5 * z
            self.at = density(z)
        log = np.log(_FIRST_STEP)
        taken = [log]
        for k in range(warmup):
            self.at, stats = drawn(density, self.at, float(np.exp(log)), self.random)
            log += (stats[-1] - _ACCEPTED) / np.sqrt(k + 1.0)
            taken.append(log)
        return float(np.exp(np.mean(taken[len(taken) // 2 :])))

    def draw(self, density: Density, step: float, count: int) -> None:
        for _ in range(count):
            self.at, stats = drawn(density, self.at, step, self.random)
            self.rows.append(self.at.row)
            self.stats.append(stats)


# ---- one draw --------------------------------------------------------------------------------------------------------
class _Path(NamedTuple):
    """A piece of a trajectory: its ends in time (point, momentum), the draw from it, and sums over it."""

    first: tuple[PhasePoint, Array]
    last: tuple[PhasePoint, Array]
    chosen: PhasePoint
    weight: float
    momentum: Array
    ends: bool
    ran_away: bool
    accepted: float
    steps: int


def drawn(
    density: Density, at: PhasePoint, step: float, random: np.random.Generator
) -> tuple[PhasePoint, tuple[float, ...]]:
    """The next draw, and `_STATS` of how it was made."""
    momentum = random.standard_normal(at.z.size)
    energy = 0.5 * float(momentum @ momentum) - at.density
    path, depth = _Path((at, momentum), (at, momentum), at, 0.0, momentum, False, False, 0.0, 0), 0
    while depth < _DOUBLINGS and not path.ends:
        ahead = random.random() < 0.5
        more = _grown(density, path.last if ahead else path.first, step if ahead else -step, depth, energy, random)
        path, depth = _joined(path, more, ahead, random, onward=True), depth + 1
    stats = (path.chosen.density, path.ran_away, energy, depth, path.steps, path.accepted / path.steps)
    return path.chosen, tuple(map(float, stats))


def _grown(
    density: Density, end: tuple[PhasePoint, Array], step: float, depth: int, energy: float, random: np.random.Generator
) -> _Path:
    """2^depth leapfrog steps from an end on; fewer where they turn or run away."""
    if depth:
        near = _grown(density, end, step, depth - 1, energy, random)
        if near.ends:
            return near
        far = _grown(density, near.last if step > 0.0 else near.first, step, depth - 1, energy, random)
        return _joined(near, far, step > 0.0, random, onward=False)
    point, momentum = end
    half = momentum + 0.5 * step * point.slope
    point = density(point.z + step * half)
    momentum = half + 0.5 * step * point.slope
    gained = energy - 0.5 * float(momentum @ momentum) + point.density
    away = not gained > -_RAN_AWAY
    accepted = float(np.exp(min(0.0, gained))) if np.isfinite(gained) else 0.0
    return _Path((point, momentum), (point, momentum), point, gained, momentum, away, away, accepted, 1)


def _joined(near: _Path, far: _Path, ahead: bool, random: np.random.Generator, *, onward: bool) -> _Path:
    """A path and what was added to it; `onward`: the draw rather comes from what was added, if that is whole."""
    early, later = (near, far) if ahead else (far, near)
    accepted, steps = near.accepted + far.accepted, near.steps + far.steps
    if far.ends:
        return near._replace(ends=True, ran_away=far.ran_away, accepted=accepted, steps=steps)
    weight, momentum = float(np.logaddexp(near.weight, far.weight)), near.momentum + far.momentum
    share = far.weight - (near.weight if onward else weight)
    chosen = far.chosen if np.log(random.random()) < share else near.chosen
    turned = any(
        part @ begin[1] <= 0.0 or part @ end[1] <= 0.0
        for part, begin, end in (
            (momentum, early.first, later.last),
            (early.momentum + later.first[1], early.first, later.first),
            (later.momentum + early.last[1], early.last, later.last),
        )
    )
    return _Path(early.first, later.last, chosen, weight, momentum, turned, False, accepted, steps)
