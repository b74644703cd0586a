"""What campaigns of fits share: what their files say of a fit and its logs, where it starts, and one that may fail."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from swashplate.api.campaigns.flown import vehicle_of
from swashplate.api.campaigns.kind import CampaignSettings, NamedFile
from swashplate.api.campaigns.tasks import Columns
from swashplate.arrays import Array
from swashplate.errors import CampaignError, SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.result import Result, bounds_of
from swashplate.identification.identify import identify
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle


class FitCampaign(CampaignSettings, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What every campaign of fits says in its file.

    Attributes:
        vehicle: a name or a file: the equations and the numbers that starts are about.
        free, method, outputs, ties, wind: as of `sp.identify`.
    """

    vehicle: str
    free: str | list[str] | None = None
    method: str | None = None
    outputs: list[str] | None = None
    ties: list[str] = msgspec.field(default_factory=list)
    wind: bool = False

    def free_of(self, model: Vehicle) -> tuple[str, ...]:
        """Names of the numbers of a model that a fit moves.

        Raises:
            IdentificationError, CardError: for names that the model does not have.
            CampaignError: for names beside a state-space model, whose file says itself what is free.
        """
        if model.structure is not None:
            if self.free is not None:
                raise CampaignError(
                    f"is {self.free!r}, and '{model.structure.name}' is a state-space model.",
                    channel="free",
                    hint="Leave it out: what its file does not call fixed is free.",
                )
            return model.structure.free
        return parameterize(model, "full" if self.free is None else self.free, ties=self.ties).names

    def fitted(
        self, begin: Vehicle, data: Flight | Sequence[Flight] | FrequencyResponse, *, biases: Sequence[str] = ()
    ) -> Result[Any, Any]:
        """One fit, from where the model stands."""
        return identify(
            _identified(begin),
            data,
            free=None if begin.structure is not None else self.free,
            method=self.method,
            outputs=self.outputs,
            ties=self.ties,
            wind=self.wind,
            biases=biases,
        )


class LogsCampaign(FitCampaign, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What campaigns of fits to logs say in their files, about the vehicle's numbers.

    Attributes:
        flights: logs to fit to.
        condition: False takes the logs as they are, at one rate already. rate: otherwise, samples per second [Hz].
        biases: as of `sp.identify`.
    """

    flights: list[str] = msgspec.field(default_factory=list)
    condition: bool = True
    rate: float = 100.0
    biases: list[str] = msgspec.field(default_factory=list)

    @property
    def logs(self) -> tuple[NamedFile, ...]:
        """The vehicle's file and the logs."""
        return NamedFile("vehicle", self.vehicle, True), *(NamedFile("flights", name) for name in self.flights)

    def model(self, files: Mapping[str, Path]) -> Vehicle:
        """The vehicle."""
        return vehicle_of(str(files.get(self.vehicle, self.vehicle)))

    def records(self, files: Mapping[str, Path]) -> tuple[Flight, ...]:
        """Its logs, conditioned, in the order of the file."""
        raw = (read(files[name]) for name in self.flights)
        return tuple(flight.condition(rate=self.rate, cutoff=0.0) if self.condition else flight for flight in raw)


@dataclass(frozen=True)
class Attempt:
    """A fit, or in words why there is none."""

    fit: Result[Any, Any] | None
    refused: str = ""

    @staticmethod
    def at(make: Callable[[], Result[Any, Any]]) -> Attempt:
        """What comes of a fit that may be refused."""
        try:
            return Attempt(make())
        except SwashError as error:
            return Attempt(None, str(error))

    @property
    def cost(self) -> float:
        return np.nan if self.fit is None else self.fit.cost

    @property
    def usable(self) -> bool:
        return self.fit is not None and not self.fit.failed

    @property
    def converged(self) -> bool:
        return self.fit is not None and self.fit.converged

    @property
    def problem(self) -> str:
        return self.refused if self.fit is None else "; ".join(self.fit.problems)

    def estimate(self, name: str) -> tuple[float, float]:
        """Value and standard deviation of a number; NaN where there is no fit."""
        return (np.nan, np.nan) if self.fit is None else (self.fit[name].value, self.fit[name].best_sigma)


def outcome_columns(attempts: Sequence[Attempt]) -> Columns:
    """Whether each fit came to an end that may be used, its cost, and what was wrong with it."""
    return {
        "cost": np.array([attempt.cost for attempt in attempts], dtype=np.float64),
        "usable": np.array([attempt.usable for attempt in attempts], dtype=np.int64),
        "converged": np.array([attempt.converged for attempt in attempts], dtype=np.int64),
        "problem": np.array([attempt.problem for attempt in attempts], dtype=np.str_),
    }


def unusable(table: Columns, usable: NDArray[np.bool_]) -> list[str]:
    """What a reader must know of fits that are left out, with the reason that most of them have; empty for none."""
    lost = int(np.sum(~usable))
    if not lost:
        return []
    told = f"{lost} fits may not be used and are in no figure below"
    reasons = Counter(filter(None, map(str, table["problem"][~usable]))) if "problem" in table else Counter()
    return [
        told,
        *(f"their most frequent problem ({count} of {lost}): {reason}" for reason, count in reasons.most_common(1)),
    ]


def _identified(model: Vehicle) -> Vehicle | StateSpaceModel:
    """What `identify` takes for a vehicle: of a state-space model its matrices of named expressions."""
    return model if model.structure is None else model.structure


def values_of(model: Vehicle, names: Sequence[str]) -> Array:
    """Values of a model's numbers (p,)."""
    return np.array([model.numbers[name].value for name in names], dtype=np.float64)


def spreads_of(model: Vehicle, names: Sequence[str]) -> Array:
    """Standard deviations of a model's numbers (p,), one where none is known."""
    return np.array([getattr(model.numbers[name], "sigma", None) or 1.0 for name in names], dtype=np.float64)


def within_bounds(model: Vehicle, names: Sequence[str], values: Array) -> Array:
    """Values (p,) that physics allows, the nearest ones."""
    low, high = bounds_of(_identified(model), names)
    return np.clip(values, low, high)


def started(model: Vehicle, names: Sequence[str], values: Array) -> Vehicle:
    """The model with other numbers to start a fit from."""
    return model.with_values({name: float(value) for name, value in zip(names, values, strict=True)})
