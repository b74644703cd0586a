"""What a log tells of a person and a place: taken out before a log is sent to others, unless it is asked for."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Event, Provenance
from swashplate.flights.schema import is_known
from swashplate.models.card import packaged_names

KINDS: Mapping[str, str] = {
    "place": "channels latitude, longitude, x and y, the map, parameters of a place",
    "serials": "parameters with numbers of devices and systems",
    "names": "the file's name, and what the log calls the craft",
    "messages": "texts that the log holds",
    "date": "when it was flown",
    "others": "channels whose meaning nobody knows here",
}
"""What can be kept, and what each is."""
_PLACED = ("latitude", "longitude", "x", "y")
_PARAMETERS: Mapping[str, re.Pattern[str]] = {
    "place": re.compile(r"(^|_)(LAT|LNG|LON|LATITUDE|LONGITUDE|DEC|DECL|HOME)\d*(_|$)|ORIG|OPOS|PRESS", re.IGNORECASE),
    "serials": re.compile(
        r"(^|_)(U?UID|DEV_?ID|SYS_?ID\w*|ID|SN|SERIAL_?(NO|NUM)\w*)\d*(_|$)|^DID_|BIND|DNLINK|UPLINK", re.IGNORECASE
    ),
    "date": re.compile(r"^STAT_|^RTC_|START_?TIME|DATE", re.IGNORECASE),
}
"""Names of parameters by what they tell; those of autopilots are numbers."""
_TELL_NO_NAME = ("ardupilot", "ulog", "px4log", "coax56", "nanobench")
"""Readers whose vehicle is a firmware and a kind of aircraft, which no owner has named."""
_ENDING = re.compile(r"\.[a-zA-Z0-9]{1,8}")
_SHORTEST = 4  # letters of a name that is looked for in other texts


class Stripped(NamedTuple):
    """A flight without what is personal, its name, what was left out in words, and what of it has a name."""

    flight: Flight
    called: str
    left_out: tuple[str, ...]
    named: tuple[str, ...]


def stripped(flight: Flight, path: Path, *, keep: Collection[str] = ()) -> Stripped:
    """A flight without all of `KINDS` that is not kept.

    Whatever is made of it later, from findings to words, is made of what remains: nothing is taken out of results.
    """
    origin, gone = flight.provenance, [kind for kind in KINDS if kind not in keep]
    called, vehicle = path.name, origin.vehicle
    dropped = [name for name in _PLACED if name in flight] if "place" in gone else []
    unknown = [n for n in flight.channels if not is_known(n) and not n.startswith(("mixer_", "stick_"))]
    unknown = unknown if "others" in gone else []
    secret = [pattern for kind, pattern in _PARAMETERS.items() if kind in gone]
    settings = [name for name in origin.parameters if any(pattern.search(name) for pattern in secret)]

    def is_kept(event: Event) -> bool:
        name = str(event.details.get("name", "")) if event.kind == "parameter" else ""
        return not ("messages" in gone and event.kind == "message") and not any(p.search(name) for p in secret)

    if "names" in gone:
        called = f"log{path.suffix if _ENDING.fullmatch(path.suffix) else ''}"
        vehicle = vehicle if vehicle in packaged_names() or origin.reader in _TELL_NO_NAME else origin.firmware
    messages = sum(event.kind == "message" for event in origin.events)
    left_out = {
        "place": ", ".join([*dropped, "the map"]),
        "serials": "serial numbers",
        "names": "the file's name, names of owner and craft",
        "messages": f"messages ({messages})",
        "date": "the date",
        "others": f"{len(unknown)} channels of unknown meaning" if unknown else "",
    }
    removed = [left_out[kind] for kind in gone if left_out[kind]]
    removed += [f"{len(settings)} parameters"] if settings else []
    clean = _cleaner(flight, path, vehicle) if "names" in gone else str
    provenance = Provenance(
        called,
        origin.sha256,
        origin.reader,
        origin.reader_version,
        origin.simulated,
        vehicle,
        tuple(map(clean, origin.notes)),
        tuple(map(clean, origin.damage)),
        {name: value for name, value in origin.parameters.items() if name not in settings},
        tuple(filter(is_kept, origin.events)),
        tuple(replace(problem, text=clean(problem.text)) for problem in origin.problems),
        0.0 if "date" in gone else origin.epoch,
        origin.firmware,
    )
    away = {*dropped, *unknown}
    streams = {name: data.drop_vars([v for v in away if v in data.data_vars]) for name, data in flight.streams.items()}
    kept = {name: data for name, data in streams.items() if data.data_vars}
    return Stripped(
        replace(flight, streams=kept, provenance=provenance, history=()), called, tuple(removed), (*unknown, *settings)
    )


def _cleaner(flight: Flight, path: Path, vehicle: str) -> Callable[[str], str]:
    """Takes names out of a sentence: of the file, of its source, and what the log calls the craft."""
    craft = flight.provenance.vehicle.replace(vehicle, "").strip() if vehicle else flight.provenance.vehicle
    names = {path.name, path.stem, flight.provenance.source, craft, *craft.split()}
    names = {name for name in names if len(name) >= _SHORTEST}
    if not names:
        return str
    pattern = re.compile("|".join(re.escape(name) for name in sorted(names, key=len, reverse=True)), re.IGNORECASE)
    return lambda text: pattern.sub("...", text)
