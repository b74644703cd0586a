"""Fields that several verbs share: how logs are read, which vehicle flies and how, in which air."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.api.languages import Switches, Wind, Words
from swashplate.api.question import Answer, VerbQuestion, option, setting
from swashplate.api.saying import notice
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.flights.flight import Flight
    from swashplate.models.vehicle import Vehicle
    from swashplate.physics.environment import Environment

FLIGHT = (
    "a log, or a data set's file as coax56/flight_2011-08-01_vertical; FILE@5-30 takes the seconds 5 to 30, "
    "FILE#2 the second log of a Blackbox file"
)


SONIC = 340.0
"""m/s: no rotor's equations of ours hold at the speed of sound."""


class FromLogs(VerbQuestion[Answer]):
    """What a log does not say of itself."""

    mapping: Path | None = option(default=None, help="TOML file that says which columns are which channels.")
    units: Words | None = option(
        default=None, flag="--unit", metavar="NAME=UNIT", help="Unit of a channel or field of the log. May be repeated."
    )
    drop_bad_stamps: bool = option(default=False, help="Leave out samples whose time repeats or goes backwards.")

    def read(self, given: Any) -> list[Flight]:
        """Flights as logged; those that are flights already as they are."""
        from swashplate.flights.flight import Flight

        return [one if isinstance(one, Flight) else self._read(str(one)) for one in _listed(given)]

    def _read(self, text: str) -> Flight:
        """The flight that a text names; a saved simulation goes by its file's name."""
        from swashplate.flights.consistency import UNCHECKED
        from swashplate.flights.readers.options import split_log, split_window
        from swashplate.flights.readers.read import read as read_log

        stamps = "drop" if self.drop_bad_stamps else "error"
        mapping = self.mapping or self._kept(text)
        flight = read_log(text, mapping=mapping, units=self.units, bad_stamps=stamps)
        if self.unchecked():
            flight = flight.done(UNCHECKED)
        if not flight.provenance.simulated:
            return flight
        # Messages and reports name the file, not "simulated coax", of which there may be several.
        called = Path(split_log(split_window(text)[0])[0]).name
        return replace(flight, provenance=replace(flight.provenance, source=called))

    def unchecked(self) -> bool:
        """Whether channels are used although they contradict each other."""
        return False

    def _kept(self, text: str) -> Path | None:
        """The mapping that was kept for a table with these columns; units that are given speak for themselves."""
        from swashplate.flights.datasets import locate
        from swashplate.flights.readers.options import split_log, split_window
        from swashplate.links.logs.kept_mappings import kept

        place = None if self.units else kept(Path(locate(split_log(split_window(text)[0])[0])))
        if place is not None:
            notice(f"{text}: read with the mapping that was kept for these columns ({place}).")
        return place


class FromFewLogs(FromLogs[Answer]):
    """As `FromLogs`, of verbs that seldom read a log that lacks something."""

    mapping: Path | None = setting(default=None, help="TOML file that says which columns are which channels")
    units: Words | None = setting(default=None, help="units of channels or fields of the log")
    drop_bad_stamps: bool = setting(default=False, help="leave out samples whose time repeats or goes backwards")


class FromConditioned(FromLogs[Answer]):
    """How logs are brought to one rate."""

    rate: float = option(default=100.0, help="Conditioned rate.", unit="Hz", least=1.0, most=2000.0)
    cutoff: float = setting(
        default=0.0, help="low-pass on all channels, 0 for none: noise is modelled, not filtered", unit="Hz", least=0.0
    )
    as_logged: bool = option(
        default=False, help="Use channels as they are logged, even where they contradict each other."
    )

    def unchecked(self) -> bool:
        return self.as_logged

    def conditioned(self, given: Any) -> list[Flight]:
        """Flights at one rate, each step in its history; those that are flights already as they are."""
        from swashplate.flights.flight import Flight

        return [
            one if isinstance(one, Flight) else self._read(str(one)).condition(rate=self.rate, cutoff=self.cutoff)
            for one in _listed(given)
        ]

    def uniform(
        self, given: Any, flights: Sequence[Flight], channels: Sequence[str], *, names: Any, also: Sequence[str] = ()
    ) -> list[Flight]:
        """What was given and read, as `uniform_records` makes it; flights that are so already as they are."""
        from swashplate.flights.conditioning.uniform_records import is_uniform, uniform_records

        made: list[Flight] = []
        renamed = any(name != source for name, source in (names or {}).items())
        for one, flight in zip(_listed(given), flights, strict=True):
            if one is flight and not renamed and is_uniform(flight, [*channels, *(n for n in also if n in flight)]):
                made.append(flight)
            else:
                made += uniform_records(flight, channels, rate=self.rate, cutoff=self.cutoff, names=names, also=also)
        return made


