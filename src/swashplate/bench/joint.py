"""The joint covariance of a bench: procedures are added one after the other, with what each takes as known.

A procedure's estimate moves with the parameters that it holds: its error is its own noise plus the derivative times the
error of what it held. Held parameters are those measured before, with their covariance, and those of the published card
that have a standard deviation there. A parameter that is measured twice enters as two, which are then told to be equal;
everything correlated with either moves along (linear least squares; Gelb 1974, ch. 4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.result import BenchCheck, BenchResult
from swashplate.models.card import Card


class Joint:
    """Values and joint covariance as procedures are added.

    Attributes:
        names: of all that is in the covariance, measured and held.
        held: those of them that no procedure measured.
        values: by name.
        covariance: shape (p, p).
        sources: the results that each measured parameter comes from.
    """

    def __init__(self, published: Card) -> None:
        self._published = published
        self.names: list[str] = []
        self.held: list[str] = []
        self.values: dict[str, float] = {}
        self.sources: dict[str, list[BenchResult]] = {}
        self.covariance: Array = np.zeros((0, 0))

    @property
    def measured(self) -> tuple[str, ...]:
        return tuple(name for name in self.names if name not in self.held)

    def among(self, names: tuple[str, ...]) -> Array:
        """Covariance of some of the names."""
        at = [self.names.index(name) for name in names]
        return np.asarray(self.covariance[np.ix_(at, at)])

    def add(self, result: BenchResult) -> tuple[BenchResult, list[BenchCheck]]:
        """Add a result.

        Returns:
            The result with its findings' bounds and its checks completed by what it holds, and how it agrees with
            what was known already.
        """
        leant = dict.fromkeys((*result.leans_on, *(name for f in result.findings for name in f.leans_on)))
        for name in leant:
            self._hold(name)
        slopes = np.array([self._row({k: v[i] for k, v in result.leans_on.items()}) for i in range(len(result.names))])
        slopes = slopes.reshape(len(result.names), len(self.names))
        findings = tuple(
            replace(f, sigma=float(np.hypot(f.sigma, np.sqrt(row @ self.covariance @ row))))
            for f in result.findings
            for row in [self._row(f.leans_on)]
        )
        checks = (*result.checks, *self._taken_as_known(leant, result))
        across = slopes @ self.covariance
        block = result.covariance + across @ slopes.T
        twice = [(name, place) for place, name in enumerate(result.names) if name in self.names]
        before = len(self.names)
        values = np.array([*(self.values[name] for name in self.names), *result.values])
        covariance = np.block([[self.covariance, across.T], [across, block]]) if self.names else block
        comparisons = []
        for name, place in twice:
            values, covariance, apart = _equal(values, covariance, self.names.index(name), before + place)
            first = self.sources[name][0].procedure
            text = f"{name}: {result.procedure} and {first} are {apart:+.1f} sigmas apart."
            comparisons.append(BenchCheck(text, good=abs(apart) < 3.0))
        again = [before + place for _, place in twice]
        kept = [i for i in range(values.size) if i not in again]
        self.names = [[*self.names, *result.names][i] for i in kept]
        self.values = dict(zip(self.names, map(float, values[kept]), strict=True))
        self.covariance = covariance[np.ix_(kept, kept)]
        completed = replace(result, findings=findings, checks=checks)
        for name in result.names:
            self.sources.setdefault(name, []).append(completed)
        return completed, comparisons

    def _hold(self, name: str) -> None:
        """Take a published number with its bound into the covariance."""
        if name in self.names or not self._published.parameters[name].sigma:
            return
        card = self._published
        row = np.array([card.covariance([name, other])[0, 1] if other in self.held else 0.0 for other in self.names])
        variance = np.array([[card.covariance([name])[0, 0]]])
        self.covariance = np.block([[self.covariance, row[:, None]], [row[None], variance]]) if self.names else variance
        self.names.append(name)
        self.held.append(name)
        self.values[name] = card.parameters[name].value

    def _row(self, slopes: Mapping[str, float]) -> Array:
        """Derivatives in the order of the names; what is exact has none."""
        return np.array([float(slopes.get(name, 0.0)) for name in self.names])

    def _taken_as_known(self, leant: Mapping[str, None], result: BenchResult) -> list[BenchCheck]:
        """What was held, with its bound or for want of one as exact: then what a percent of it would do."""
        held = []
        for name in leant:
            if name in self.names:
                place = self.names.index(name)
                sigma = float(np.sqrt(self.covariance[place, place]))
                held.append(f"{name} = {self.values[name]:.4g} +- {sigma:.2g}")
            else:
                value = self._published.parameters[name].value
                percent = np.abs(np.asarray(result.leans_on.get(name, ())) * value / result.values)
                would = ""
                if percent.size:
                    would = f", 1 % of it moves {result.names[int(percent.argmax())]} by {percent.max():.2g} %"
                held.append(f"{name} = {value:.4g} (its card gives no bound: taken as exact{would})")
        return [BenchCheck(f"Held: {', '.join(held)}.")] if held else []


def _equal(values: Array, covariance: Array, first: int, second: int) -> tuple[Array, Array, float]:
    """Values and covariance once two of the numbers are told to be the same, and how far apart they were [sigmas]."""
    row = np.zeros(values.size)
    row[first], row[second] = 1.0, -1.0
    across = covariance @ row
    variance = float(row @ across)
    off = float(row @ values)
    return values - across * off / variance, covariance - np.outer(across, across) / variance, -off / variance**0.5
