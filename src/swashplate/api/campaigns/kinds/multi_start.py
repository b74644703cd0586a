"""Campaigns of fits from many starts: is what a fit found the best there is, and how often is that found?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.api.campaigns.fitting import (
    Attempt,
    LogsCampaign,
    outcome_columns,
    spreads_of,
    started,
    unusable,
    values_of,
    within_bounds,
)
from swashplate.api.campaigns.kind import CampaignFindings, NamedFile, in_batches
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion, seed_of
from swashplate.arrays import Array
from swashplate.errors import CampaignError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import check_method
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.vehicle import Vehicle

_SHOWN = 6


class MultiStartCampaign(LogsCampaign, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file of a campaign of starts, about the vehicle's numbers.

    Attributes:
        responses: measured responses (.nc) instead of flights, for a state-space model.
        factor: each free number starts at its value times or divided by up to this; one that is zero, within plus and
            minus `factor` times its standard deviation or one.
        same: costs that differ by no more are of one optimum, in units of the cost.
    """

    responses: str | None = None
    factor: float = 3.0
    same: float = 0.1


class MultiStartKind:
    """See `CampaignKind`."""

    rows = "fit"
    schema = MultiStartCampaign

    def files(self, settings: MultiStartCampaign) -> Sequence[NamedFile]:
        measured = [] if settings.responses is None else [NamedFile("responses", settings.responses)]
        return (*settings.logs, *measured)

    def parts(self, settings: MultiStartCampaign, folder: Path) -> tuple[Portion, ...]:
        check_method(settings.method)
        if bool(settings.flights) == (settings.responses is not None):
            raise CampaignError("expected either flights or responses.", channel="flights")
        if not settings.factor > 1.0 or not settings.same >= 0.0:
            raise CampaignError("expected factor above 1 and same at least 0.", channel="factor, same")
        return in_batches(settings, usual=1)

    def run(self, settings: MultiStartCampaign, portion: Portion, files: Mapping[str, Path]) -> Columns:
        model, data = self._read(settings, files)
        names = settings.free_of(model)
        seeds = [seed_of(portion.seed, row) for row in range(portion.count)]
        starts = [start_values(model, names, factor=settings.factor, seed=seed) for seed in seeds]
        attempts = [Attempt.at(partial(_fitted, settings, started(model, names, begin), data)) for begin in starts]
        columns = outcome_columns(attempts)
        for k, name in enumerate(names):
            columns[f"start.{name}"] = np.array([start[k] for start in starts])
            columns[name] = np.array([attempt.estimate(name)[0] for attempt in attempts])
        return columns

    def replay(
        self, settings: MultiStartCampaign, portion: Portion, files: Mapping[str, Path], row: int
    ) -> Result[Any, Any]:
        model, data = self._read(settings, files)
        names = settings.free_of(model)
        begin = start_values(model, names, factor=settings.factor, seed=seed_of(portion.seed, row))
        return _fitted(settings, started(model, names, begin), data)

    def findings(self, settings: MultiStartCampaign, table: Columns) -> CampaignFindings:
        if not {"cost", "usable"} <= table.keys():
            return CampaignFindings((), {})
        names = [name.removeprefix("start.") for name in table if name.startswith("start.")]
        usable = (table["usable"] == 1) & np.isfinite(table["cost"])
        every, cost = len(usable), np.asarray(table["cost"], dtype=np.float64)
        groups = optima(np.where(usable, cost, np.inf), same=settings.same)
        if not groups:
            return CampaignFindings(
                (("Best cost", "no fit may be used", "bad"),), {}, careful=tuple(unusable(table, usable))
            )
        best, careful = groups[0], []
        if len(best) == 1 and every > 1:
            careful.append("the best optimum was reached by one start only: more starts may find a better one")
        summary = (
            ("Best cost", f"{cost[best[0]]:.6g}, number {int(table['number'][best[0]])}", "plain"),
            ("Reached it", share_words(len(best), every), "plain"),
            ("Unusable", share_words(int(np.sum(~usable)), every), "caution" if not np.all(usable) else "good"),
        )
        head = ("optimum", "cost", "starts", *names)
        cells = tuple(
            (str(k + 1), f"{cost[group[0]]:.6g}", str(len(group)), *(f"{float(table[n][group[0]]):.4g}" for n in names))
            for k, group in enumerate(groups[:_SHOWN])
        )
        more = f" (the best {_SHOWN} of {len(groups)})" if len(groups) > _SHOWN else ""
        return CampaignFindings(
            summary, {"cost": ("", 1.0)}, tables=((f"Optima that starts ended at{more}", head, cells),),
            careful=tuple(careful),
        )  # fmt: skip

    def _read(
        self, settings: MultiStartCampaign, files: Mapping[str, Path]
    ) -> tuple[Vehicle, tuple[Flight, ...] | FrequencyResponse]:
        if settings.responses is not None:
            return settings.model(files), FrequencyResponse.load(files[settings.responses])
        return settings.model(files), settings.records(files)


def _fitted(
    settings: MultiStartCampaign, begin: Vehicle, data: tuple[Flight, ...] | FrequencyResponse
) -> Result[Any, Any]:
    return settings.fitted(begin, data, biases=settings.biases)


def start_values(model: Vehicle, names: Sequence[str], *, factor: float, seed: int) -> Array:
    """Where a fit starts: each number off by a factor that is evenly spread in its logarithm, within its bounds."""
    random = np.random.default_rng(seed)
    middle, spread = values_of(model, names), random.uniform(-1.0, 1.0, len(names))
    about = factor * spread * spreads_of(model, names)
    return within_bounds(model, names, np.where(middle == 0.0, about, middle * factor**spread))


def optima(cost: Array, *, same: float) -> list[list[int]]:
    """Fits by the optimum that they ended at, the best first and in each the best first; infinite costs are in none.

    A fit belongs to an optimum whose best cost is lower by no more than `same`.
    """
    groups: list[list[int]] = []
    for k in np.argsort(cost, kind="stable"):
        if not np.isfinite(cost[k]):
            continue
        if groups and cost[k] - cost[groups[-1][0]] <= same:
            groups[-1].append(int(k))
        else:
            groups.append([int(k)])
    return groups


MULTI_START = MultiStartKind()
