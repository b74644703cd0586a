"""Campaigns of "simulate, identify, recover": do the bounds of a fit hold the truth as often as they say?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
from scipy.stats import norm

from swashplate.api.asking import turbulence
from swashplate.api.campaigns.fitting import (
    Attempt,
    FitCampaign,
    outcome_columns,
    started,
    unusable,
    values_of,
    within_bounds,
)
from swashplate.api.campaigns.flown import vehicle_of
from swashplate.api.campaigns.kind import CampaignFindings, NamedFile, in_batches
from swashplate.api.campaigns.shares import SURE, share_interval, share_words
from swashplate.api.campaigns.tasks import Columns, Portion, seed_of
from swashplate.api.fly_maneuver import holding
from swashplate.errors import CampaignError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.series import parse as parse_maneuver
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import check_method
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_maneuver
from swashplate.simulation.sensors import QUIET, Sensors, observe
from swashplate.simulation.wind import dryden

_NORMAL = float(norm.ppf(0.5 * (1.0 + SURE)))
"""Standard deviations that hold 95 % of a normal distribution."""


class RecoveryCampaign(FitCampaign, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file of a campaign of recoveries: its vehicle is the truth.

    Attributes:
        controller: its file; the hold of the vehicle's kind where not given.
        maneuver: as of `swash simulate`. rate: samples per second [Hz].
        gusts: none, "indoor", "indoor=SIGMA", or a mean wind outdoors [m/s].
        sensors: "clean" (motion capture with noise only) or "real" (with gaps and outliers).
        noise: instead of these, standard deviations of white noise by channel, for any model.
        start: each free number starts off the truth by up to this share of it; one that is zero starts there.
    """

    maneuver: str
    controller: str | None = None
    rate: float = 100.0
    gusts: str | float = "none"
    sensors: Literal["clean", "real"] = "clean"
    noise: dict[str, float] = msgspec.field(default_factory=dict)
    start: float = 0.2


class RecoveryKind:
    """See `CampaignKind`."""

    rows = "fit"
    schema = RecoveryCampaign

    def files(self, settings: RecoveryCampaign) -> Sequence[NamedFile]:
        given = (NamedFile("vehicle", settings.vehicle, True),)
        return given if settings.controller is None else (*given, NamedFile("controller", settings.controller))

    def parts(self, settings: RecoveryCampaign, folder: Path) -> tuple[Portion, ...]:
        check_method(settings.method)
        turbulence(settings.gusts)
        parse_maneuver(settings.maneuver)
        if not 0.0 <= settings.start < 1.0:
            raise CampaignError(f"is {settings.start:g}, expected 0 to less than 1.", channel="start")
        return in_batches(settings, usual=1)

    def run(self, settings: RecoveryCampaign, portion: Portion, files: Mapping[str, Path]) -> Columns:
        truth = vehicle_of(str(files.get(settings.vehicle, settings.vehicle)))
        names = settings.free_of(truth)
        exact = values_of(truth, names)
        seeds = [seed_of(portion.seed, row) for row in range(portion.count)]
        attempts = [Attempt.at(partial(self._fitted, settings, truth, names, files, seed)) for seed in seeds]
        columns = outcome_columns(attempts)
        for name, true in zip(names, exact, strict=True):
            value, sigma = np.array([attempt.estimate(name) for attempt in attempts]).T
            with np.errstate(divide="ignore", invalid="ignore"):
                columns |= {name: value, f"{name}.sigma": sigma, f"{name}.off": (value - true) / sigma}
        return columns

    def replay(
        self, settings: RecoveryCampaign, portion: Portion, files: Mapping[str, Path], row: int
    ) -> Result[Any, Any]:
        truth = vehicle_of(str(files.get(settings.vehicle, settings.vehicle)))
        names = settings.free_of(truth)
        return self._fitted(settings, truth, names, files, seed_of(portion.seed, row))

    def findings(self, settings: RecoveryCampaign, table: Columns) -> CampaignFindings:
        names = [name.removesuffix(".off") for name in table if name.endswith(".off")]
        if not names or "usable" not in table:
            return CampaignFindings((), {})
        usable = table["usable"] == 1
        cells, careful, narrow = [], [], []
        for name in names:
            off = table[f"{name}.off"][usable]
            inside, every = int(np.sum(np.abs(off) < _NORMAL)), len(off)
            words = judged(inside, every)
            if "narrow" in words:
                narrow.append(name)
            low, high = share_interval(inside, every) if every else (0.0, 1.0)
            share = f"{100 * inside / every:.1f}" if every else ""
            bias, scatter = (f"{f(off):.2f}" if every > 1 else "" for f in (np.mean, np.std))
            cells.append((name, share, f"{100 * low:.1f} to {100 * high:.1f}", bias, scatter, words))
        if narrow:
            careful.append(f"bounds are too narrow: {', '.join(narrow)}")
        lost = int(np.sum(~usable))
        careful += unusable(table, usable)
        summary = (("Usable fits", share_words(len(usable) - lost, len(usable)), "caution" if lost else "good"),)
        head = ("parameter", "truth inside 95 % [%]", "which is", "mean off [sigma]", "scatter [sigma]", "the bounds")
        shown = {f"{name}.off": ("sigma", 1.0) for name in names}
        table_of = ("How often the bounds hold the truth", head, tuple(cells))
        return CampaignFindings(summary, shown, tables=(table_of,), careful=tuple(careful))

    def _fitted(
        self, settings: RecoveryCampaign, truth: Vehicle, names: Sequence[str], files: Mapping[str, Path], seed: int
    ) -> Result[Any, Any]:
        flight = flown(settings, truth, None if settings.controller is None else files[settings.controller], seed)
        off = np.random.default_rng([seed, 1]).uniform(-settings.start, settings.start, len(names))
        begin = started(truth, names, within_bounds(truth, names, values_of(truth, names) * (1.0 + off)))
        return settings.fitted(begin, flight)


def judged(inside: int, of: int) -> str:
    """Whether bounds that should hold the truth in 95 % of all cases do, as far as so many tell."""
    if not of:
        return "nothing is known"
    low, high = share_interval(inside, of)
    if high < SURE:
        return "too narrow"
    return "too wide" if low > SURE else "as they say"


def flown(settings: RecoveryCampaign, truth: Vehicle, controller: Path | None, seed: int) -> Flight:
    """One flight of the truth as its sensors saw it, conditioned."""
    maneuver = parse_maneuver(settings.maneuver)
    gusts = turbulence(settings.gusts)
    samples = round((maneuver.duration + 6.0) * settings.rate) + 1
    blowing = None if gusts is None else dryden(gusts, samples=samples, rate=settings.rate, seed=seed)
    flight = simulate_maneuver(
        truth,
        maneuver,
        controller=holding(controller, seed=seed),
        rate=settings.rate,
        wind=None if blowing is None else {name: series[:, 0] for name, series in blowing.items()},
    )
    if not settings.noise:
        seen = observe(flight, truth, sensors=QUIET if settings.sensors == "clean" else Sensors(), seed=seed)
        return seen.condition(rate=settings.rate, cutoff=0.0)
    random = np.random.default_rng([seed, 2])
    columns = {name: flight.values(name) for name in truth.input_names}
    for name, sigma in settings.noise.items():
        values = flight.values(name)
        columns[name] = values + sigma * random.standard_normal(len(values))
    units = {name: flight[name].attrs["units"] for name in columns}
    return Flight({"uniform": stream(flight.time(truth.input_names[0]), columns, units)})


RECOVERY = RecoveryKind()
