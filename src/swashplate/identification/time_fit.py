"""`TimeFit`: a model fitted to records in time, and how any likelihood becomes one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Array
from swashplate.identification.response_cost import ParameterAccuracy
from swashplate.identification.scoring import Optimum, Progress, minimise
from swashplate.identification.state_space import StateSpaceModel
from swashplate.identification.time_likelihood import TimeErrors
from swashplate.vehicles.vehicle import Vehicle

METHODS = ("output-error", "filter-error", "prediction-error")

VAGUE = 50.0
"""Percent of a value that a standard deviation may have before it is said."""

Model = TypeVar("Model", StateSpaceModel, Vehicle)


@dataclass(frozen=True)
class TimeFit(Generic[Model]):
    """A model fitted to records in time.

    Attributes:
        model: identified. parameters: with standard deviations in `cramer_rao` (from the Fisher information).
        covariance: of the output errors (or innovations). method: one of `METHODS`.
        constants: start states, shifts and biases that were solved for, by name and record.
        history: cost after each iteration. converged: False where the iterations ran out.
    """

    model: Model
    parameters: tuple[ParameterAccuracy, ...]
    covariance: Array
    constants: Mapping[str, float]
    history: tuple[float, ...]
    converged: bool
    method: str = "output-error"
    warnings: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> ParameterAccuracy:
        return next(p for p in self.parameters if p.name == name)

    def __repr__(self) -> str:
        rows: list[str] = [f"  {p.name:<12}{p.value:>12.5g} +- {p.cramer_rao:.2g}  {p.unit}" for p in self.parameters]
        told: list[str] = [f"! {text}" for text in self.warnings]
        return "\n".join([f"{self.model.name} fitted in time by {self.method}", *rows, *told])

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words as JSON types."""
        return {
            "kind": "time-fit",
            "model": self.model.name,
            "method": self.method,
            "parameters": [vars(p) for p in self.parameters],
            "constants": dict(self.constants),
            "covariance": self.covariance.tolist(),
            "converged": self.converged,
            "warnings": list(self.warnings),
            "sources": list(self.sources),
        }


@dataclass(frozen=True)
class Solved:
    """Where a likelihood has its optimum: its numbers by name, their accuracy, and how the search went."""

    numbers: Mapping[str, float]
    parameters: tuple[ParameterAccuracy, ...]
    constants: Mapping[str, float]
    optimum: Optimum
    warnings: tuple[str, ...]


def solve(likelihood: TimeErrors, units: Sequence[str], *, iterations: int, progress: Progress | None) -> Solved:
    """The optimum of a likelihood whose first entries are the model's parameters.

    Args:
        likelihood: of errors or innovations.
        units: of those parameters.
        iterations: at most this many.
        progress: told about every iteration.
    """
    row = likelihood.row
    optimum = minimise(likelihood, iterations=iterations, tolerance=0.02, progress=progress)
    plain = optimum.row * row.scale
    logarithmic = row.column("logarithmic") > 0.0
    numbers = np.where(logarithmic, np.exp(np.where(logarithmic, plain, 0.0)), plain)
    named = dict(zip(row.names, map(float, numbers), strict=True))
    spread = np.sqrt(np.diag(np.linalg.pinv(optimum.information, hermitian=True))) * row.scale
    parameters = tuple(
        ParameterAccuracy(
            entry.name,
            unit,
            entry.start,
            named[entry.name],
            float(spread[i]),
            1.0 / float(np.sqrt(optimum.information[i, i])) * float(row.scale[i]),
            at_bound=entry.name in optimum.at_bound,
        )
        for i, (entry, unit) in enumerate(zip(row.entries, units, strict=False))
    )
    constants = dict(list(named.items())[len(units) :])
    return Solved(named, parameters, constants, optimum, _words(parameters, optimum))


def check_method(method: str) -> None:
    """That there is such a method."""
    if method not in METHODS:
        raise IdentificationError(f"'{method}' is no method; there are {', '.join(METHODS)}.", channel="method")


def _words(parameters: Sequence[ParameterAccuracy], optimum: Optimum) -> tuple[str, ...]:
    words = [] if optimum.converged else ["the iterations ran out."]
    vague = [p.name for p in parameters if not p.cramer_rao_percent <= VAGUE]
    if vague:
        words.append(f"standard deviation above {VAGUE:g} %: {', '.join(vague)}; the records hardly tell them.")
    stopped = [p.name for p in parameters if p.at_bound]
    if stopped:
        words.append(f"ended on a bound: {', '.join(stopped)}.")
    return tuple(words)
