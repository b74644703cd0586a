"""What campaigns of fits share: the question of `swash identify`, asked from many starts, and one that may fail."""

from __future__ import annotations

from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.api.asking import strings
from swashplate.api.campaigns.kind import CampaignKind, CampaignSettings, vehicle_of
from swashplate.api.campaigns.tasks import Columns, Portion, seed_of
from swashplate.api.question import default_of
from swashplate.api.verbs.identify import FitVehicle
from swashplate.arrays import Array
from swashplate.errors import CampaignError, SwashError
from swashplate.identification.core.parameters import bounds_of, parameterize
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import check_method
from swashplate.models.vehicle import Vehicle


class FitWords(CampaignSettings, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What campaigns of fits say beside the words of `swash identify`.

    Attributes:
        vehicle: a name or a file: the equations and the numbers that starts are about.
    """

    vehicle: str


class FitKind(CampaignKind):
    """A kind whose rows are fits of a vehicle, or of a state-space model by its file."""

    rows = "fit"
    question = FitVehicle
    without = ("hold_out", "prior", "close_loop", "posterior")

    @abstractmethod
    def start(self, settings: Any, model: Vehicle, names: Sequence[str], seed: int) -> Array:
        """Values (p,) that a fit starts from."""

    @abstractmethod
    def data(self, settings: Any, asked: FitVehicle, model: Vehicle, files: Mapping[str, Path]) -> Callable[[int], Any]:
        """What is fitted to, by the row's seed."""

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        check_method(settings.method)
        return super().parts(settings, folder)

    def run(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> Columns:
        model, names, fitted = self._problem(settings, files)
        seeds = [seed_of(portion.seed, row) for row in range(portion.count)]
        starts = np.array([self.start(settings, model, names, seed) for seed in seeds]).reshape(len(seeds), len(names))
        fits: list[Result[object, object] | str] = []
        for seed, values in zip(seeds, starts, strict=True):
            try:
                fits.append(fitted(seed, values))
            except SwashError as error:
                fits.append(str(error))
        return fit_columns(fits, names) | {f"start.{name}": starts[:, k] for k, name in enumerate(names)}

    def replay(self, settings: Any, portion: Portion, files: Mapping[str, Path], row: int) -> Result[object, object]:
        model, names, fitted = self._problem(settings, files)
        seed = seed_of(portion.seed, row)
        return fitted(seed, self.start(settings, model, names, seed))

    def _problem(
        self, settings: Any, files: Mapping[str, Path]
    ) -> tuple[Vehicle, tuple[str, ...], Callable[[int, Array], Result[object, object]]]:
        """The model, the names that a fit moves, and the fit of a row's seed from values (p,)."""
        model = vehicle_of(str(files.get(settings.vehicle, settings.vehicle)))
        asked: FitVehicle = self.asked(settings, files, vehicle=model)
        names, data = _moved_by(asked, model), self.data(settings, asked, model, files)

        def fitted(seed: int, values: Array) -> Result[object, object]:
            begin = model.with_values({name: float(value) for name, value in zip(names, values, strict=True)})
            return replace(asked, vehicle=begin, flight=data(seed)).answer()

        return model, names, fitted


_OF_VEHICLES = ("free", "tie", "wind", "fix", "keep_unexcited", "residual", "leave_out")


def _moved_by(asked: FitVehicle, model: Vehicle) -> tuple[str, ...]:
    """Names of the numbers of a model that a fit moves.

    Raises:
        IdentificationError, CardError: for names that the model does not have.
        CampaignError: for words beside a state-space model that only a vehicle's fit takes.
    """
    if model.structure is None:
        free = strings(asked.free)
        return parameterize(
            model, free[0] if len(free) == 1 else free or "full", ties=strings(asked.tie), fixed=asked.fix
        ).names
    for name in _OF_VEHICLES:
        if getattr(asked, name) != default_of(FitVehicle, name):
            raise CampaignError(
                f"is {getattr(asked, name)!r}, and '{model.structure.name}' is a state-space model.",
                channel=name,
                hint="Leave it out: what its file does not call fixed is free.",
            )
    return model.structure.free


def fit_columns(fits: Sequence[Result[object, object] | str], names: Sequence[str]) -> Columns:
    """Whether each fit may be used, what was wrong with it (in words, where there is none), its cost and numbers."""
    there = [None if isinstance(fit, str) else fit for fit in fits]
    problems = [fit if isinstance(fit, str) else "; ".join(fit.problems) for fit in fits]
    columns: Columns = {
        "cost": np.array([np.nan if fit is None else fit.cost for fit in there], dtype=np.float64),
        "usable": np.array([fit is not None and not fit.failed for fit in there], dtype=np.int64),
        "converged": np.array([fit is not None and fit.converged for fit in there], dtype=np.int64),
        "problem": np.array(problems, dtype=np.str_),
    }
    for name in names:
        columns[name] = np.array([np.nan if fit is None else fit[name].value for fit in there])
        columns[f"{name}.sigma"] = np.array([np.nan if fit is None else fit[name].best_sigma for fit in there])
    return columns


def unusable(table: Columns, usable: NDArray[np.bool_]) -> list[str]:
    """What a reader must know of fits that are left out, with the reason that most of them have; empty for none."""
    lost = int(np.sum(~usable))
    if not lost:
        return []
    reasons = Counter(filter(None, map(str, table["problem"][~usable]))) if "problem" in table else Counter()
    most = [f"their most frequent problem ({n} of {lost}): {reason}" for reason, n in reasons.most_common(1)]
    return [f"{lost} fits may not be used and are in no figure below", *most]


def values_of(model: Vehicle, names: Sequence[str]) -> Array:
    """Values of a model's numbers (p,)."""
    return np.array([model.numbers[name].value for name in names], dtype=np.float64)


def within_bounds(model: Vehicle, names: Sequence[str], values: Array) -> Array:
    """Values (p,) that physics allows, the nearest ones."""
    low, high = bounds_of(model if model.structure is None else model.structure, names)
    return np.clip(values, low, high)
