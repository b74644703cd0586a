"""What a result was made from: names and hashes of flights, and what was done to them."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Problem, ProcessingStep


@dataclass(frozen=True)
class DataSource:
    """A flight, or a piece of one, without its signals.

    Attributes:
        name: of its file or of the simulated vehicle ("" where nothing is said).
        sha256: hash of the file's bytes ("" where there is no file).
        signals: SHA-256 of the conditioned signals themselves ("" where it is not known).
        reader, reader_version: what read it.
        simulated: True where no aircraft flew.
        notes: what the reader found.
        history: what was done to it, in order.
        segments: unbroken pieces, from and to [s].
        rate: of its first channel [Hz].
        damage: what is broken in the file itself.
        problems: of its channels that were worked on, as `inspect` tells them.
    """

    name: str
    sha256: str = ""
    signals: str = ""
    reader: str = ""
    reader_version: str = ""
    simulated: bool = False
    notes: tuple[str, ...] = ()
    history: tuple[ProcessingStep, ...] = ()
    segments: tuple[tuple[float, float], ...] = ()
    rate: float = float("nan")
    damage: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()

    def same_log(self, other: DataSource) -> bool:
        """True for two parts of one log: equal hashes of the file, or equal signals where there is no file."""
        if self.sha256 or other.sha256:
            return self.sha256 == other.sha256
        return self.signals == other.signals != ""


def source_of(flight: Flight) -> DataSource:
    """What a result keeps of a flight."""
    said = flight.provenance
    return DataSource(
        name=said.source,
        sha256=said.sha256,
        signals=_signals(flight),
        reader=said.reader,
        reader_version=said.reader_version,
        simulated=said.simulated,
        notes=tuple(said.notes),
        history=tuple(flight.history),
        segments=tuple((float(a), float(b)) for a, b in flight.segments or ((flight.start, flight.stop),)),
        rate=float(flight.rate(flight.channels[0])),
        damage=tuple(said.damage),
        problems=tuple(said.problems),
    )


def sources_of(flights: Iterable[Flight]) -> tuple[DataSource, ...]:
    return tuple(source_of(flight) for flight in flights)


def scale_words(data: Iterable[DataSource]) -> tuple[str, ...]:
    """The channels of the data that are off by a factor: what is fitted to them is off by as much."""
    return tuple(dict.fromkeys(f"{_log(one)}: {each.text}" for one in data for each in one.problems if each.scale))


def problem_words(data: Iterable[DataSource]) -> tuple[str, ...]:
    """What else is wrong with the data: a line for each log."""
    problems = {_log(one): "; ".join(each.text.rstrip(".") for each in one.problems if not each.scale) for one in data}
    return tuple(f"{log}: {text}." for log, text in problems.items() if text)


def _log(data: DataSource) -> str:
    """The name of the log that data are a piece of."""
    match = _INTERVAL.fullmatch(data.name)
    return (data.name if match is None else match["name"]) or "flight"


def hashes(flights: Iterable[Flight]) -> dict[str, dict[str, Any]]:
    """Hashes of flights by their names, as settings keep them: of the file, and of the conditioned signals.

    With their problems, where they have some. Where two flights have one name (windows of a log, simulations) only the
    hashes that both share are told.
    """
    by_name: dict[str, dict[str, Any]] = {}
    for flight in flights:
        name = flight.provenance.source or "flight"
        hashed: dict[str, Any] = {"sha256": flight.provenance.sha256, "signals": _signals(flight)}
        before = by_name.get(name, hashed)
        problems = [*before.get("problems", ()), *(asdict(problem) for problem in flight.provenance.problems)]
        by_name[name] = {key: value if before[key] == value else "" for key, value in hashed.items()}
        if problems:
            by_name[name]["problems"] = [one for i, one in enumerate(problems) if one not in problems[:i]]
    return by_name


_INTERVAL = re.compile(r"(?P<name>.+) -?[\d.]+-+[\d.]+ s")


def sources_named(names: Iterable[str], known: Mapping[str, Mapping[str, Any]]) -> tuple[DataSource, ...]:
    """Records ("log 3.00-9.00 s" each) with the hashes of their flights, of `hashes`."""
    sources = []
    for name in names:
        match = _INTERVAL.fullmatch(name)
        source = known.get(name if match is None else match["name"], {})
        problems = tuple(Problem(each["text"], tuple(each["scale"])) for each in source.get("problems", ()))
        sha256, signals = (str(source.get(key, "")) for key in ("sha256", "signals"))
        sources.append(DataSource(name, sha256=sha256, signals=signals, problems=problems))
    return tuple(sources)


def _signals(flight: Flight) -> str:
    digest = hashlib.sha256()
    for name in flight.channels:
        digest.update(name.encode())
        for values in (flight.time(name), flight.values(name)):
            digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()
