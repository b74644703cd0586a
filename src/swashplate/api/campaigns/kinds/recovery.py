"""Campaigns of "simulate, identify, recover": do the bounds of a fit hold the truth as often as they say?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
from scipy.stats import norm

from swashplate.api.asking import turbulence
from swashplate.api.campaigns.fitting import FitKind, FitWords, unusable, values_of, within_bounds
from swashplate.api.campaigns.kind import CampaignFindings, vehicle_of
from swashplate.api.campaigns.shares import SURE, share_interval, share_words
from swashplate.api.campaigns.tasks import Columns, Portion
from swashplate.api.fly_maneuver import holding
from swashplate.api.verbs.identify import FitVehicle
from swashplate.arrays import Array
from swashplate.errors import CampaignError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.series import parse as parse_maneuver
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_maneuver
from swashplate.simulation.sensors import QUIET, Sensors, observe
from swashplate.simulation.wind import dryden

_NORMAL = float(norm.ppf(0.5 * (1.0 + SURE)))
"""Standard deviations that hold 95 % of a normal distribution."""


class RecoveryWords(FitWords, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What a campaign of recoveries says beside the words of `swash identify`: its vehicle is the truth.

    Attributes:
        controller: its file; the hold of the vehicle's kind where not given.
        maneuver: as of `swash simulate`.
        gusts: none, "indoor", "indoor=SIGMA", or a mean wind outdoors [m/s].
        sensors: "clean" (motion capture with noise only) or "real" (with gaps and outliers).
        noise: instead of these, standard deviations of white noise by channel, for any model.
        start: each free number starts off the truth by up to this share of it; one that is zero starts there.
    """

    maneuver: str
    controller: str | None = None
    gusts: str | float = "none"
    sensors: Literal["clean", "real"] = "clean"
    noise: dict[str, float] = msgspec.field(default_factory=dict)
    start: float = 0.2


class RecoveryKind(FitKind):
    """See `CampaignKind`."""

    settings_type = RecoveryWords
    own_files = ("controller",)
    without = (*FitKind.without, "flight", "mapping", "units", "drop_bad_stamps", "as_logged")

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        turbulence(settings.gusts)
        parse_maneuver(settings.maneuver)
        if not 0.0 <= settings.start < 1.0:
            raise CampaignError(f"is {settings.start:g}, expected 0 to less than 1.", channel="start")
        return super().parts(settings, folder)

    def start(self, settings: Any, model: Vehicle, names: Sequence[str], seed: int) -> Array:
        off = np.random.default_rng([seed, 1]).uniform(-settings.start, settings.start, len(names))
        return within_bounds(model, names, values_of(model, names) * (1.0 + off))

    def data(self, settings: Any, asked: FitVehicle, model: Vehicle, files: Mapping[str, Path]) -> Callable[[int], Any]:
        controller = None if settings.controller is None else files[settings.controller]
        return lambda seed: simulate_flight(settings, model, controller, seed)

    def run(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> Columns:
        columns = super().run(settings, portion, files)
        truth = vehicle_of(str(files.get(settings.vehicle, settings.vehicle)))
        for name in [name.removesuffix(".sigma") for name in columns if name.endswith(".sigma")]:
            with np.errstate(divide="ignore", invalid="ignore"):
                columns[f"{name}.off"] = (columns[name] - truth.numbers[name].value) / columns[f"{name}.sigma"]
        return columns

    def findings(self, settings: Any, table: Columns) -> CampaignFindings:
        names = [name.removesuffix(".off") for name in table if name.endswith(".off")]
        if not names or "usable" not in table:
            return CampaignFindings((), {})
        usable = table["usable"] == 1
        cells, careful, narrow = [], [], []
        for name in names:
            off = table[f"{name}.off"][usable]
            inside, every = int(np.sum(np.abs(off) < _NORMAL)), len(off)
            judgement = judged(inside, every)
            if "narrow" in judgement:
                narrow.append(name)
            low, high = share_interval(inside, every) if every else (0.0, 1.0)
            share = f"{100 * inside / every:.1f}" if every else ""
            bias, scatter = (f"{f(off):.2f}" if every > 1 else "" for f in (np.mean, np.std))
            cells.append((name, share, f"{100 * low:.1f} to {100 * high:.1f}", bias, scatter, judgement))
        if narrow:
            careful.append(f"bounds are too narrow: {', '.join(narrow)}")
        lost = int(np.sum(~usable))
        careful += unusable(table, usable)
        summary = (("Usable fits", share_words(len(usable) - lost, len(usable)), "caution" if lost else "good"),)
        head = ("parameter", "truth inside 95 % [%]", "which is", "mean off [sigma]", "scatter [sigma]", "the bounds")
        shown = {f"{name}.off": ("sigma", 1.0) for name in names}
        table_of = ("How often the bounds hold the truth", head, tuple(cells))
        return CampaignFindings(summary, shown, tables=(table_of,), careful=tuple(careful))


def judged(inside: int, of: int) -> str:
    """Whether bounds that should hold the truth in 95 % of all cases do, as far as so many tell."""
    if not of:
        return "nothing is known"
    low, high = share_interval(inside, of)
    if high < SURE:
        return "too narrow"
    return "too wide" if low > SURE else "as they say"


def simulate_flight(settings: Any, truth: Vehicle, controller: Path | None, seed: int) -> Flight:
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
        measured = observe(flight, truth, sensors=QUIET if settings.sensors == "clean" else Sensors(), seed=seed)
        return measured.condition(rate=settings.rate, cutoff=0.0)
    random = np.random.default_rng([seed, 2])
    columns = {name: flight.values(name) for name in truth.input_names}
    for name, sigma in settings.noise.items():
        values = flight.values(name)
        columns[name] = values + sigma * random.standard_normal(len(values))
    units = {name: flight[name].attrs["units"] for name in columns}
    return Flight({"uniform": stream(flight.time(truth.input_names[0]), columns, units)})


RECOVERY = RecoveryKind()
