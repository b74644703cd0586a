"""Campaigns of flights: one controller on many aircraft in many gusts (`sp.monte_carlo` in tasks)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.api.asking import flight_limits, turbulence
from swashplate.api.campaigns.flown import vehicle_of
from swashplate.api.campaigns.kind import CampaignFindings, NamedFile, in_batches, question_of, schema_of
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion
from swashplate.api.monte_carlo import MonteCarlo
from swashplate.api.verbs.simulate import FlyMany
from swashplate.control.draws.spread import SHOWN
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import parse as parse_maneuver

_FLIGHTS = 256
"""Of a task, where the file does not say: some seconds of work, so that starting it costs little."""


FlightsCampaign = schema_of(FlyMany)
"""The file of a campaign of flights: the words of `swash control monte-carlo`."""


class FlightsKind:
    """See `CampaignKind`."""

    rows = "flight"
    schema = FlightsCampaign

    def files(self, settings: Any) -> Sequence[NamedFile]:
        fit = () if settings.fit is None else (NamedFile("fit", settings.fit),)
        return (NamedFile("vehicle", settings.vehicle, True), NamedFile("controller", settings.controller), *fit)

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        asked = question_of(settings, FlyMany)
        flight_limits(asked.limit)
        turbulence(asked.gusts)
        parse_maneuver(asked.maneuver)
        return in_batches(settings, usual=_FLIGHTS)

    def run(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> Columns:
        many = self._flown(settings, portion, files)
        spread = many.spread
        columns: Columns = {"lost_after": spread.lost_after, "lost": np.isfinite(spread.lost_after).astype(np.int64)}
        columns |= {name: np.asarray(values, dtype=np.float64) for name, values in spread.values.items()}
        columns["place_rms"] = spread.place_rms
        return columns | {f"drawn.{name}": np.asarray(v, dtype=np.float64) for name, v in many.drawn.items()}

    def replay(self, settings: Any, portion: Portion, files: Mapping[str, Path], row: int) -> Flight:
        many = self._flown(settings, portion, files)
        return many.flight(row)

    def findings(self, settings: Any, table: Columns) -> CampaignFindings:
        shown = {name: (unit, factor) for name, (unit, factor) in SHOWN.items() if name in table}
        if "place_rms" in table:
            shown["place_rms"] = ("m", 1.0)
        summary: list[tuple[str, str, str]] = []
        if "lost" in table:
            lost, every = int(np.sum(table["lost"])), len(table["lost"])
            words = flight_limits(settings.limit).words()
            summary = [("Lost", f"{share_words(lost, every)} (limits: {words})", "bad" if lost else "good")]
        worst = "place" if "place" in table else ""
        return CampaignFindings(tuple(summary), shown, worst=worst, again=".nc")

    def _flown(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> MonteCarlo:
        asked = question_of(
            settings,
            FlyMany,
            vehicle=vehicle_of(str(files.get(settings.vehicle, settings.vehicle))),
            controller=files[settings.controller],
            fit=None if settings.fit is None else files[settings.fit],
            count=portion.count,
            seed=portion.seed,
        )
        return asked.answer()


MONTE_CARLO = FlightsKind()