def _listed(given: Any) -> list[Any]:
    """One log or several as several."""
    from swashplate.flights.flight import Flight

    return [given] if isinstance(given, Flight | str | Path) else list(given or ())


def called(given: Any) -> list[str] | None:
    """What the user calls logs, where all were named."""
    if isinstance(given, str | Path):
        return [str(given)]
    named = isinstance(given, Sequence) and all(isinstance(one, str | Path) for one in given)
    return [str(one) for one in given] if named else [] if given is None else None


class OfVehicle(VerbQuestion[Answer]):
    """A vehicle with changed numbers and options."""

    changes: Switches | None = option(
        default=None,
        flag="--set",
        help="Change a number or an option of the card, e.g. mass=0.35 or bar=true. Repeatable.",
    )

    def flying(self, given: Any, *, whole: bool = False) -> Vehicle:
        """The vehicle with its changes; with `whole`, one that flies, told before its assumed ranges are."""
        return changed(given, self.changes or {}, whole=whole)


def name_of(given: Any) -> str | None:
    """What a vehicle was called, where it was given by its name or file."""
    return str(given) if isinstance(given, str | Path) else None


def changed(given: Any, changes: Any, *, whole: bool = False) -> Vehicle:
    """A vehicle with other numbers and options.

    Raises:
        CardError, SwashError: what is no number or option of it, or no equation uses.
    """
    from swashplate.models.catalogue import from_card
    from swashplate.models.catalogue import vehicle as find
    from swashplate.models.vehicle import Vehicle

    made = given if isinstance(given, Vehicle) else find(given)
    switches, numbers = {}, {}
    for name, value in changes.items():
        word = isinstance(value, bool) or (isinstance(value, str) and value.lower() not in ("nan", "inf", "-inf"))
        if word or (name in made.card.options and name not in made.card.parameters):
            switches[name] = value
        elif isinstance(value, str):
            raise SwashError(f"'{name}={value}' is not a number.", channel="--set")
        else:
            numbers[name] = value
    if switches:
        made = find(given, **switches) if isinstance(given, str | Path) else _switched(made, switches)
    if whole:
        from swashplate.simulation.trim import need_whole_body

        need_whole_body(made)
    how = {"source": "the command line", "status": "assumed"}
    if made.structure is not None:
        for words in assumed_ranges(made):
            notice(words)
        return made.with_values(numbers, **how) if numbers else made
    return from_card(made.card.with_values(numbers, **how)) if numbers else made


def _switched(vehicle: Vehicle, switches: Any) -> Vehicle:
    from swashplate.models.catalogue import from_card

    return from_card(replace(vehicle.card, options={**vehicle.card.options, **switches}))


def assumed_ranges(vehicle: Vehicle) -> list[str]:
    """What of a state-space model's inputs the file does not say."""
    from swashplate.models.linear.linear_vehicle import unlimited

    if vehicle.structure is None or not (usual := unlimited(vehicle.structure)):
        return []
    model = vehicle.structure
    ranges = dict(zip(vehicle.input_names, vehicle.input_limits, strict=True))
    told = ", ".join(sorted({f"{ranges[n][1]:.3g} {model.units.get(n, '')}".removesuffix(" 1") for n in usual}))
    return [f"Careful: range of {', '.join(usual)}: assumed, {told} either way; [limits] says it."]


def linear_model(name: Any) -> Any:
    """The model of a state-space file or a ready structure; None for anything else."""
    from swashplate.models.catalogue import is_state_space, structure

    return structure(name).structure if isinstance(name, str | Path) and is_state_space(name) else None


