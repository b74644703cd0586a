"""Campaigns of flights: one controller on many aircraft in many gusts (`sp.monte_carlo` in tasks)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.api.asking import flight_limits, turbulence
from swashplate.api.campaigns.kind import CampaignFindings, CampaignKind, vehicle_of
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion
from swashplate.api.monte_carlo import MonteCarlo
from swashplate.api.verbs.simulate import FlyMany
from swashplate.control.draws.spread import SHOWN
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import parse as parse_maneuver


class FlightsKind(CampaignKind):
    """The words of `swash control monte-carlo`; some seconds of work in a task, so that starting it costs little."""

    rows = "flight"
    question = FlyMany
    usual_batch = 256

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        flight_limits(settings.limit)
        turbulence(settings.gusts)
        parse_maneuver(settings.maneuver)
        return super().parts(settings, folder)

    def run(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> Columns:
        many = self._fly_portion(settings, portion, files)
        spread = many.spread
        columns: Columns = {"lost_after": spread.lost_after, "lost": np.isfinite(spread.lost_after).astype(np.int64)}
        columns |= {name: np.asarray(values, dtype=np.float64) for name, values in spread.values.items()}
        columns["place_rms"] = spread.place_rms
        return columns | {f"drawn.{name}": np.asarray(v, dtype=np.float64) for name, v in many.drawn.items()}

    def replay(self, settings: Any, portion: Portion, files: Mapping[str, Path], row: int) -> Flight:
        return self._fly_portion(settings, portion, files).flight(row)

    def findings(self, settings: Any, table: Columns) -> CampaignFindings:
        shown = {name: how for name, how in (*SHOWN.items(), ("place_rms", ("m", 1.0))) if name in table}
        summary: list[tuple[str, str, str]] = []
        if "lost" in table:
            lost, every = int(np.sum(table["lost"])), len(table["lost"])
            limit_text = flight_limits(settings.limit).summary_text()
            summary = [("Lost", f"{share_words(lost, every)} (limits: {limit_text})", "bad" if lost else "good")]
        worst = "place" if "place" in table else ""
        return CampaignFindings(tuple(summary), shown, worst=worst, again=".nc")

    def _fly_portion(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> MonteCarlo:
        vehicle = vehicle_of(str(files.get(settings.vehicle, settings.vehicle)))
        return self.asked(settings, files, vehicle=vehicle, count=portion.count, seed=portion.seed).answer()


MONTE_CARLO = FlightsKind()
