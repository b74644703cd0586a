"""Campaigns of fits from many starts: is what a fit found the best there is, and how often is that found?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from swashplate.api.asking import strings
from swashplate.api.campaigns.fitting import FitKind, FitWords, unusable, values_of, within_bounds
from swashplate.api.campaigns.kind import CampaignFindings, logged
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion
from swashplate.api.verbs.identify import FitVehicle
from swashplate.arrays import Array
from swashplate.errors import CampaignError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.vehicle import Vehicle

_SHOWN = 6


class MultiStartWords(FitWords, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What a campaign of starts says beside the words of `swash identify`.

    Attributes:
        flight: logs to fit to. responses: measured responses (.nc) instead, for a state-space model.
        factor: each free number starts at its value times or divided by up to this; one that is zero, within plus and
            minus `factor` times its standard deviation or one.
        same: costs that differ by no more are of one optimum, in units of the cost.
    """

    flight: list[str] = msgspec.field(default_factory=list)
    responses: str | None = None
    factor: float = 3.0
    same: float = 0.1


class MultiStartKind(FitKind):
    """See `CampaignKind`."""

    settings_type = MultiStartWords
    own_files = ("responses",)

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        if bool(settings.flight) == (settings.responses is not None):
            raise CampaignError("expected either flights or responses.", channel="flight")
        if not settings.factor > 1.0 or not settings.same >= 0.0:
            raise CampaignError("expected factor above 1 and same at least 0.", channel="factor, same")
        return super().parts(settings, folder)

    def start(self, settings: Any, model: Vehicle, names: Sequence[str], seed: int) -> Array:
        return start_values(model, names, factor=settings.factor, seed=seed)

    def data(self, settings: Any, asked: FitVehicle, model: Vehicle, files: Mapping[str, Path]) -> Callable[[int], Any]:
        if settings.responses is not None:
            responses = FrequencyResponse.load(files[settings.responses])
            return lambda seed: responses
        raw = tuple(logged(asked, files[name]) for name in settings.flight)
        if model.structure is None:
            flights = tuple(flight.condition(rate=asked.rate, cutoff=asked.cutoff) for flight in raw)
        else:
            channels = (*model.structure.inputs, *(strings(asked.outputs) or model.structure.outputs))
            flights = uniform_records(raw, channels, rate=asked.rate, cutoff=asked.cutoff, names={})
        return lambda seed: flights

    def findings(self, settings: Any, table: Columns) -> CampaignFindings:
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


def start_values(model: Vehicle, names: Sequence[str], *, factor: float, seed: int) -> Array:
    """Where a fit starts: each number off by a factor that is evenly spread in its logarithm, within its bounds."""
    random = np.random.default_rng(seed)
    middle, spread = values_of(model, names), random.uniform(-1.0, 1.0, len(names))
    sigmas = np.array([getattr(model.numbers[name], "sigma", None) or 1.0 for name in names])
    about = factor * spread * sigmas
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
