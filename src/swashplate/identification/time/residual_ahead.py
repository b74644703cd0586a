"""The linear residual of errors some time ahead, fitted to what a saved predictor does on a new flight.

Such a predictor meets a flight so: the first seconds tell the flight's constants (`calibrate`), among them the
accelerations that the flight has of its own (`push_*`); from the first sample on its filter runs, with the residual in
its equations; predictions begin when those seconds are over. So does every flight here, at every step of the search.
Constants of the whole flight would know what comes after a start. A filter without the residual, or one that begins
anew with every block, is one that no user has.

The coefficients are found by Gauss-Newton under a ridge that blocks left out choose. Then drifts of forces and of
moments are let wander as fast as makes the errors smallest, the flights are calibrated anew, and the coefficients found
again.

How much of a residual is kept: as much as blocks of the flights that are left out speak for.

Coefficients are held towards zero by a ridge (Hoerl and Kennard 1970). Its strength is the one that gains most on
blocks that were not learnt from, and nothing is kept where that gain may be chance (Student's t, 97.5 %). Nothing else
is looked at. Physics may stand before the coefficients in a row: it moves with and without them, with its own priors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance, mean_nuisance
from swashplate.identification.core.multi_step import Ahead, Horizon
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.core.records import CALIBRATION, Record
from swashplate.identification.time.calibration import as_begun, calibrate
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.linear_residual import (
    LinearResidual,
    accelerations_along,
    kept,
    none_found,
    seen_along,
    shares,
    units_of,
    with_coefficients,
)
from swashplate.models.residual import coefficients
from swashplate.models.vehicle import Vehicle

STRENGTHS = np.geomspace(1e5, 1e-3, 33)
"""Of the ridge, from strong to weak."""

BLOCK = 6.0
"""Seconds of a block that is left out, at least."""

FEWEST = 4
"""Blocks below which nothing can be left out to choose by."""

_SURE = 0.975
"""Quantile of Student's t that the gain on blocks left out must exceed, in standard errors: a few blocks tell these
badly."""

_FLOOR = 1e-9
"""Of each parameter's information, what is added to it: blocks may leave out the one that tells a combination."""


def enough_blocks(count: int, where: str, *, after: float = 0.0) -> None:
    """Refuses records that make too few blocks.

    Raises:
        IdentificationError: for fewer than `FEWEST`.
    """
    if count < FEWEST:
        later = f" after their first {after:g} s, which tell a flight's constants" if after else ""
        raise IdentificationError(
            f"the flights make {count} blocks of {BLOCK:g} s{later}, a residual needs {FEWEST}: without blocks to "
            "leave out, nothing says how much of it is chance.",
            where=where,
            channel="residual",
            hint="Give longer flights, or leave --residual away.",
        )


class Physics(NamedTuple):
    """Priors of the parameters that stand before the coefficients: their pull where these stand, and information."""

    pull: Array
    information: Array


ALONE = Physics(np.zeros(0), np.zeros((0, 0)))
"""No physics moves."""


@dataclass(frozen=True)
class LeftOutBlock:
    """A block's cost by physics and scaled coefficients, to second order about some.

    Attributes:
        start: cost without a residual.
        at: where it is told (k,). cost, gradient, information: there.
    """

    start: float
    at: Array
    cost: float
    gradient: Array
    information: Array

    def gain(self, coefficients: Array) -> float:
        """Log-likelihood that they gain."""
        away = coefficients - self.at
        return self.start - self.cost - float(self.gradient @ away + 0.5 * away @ self.information @ away)


def shrunk(blocks: Sequence[LeftOutBlock], strength: float, physics: Physics = ALONE) -> tuple[Array, Array]:
    """Physics and scaled coefficients (k,) and their covariance (k, k) from some blocks; infinite: physics alone."""
    information = sum((block.information for block in blocks), start=np.zeros_like(blocks[0].information))
    slope = sum((block.gradient - block.information @ block.at for block in blocks), start=np.zeros(len(information)))
    k, n = len(information), len(physics.pull)
    slope[:n] += physics.pull
    held = np.diag(np.concatenate([_FLOOR * np.diag(information)[:n], np.full(k - n, strength)]))
    held[:n, :n] += physics.information
    free = k if np.isfinite(strength) else n
    coefficients, covariance = np.zeros(k), np.zeros((k, k))
    covariance[:free, :free] = np.linalg.inv(information[:free, :free] + held[:free, :free])
    coefficients[:free] = -covariance[:free, :free] @ slope[:free]
    return coefficients, covariance


