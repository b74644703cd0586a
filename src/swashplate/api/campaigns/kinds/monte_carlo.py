"""Campaigns of flights: one controller on many aircraft in many gusts (`sp.monte_carlo` in tasks)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from swashplate.api.campaigns.flown import gusts_of, vehicle_of
from swashplate.api.campaigns.kind import CampaignFindings, CampaignSettings, NamedFile, in_batches
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion
from swashplate.api.controllers import load_controller
from swashplate.api.monte_carlo import MonteCarlo, monte_carlo
from swashplate.control.draws.spread import SHOWN, Limits
from swashplate.errors import CampaignError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import parse as parse_maneuver

_FLIGHTS = 256
"""Of a task, where the file does not say: some seconds of work, so that starting it costs little."""


class FlightVaries(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What differs from flight to flight; see `sp.monte_carlo`.

    Attributes:
        fit: a fit.json: aircraft are drawn from its covariance.
        tolerances: the card's numbers from their sigmas.
        numbers: standard deviations by name, in their units or as "5%".
        gusts: {indoor = SIGMA} or {outdoor = MEAN} [m/s].
        payload: up to so much more mass [kg]. delay: commands later by up to [s].
    """

    fit: str | None = None
    tolerances: bool = False
    numbers: dict[str, float | str] = msgspec.field(default_factory=dict)
    gusts: dict[str, float] = msgspec.field(default_factory=dict)
    payload: float = 0.0
    delay: float = 0.0


class FlightsCampaign(CampaignSettings, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file of a campaign of flights.

    Attributes:
        vehicle: a name, or a card's or model's file. controller: its file.
        maneuver: as of `swash simulate`.
        varies: what differs. battery: volts at the start and at the end. bits: of a command.
        limits: beyond which a flight is lost, in the units of a report (lean and heading in degrees); 0: none.
    """

    vehicle: str
    controller: str
    maneuver: str = "hover:10s"
    varies: FlightVaries = FlightVaries()
    battery: tuple[float, float] | None = None
    bits: int | None = None
    limits: dict[str, float] = msgspec.field(default_factory=dict)


class FlightsKind:
    """See `CampaignKind`."""

    rows = "flight"
    schema = FlightsCampaign

    def files(self, settings: FlightsCampaign) -> Sequence[NamedFile]:
        named = {"controller": settings.controller, "varies.fit": settings.varies.fit}
        given = (NamedFile(entry, name) for entry, name in named.items() if name is not None)
        return (NamedFile("vehicle", settings.vehicle, True), *given)

    def parts(self, settings: FlightsCampaign, folder: Path) -> tuple[Portion, ...]:
        _limits(settings.limits)
        gusts_of(settings.varies.gusts)
        parse_maneuver(settings.maneuver)
        return in_batches(settings, usual=_FLIGHTS)

    def run(self, settings: FlightsCampaign, portion: Portion, files: Mapping[str, Path]) -> Columns:
        many = self._flown(settings, portion, files)
        spread = many.spread
        columns: Columns = {"lost_after": spread.lost_after, "lost": np.isfinite(spread.lost_after).astype(np.int64)}
        columns |= {name: np.asarray(values, dtype=np.float64) for name, values in spread.values.items()}
        columns["place_rms"] = spread.place_rms
        return columns | {f"drawn.{name}": np.asarray(v, dtype=np.float64) for name, v in many.drawn.items()}

    def replay(self, settings: FlightsCampaign, portion: Portion, files: Mapping[str, Path], row: int) -> Flight:
        many = self._flown(settings, portion, files)
        return many.flight(row)

    def findings(self, settings: FlightsCampaign, table: Columns) -> CampaignFindings:
        shown = {name: (unit, factor) for name, (unit, factor) in SHOWN.items() if name in table}
        if "place_rms" in table:
            shown["place_rms"] = ("m", 1.0)
        summary: list[tuple[str, str, str]] = []
        if "lost" in table:
            lost, every = int(np.sum(table["lost"])), len(table["lost"])
            words = _limits(settings.limits).words()
            summary = [("Lost", f"{share_words(lost, every)} (limits: {words})", "bad" if lost else "good")]
        worst = "place" if "place" in table else ""
        return CampaignFindings(tuple(summary), shown, worst=worst, again=".nc")

    def _flown(self, settings: FlightsCampaign, portion: Portion, files: Mapping[str, Path]) -> MonteCarlo:
        varies = settings.varies
        vehicle = str(files.get(settings.vehicle, settings.vehicle))
        controller = load_controller(files[settings.controller])
        return monte_carlo(
            vehicle_of(vehicle),
            controller,
            maneuver=settings.maneuver,
            count=portion.count,
            fit=None if varies.fit is None else files[varies.fit],
            gusts=gusts_of(varies.gusts),
            battery=settings.battery,
            tolerances=varies.tolerances,
            vary=varies.numbers or None,
            payload=varies.payload,
            delay=varies.delay,
            bits=settings.bits,
            limits=_limits(settings.limits),
            seed=portion.seed,
        )


def _limits(given: Mapping[str, float]) -> Limits:
    limits = Limits()
    for name, value in given.items():
        if name not in SHOWN or not value >= 0.0:
            raise CampaignError(
                f"{name} = {value:g} is no limit; expected positive numbers of {', '.join(SHOWN)}.", channel="limits"
            )
        limits = replace(limits, **{name: value / SHOWN[name][1] if value else math.inf})
    return limits


MONTE_CARLO = FlightsKind()