class InAir(OfVehicle[Answer]):
    """The air around a vehicle."""

    wind: Wind = option(default=(0.0, 0.0, 0.0), help="Wind towards north, east and down.", unit="m/s")
    altitude: float | None = option(
        default=None, help="Altitude in the standard atmosphere; without it, the card's air or sea level.", unit="m"
    )

    def around(self, vehicle: Vehicle) -> Environment:
        """The environment that is asked for."""
        from swashplate.models.surroundings import environment_of
        from swashplate.physics.environment import Environment, air_density

        if self.altitude is not None and not -500.0 <= self.altitude <= 11_000.0:
            raise SwashError(f"is {self.altitude:g} m, expected -500 to 11000.", channel="altitude")
        north, east, down = self.wind
        around = environment_of(vehicle, Environment(north, east, down))
        return around if self.altitude is None else around._replace(air_density=air_density(self.altitude))


def drawn(vehicle: Vehicle, fit: Any, *, count: int, seed: int = 1) -> tuple[Vehicle, ...]:
    """Models that a fit cannot tell from the one that it found.

    Raises:
        SwashError: where the file holds no fit, or one that found other numbers than this model has.
    """
    if fit is None:
        return ()
    from swashplate.api.load import load
    from swashplate.identification.core.result import Result

    fitted = fit if isinstance(fit, Result) else load(fit, equations=vehicle)
    if not isinstance(fitted, Result):
        raise SwashError("holds no fit.", where=fit, channel="--posterior", hint="Give the fit.json beside the model.")
    own = vehicle.card.values()
    for name in fitted.names:
        if not math.isclose(own.get(name, math.nan), fitted[name].value, rel_tol=1e-6, abs_tol=1e-12):
            has = f"{own[name]:.6g}" if name in own else "none"
            raise SwashError(
                f"is of another model: it found {name} = {fitted[name].value:.6g}, {vehicle.card.title} has {has}.",
                where=None if isinstance(fit, Result) else fit,
                channel="--posterior",
                hint="Give the model file that this fit wrote beside it.",
            )
    values = fitted.draw_values(count, seed=seed, within=vehicle)
    return tuple(vehicle.with_values({n: float(v[k]) for n, v in values.items()}) for k in range(count))


def one_or_more(speed: Any) -> tuple[float, ...]:
    """Speeds, one or several [m/s]."""
    return tuple(map(float, speed)) if isinstance(speed, Iterable) else (float(speed),)


def strings(given: Iterable[Any] | str | None) -> tuple[str, ...]:
    """Names given as a list, or none."""
    return () if given is None else (given,) if isinstance(given, str) else tuple(given)


def turbulence(gusts: Any) -> Any:
    """What `gusts` asks for: none, indoor, indoor=SIGMA, a mean wind [m/s], or gusts as they are."""
    from swashplate.api.languages import numbers
    from swashplate.simulation.wind import INDOOR, indoor, outdoor

    if gusts is None or gusts == "none":
        return None
    if not isinstance(gusts, str | int | float):
        return gusts
    if gusts == "indoor":
        return INDOOR
    kind, told, sigma = str(gusts).partition("=")
    try:
        if told and kind.strip() == "indoor":
            return indoor(numbers(sigma, "--gusts", count=1)[0])
        return outdoor(numbers(str(gusts), "--gusts", count=1)[0])
    except SwashError as error:
        raise SwashError(
            f"is '{gusts}', expected none, indoor, indoor=0.3 (m/s), or a mean wind in m/s ({error.problem}).",
            channel="--gusts",
        ) from None


def flight_limits(given: Any) -> Any:
    """`lean=30deg` and so on as what is judged by; those that are not given keep their defaults."""
    from dataclasses import replace

    from swashplate.api.languages import numbers
    from swashplate.control.draws.spread import SHOWN, Limits

    chosen = Limits()
    if isinstance(given, Limits):
        return given
    for name, text in (given or {}).items():
        if name not in SHOWN:
            raise SwashError(f"'{name}' is no limit; expected {', '.join(SHOWN)}.", channel="--limit")
        unit, factor = SHOWN[name]
        if str(text).strip() == "none":
            chosen = replace(chosen, **{name: math.inf})
            continue
        value = numbers(str(text).strip().removesuffix(unit).strip(), "--limit", count=1)[0]
        if not value > 0.0:
            raise SwashError(f"{name} is {text}, expected more than 0 {unit}.", channel="--limit")
        chosen = replace(chosen, **{name: value / factor})
    return chosen