def chosen_strength(blocks: Sequence[LeftOutBlock], physics: Physics = ALONE) -> tuple[float, float, float]:
    """Strength by blocks left out, what they gain, and its standard error; infinite where that is nothing."""
    from scipy.stats import t as student

    def gains(strength: float) -> Array:
        learnt = [shrunk([*blocks[:i], *blocks[i + 1 :]], strength, physics)[0] for i in range(len(blocks))]
        return np.array([block.gain(coefficients) for block, coefficients in zip(blocks, learnt, strict=True)])

    alone = gains(np.inf) if len(physics.pull) else np.zeros(len(blocks))
    gained = np.array([gains(strength) - alone for strength in STRENGTHS])
    total, error = gained.sum(axis=1), np.std(gained, axis=1, ddof=1) * np.sqrt(len(blocks))
    best = int(np.argmax(total))
    if total[best] <= student.ppf(_SURE, len(blocks) - 1) * error[best]:
        return np.inf, float(total[best]), float(error[best])
    return float(STRENGTHS[best]), float(total[best]), float(error[best])


_FASTER = (0.3, 1.0, 3.0, 10.0, 30.0)
"""By what the wandering of a drift is multiplied to make errors ahead small."""

_ROUNDS, _BETWEEN = 8, 1.0
"""Gauss-Newton steps towards small errors ahead, and the ridge that the first are taken with."""

_SHORTER = (1.0, 0.5, 0.25, 0.125)
"""Shares of a step that are tried."""

_ENOUGH = 0.5
"""Of log-likelihood: a step that gains less ends the search."""

_ASIDE = 1e-3
"""How far a coefficient is moved for a slope of errors ahead, in its scaled unit."""


class FlightAhead:
    """Errors ahead on a flight as a saved predictor meets it, by the coefficients of its residual.

    Divided by their size without a residual, block by block, and weighed so that predictions which do not overlap count
    as one each.

    Args:
        vehicle: with a residual. record: the flight.
        noise: of the filter. usual: constants of other flights, where those of this one are looked for.
        trims: further constants to look for, and the standard deviations of their priors.
        horizon: how far ahead.
        sizes: of the errors in each block (horizons, outputs); None: those without a residual here.
    """

    def __init__(
        self, vehicle: Vehicle, record: Record, noise: Noise, usual: Nuisance, *, trims: Mapping[str, float],
        horizon: Horizon, sizes: Sequence[Array] | None = None,
    ) -> None:  # fmt: skip
        nuisance = calibrate(vehicle, record, noise=noise, prior=usual, trims=trims)
        names = coefficients(vehicle)
        bare = as_begun(vehicle.with_values(dict.fromkeys(names, 0.0)), record)
        table = Parameterization(bare, tuple(Free(name, 1.0) for name in names), of_records=kept(nuisance))
        self.likelihood = FilterError(table, [record], noise=noise, estimate_noise=False, nuisance=nuisance)
        self._steps = np.array(horizon.samples(record.dt))
        starts = np.arange(round(CALIBRATION / record.dt), record.time.size - self._steps[-1] - 1, self._steps[0])
        n = int(len(starts) * self._steps[0] * record.dt // BLOCK)
        self._starts = np.array_split(starts, n) if n else []
        self.sizes = [np.ones(1)] * n if sizes is None else list(sizes)
        if sizes is None and n:
            squares = (errors**2 for errors in self.errors(np.zeros(len(names))))
            self.sizes = [np.sqrt(np.mean(rows, axis=0)) * self._steps.size for rows in squares]

    def errors(self, factors: Array) -> list[Array]:
        """Measured less predicted over their size, by block (starts, horizons, outputs)."""
        if not self._starts:
            return []
        row, starts = self.likelihood.row.starts(), np.concatenate(self._starts)
        row[self.likelihood.row.places("parameter")] = factors
        ahead = Ahead((tuple(starts.tolist()),), tuple(self._steps.tolist()))
        with np.errstate(over="ignore", invalid="ignore"):
            (off,) = self.likelihood.errors_ahead(row, ahead)
        parts = np.split(off, np.cumsum([len(part) for part in self._starts])[:-1])
        return [part / size for part, size in zip(parts, self.sizes, strict=True)]

    def costs(self, factors: Array) -> list[float]:
        """Half the sum of squares, by block; infinite where predictions diverge."""
        sums = [0.5 * float(np.sum(part**2)) for part in self.errors(factors)]
        return [cost if np.isfinite(cost) else np.inf for cost in sums]

    def blocks(self, scaled: Array, size: Array) -> Iterator[LeftOutBlock]:
        """Each block's cost to second order about scaled coefficients."""
        starts, here = self.costs(np.zeros(size.size)), self.errors(scaled / size)
        aside = [self.errors((scaled + move) / size) for move in _ASIDE * np.eye(size.size)]
        for i, (start, part) in enumerate(zip(starts, here, strict=True)):
            slopes = np.stack([(errors[i] - part).ravel() / _ASIDE for errors in aside])
            cost = 0.5 * float(np.sum(part**2))
            yield LeftOutBlock(start, scaled, cost, slopes @ part.ravel(), slopes @ slopes.T)


_Meets = Callable[[Array, Noise, Sequence[FlightAhead]], list[FlightAhead]]


def fit_ahead(
    vehicle: Vehicle,
    pieces: Sequence[Record],
    nuisances: Sequence[Nuisance],
    noise: Noise,
    *,
    horizon: Horizon,
    constants: Sequence[Free] = (),
) -> LinearResidual:
    """The residual of errors ahead.

    Args:
        vehicle: with a residual whose coefficients are zero.
        pieces: the records of the fit. nuisances: constants of each. noise: of the filter.
        horizon: how far ahead.
        constants: further ones that a record has of its own.

    Raises:
        IdentificationError: where the records make fewer than `FEWEST` blocks after their first seconds.
    """
    usual = mean_nuisance(Nuisance(*np.array(nuisances, dtype=np.float64).T))
    trims = {free.name: float(free.sigma or 0.05) for free in constants}
    names = list(coefficients(vehicle))

    def met(factors: Array, noise: Noise, before: Sequence[FlightAhead]) -> list[FlightAhead]:
        """The flights as a predictor with these coefficients meets them, their errors over the sizes of before."""
        wider = vehicle.with_values(dict(zip(names, factors.tolist(), strict=True)))
        sizes: list[list[Array] | None] = [each.sizes for each in before] or [None for _ in pieces]
        return [
            FlightAhead(wider, piece, noise, usual, trims=trims, horizon=horizon, sizes=size)
            for piece, size in zip(pieces, sizes, strict=True)
        ]

    first = flights = met(np.zeros(len(names)), noise, ())
    enough_blocks(sum(len(flight.sizes) for flight in flights), pieces[0].name, after=CALIBRATION)
    columns, total = seen_along([flight.likelihood for flight in flights])
    size, at, held = units_of(coefficients(vehicle), columns, total), np.zeros(len(names)), _BETWEEN
    for again in (True, False):
        blocks = _search(flights, at, size, held)
        strength, gain, error = chosen_strength(blocks)
        if not np.isfinite(strength):
            return none_found(vehicle, noise, gain, error)
        (at, covariance), held = shrunk(blocks, strength), strength
        if again:
            noise = _wandering(partial(_met_cost, met, at / size, first), noise)
            flights = met(at / size, noise, first)
    if not _cost(flights, at / size) < sum(block.start for block in blocks):
        return none_found(vehicle, noise, gain, error)  # to second order it gained, and in fact it does not
    source = f"residual by {len(blocks)} blocks, ridge {strength:.3g}"
    values = dict(zip(names, (at / size).tolist(), strict=True))
    made_of = with_coefficients(vehicle, values, np.sqrt(np.diag(covariance)) / size, source)
    along = columns, accelerations_along([flight.likelihood for flight in first])
    units = dict(zip(names, (1.0 / size).tolist(), strict=True))
    return LinearResidual(made_of, strength, gain, error, shares(made_of, *along), noise, units, along)


def _cost(flights: Sequence[FlightAhead], factors: Array) -> float:
    return sum(sum(flight.costs(factors)) for flight in flights)


def _met_cost(met: _Meets, factors: Array, before: Sequence[FlightAhead], noise: Noise) -> float:
    return _cost(met(factors, noise, before), factors)


def _blocks_of(flights: Sequence[FlightAhead], at: Array, size: Array) -> list[LeftOutBlock]:
    return [block for flight in flights for block in flight.blocks(at, size)]


def _search(flights: Sequence[FlightAhead], at: Array, size: Array, held: float) -> list[LeftOutBlock]:
    """Blocks near the smallest errors under a ridge: over half a second no effect is linear any more."""

    def cost(scaled: Array) -> float:
        return _cost(flights, scaled / size) + 0.5 * held * float(scaled @ scaled)

    blocks, lowest = _blocks_of(flights, at, size), cost(at)
    for _ in range(_ROUNDS):
        way = shrunk(blocks, held)[0] - at
        lower = ((cost(at + share * way), share) for share in _SHORTER)
        least, share = next(((tried, share) for tried, share in lower if tried < lowest), (lowest, 0.0))
        if not share:
            break
        done, lowest, at = lowest - least < _ENOUGH, least, at + share * way
        blocks = _blocks_of(flights, at, size)
        if done:
            break
    return blocks


def _wandering(cost: Callable[[Noise], float], noise: Noise) -> Noise:
    """The noise whose drifts wander, each kind by itself, as fast as makes a cost smallest: one step says little."""
    for name in (name for name in noise._fields if name.startswith("drift") and float(getattr(noise, name))):
        tried = [noise._replace(**{name: faster * getattr(noise, name)}) for faster in _FASTER]
        noise = min(tried, key=cost)
    return noise
