"""One log on the page: how it was read, what is in it, and what went wrong where it could not be read."""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import Inspection, inspect
from swashplate.flights.readers.log_fields import LogFields, log_fields
from swashplate.flights.readers.options import load_mapping
from swashplate.flights.readers.read import read as read_log
from swashplate.flights.readers.source import open_source
from swashplate.flights.readers.table_guess import guessed
from swashplate.flights.schema import is_known
from swashplate.flights.stored_column import StoredColumn
from swashplate.links.logs.bins import gaps
from swashplate.links.logs.channel_groups import field_groups, groups, shown_unit
from swashplate.links.logs.code_lines import Read, inspected
from swashplate.links.logs.drawn_channels import DrawnChannel, DrawnChannels
from swashplate.links.logs.kept_mappings import kept
from swashplate.links.logs.remedies import remedy
from swashplate.systems import free_memory

READING, READY, FAILED = "reading", "ready", "failed"
CHECKING = "check of a log"
"""Name of the thread that inspects."""
_TABLES = ("csv", "mat")
"""Readers that a mapping has a meaning for."""
_LOG = logging.getLogger("swashplate.open")
_PATIENCE = 1.0
"""Seconds: a log that is checked as quickly appears with its findings, a longer one is drawn before."""


@dataclass
class Opened:
    """A log that was given or dropped.

    Attributes:
        number: its place on the page, from 1.
        path: where it lies here.
        read: how it is read, under the name that the user gave it.
        state: "reading", "ready" or "failed".
        flight: where it is ready.
        inspection: where it is checked too, which on a long log takes longer than reading.
        fields: what the log holds beside its channels, where it holds more; listed: whether that has been looked for.
        foreign: whether it is a table of whose columns none is a channel: a person has to say what they are.
        problem, hint: where it failed.
        version: counts readings, so that a page sees that it was read anew.
    """

    number: int
    path: Path
    read: Read
    state: str = READING
    flight: Flight | None = None
    inspection: Inspection | None = None
    fields: LogFields | None = None
    listed: bool = False
    foreign: bool = False
    problem: str = ""
    hint: str = ""
    version: int = 0
    _channels: DrawnChannels = field(default_factory=DrawnChannels, repr=False)
    _groups: list[dict[str, Any]] = field(default_factory=list, repr=False)
    _gaps: dict[str, NDArray[np.int64]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, flight: Flight, read: Read, path: Path) -> Opened:
        """A log that has been read, checked at once.

        Raises:
            SwashError: where it cannot be checked.
        """
        opened = cls(1, path, read, READY, flight, inspect(flight), listed=True, version=1)
        opened._groups = groups(flight)
        return opened

    def load(self, read: Read) -> None:
        """Read the log, then check it in a thread; what cannot be read is said in `problem`, never raised.

        A table whose columns a person has mapped before is read by that mapping.
        """
        self.state = READING
        flight, problem, hint = None, "", ""
        mapped = None if read.mapping else kept(self.path)
        if mapped is not None:
            flight, problem, hint = self._read(read.with_mapping(str(mapped)))
        if flight is not None and mapped is not None:
            read = read.with_mapping(str(mapped))
        else:
            flight, problem, hint = self._read(read)
        free_memory()  # of a long log's reading half as much again as the flight has
        self.read = read
        self.foreign = self._is_foreign(flight, problem)
        self.flight, self.inspection, self.problem, self.hint = flight, None, problem, hint
        self._channels, self._gaps, self.fields, self.listed = DrawnChannels(), {}, None, False
        self._groups = [] if flight is None else groups(flight)
        self.version += 1
        self.state = FAILED if problem or flight is None else READY
        if self.state == READY and flight is not None:
            checking = threading.Thread(target=self._check, args=(flight,), name=CHECKING, daemon=True)
            checking.start()
            checking.join(_PATIENCE)

    def _read(self, read: Read) -> tuple[Flight | None, str, str]:
        """The flight, or what went wrong and what helps."""
        try:
            flight = read_log(
                self.path,
                units=dict(read.options.units),
                mapping=read.mapping or None,
                bad_stamps="drop" if read.options.drop_bad_stamps else "error",
                log=read.log,
            )
        except SwashError as error:
            return None, *_problem_and_hint(error)
        except (OSError, MemoryError) as error:
            return None, f"cannot be read: {error or 'it does not fit into memory'}.", ""
        if not flight.channels:
            return None, "holds no channel that is known.", ""
        return flight, "", ""

    def _is_foreign(self, flight: Flight | None, problem: str) -> bool:
        """Whether it is a table whose columns a person has to name: none is a channel, or it cannot be read."""
        if flight is not None and (flight.provenance.reader not in _TABLES or any(map(is_known, flight.channels))):
            return False
        if flight is None and "no such file" in problem:
            return False
        try:
            layout = guessed(open_source(self.path))
        except SwashError:
            return False
        return layout is not None and sum(guess.why != "no numbers" for guess in layout[1]) > 1

    def read_mapping(self) -> dict[str, Any]:
        """The mapping that it is read by, {} for none."""
        return dict(load_mapping(self.read.mapping)) if self.read.mapping else {}

    def _check(self, flight: Flight) -> None:
        """List what else the log holds and inspect what was read, unless it has been read anew meanwhile."""
        fields = log_fields(self.path)
        free_memory()
        if self.flight is flight:
            self.fields, self.listed = fields, True
            self._groups = [*self._groups, *field_groups(fields)]
        inspection, problem, hint = None, "", ""
        try:
            inspection = inspect(flight)
        except SwashError as error:
            problem, hint = _problem_and_hint(error)
        except Exception as error:  # a thread's end is heard by nobody else
            _LOG.error("A check failed: %s: %s", type(error).__name__, error)
            problem = f"could not be checked ({type(error).__name__}: {error})."
        free_memory()
        if self.flight is flight:
            self.inspection, self.problem, self.hint = inspection, problem, hint
            if problem:
                self.state = FAILED

    @property
    def ready(self) -> Flight:
        """The flight.

        Raises:
            FlightError: where there is none.
        """
        if self.flight is None:
            raise FlightError(self.problem or "is still being read.", where=self.read.file, hint=self.hint or None)
        return self.flight

    def shown(self, name: str) -> DrawnChannel:
        """A channel in the unit of the screen, or a field as the log has it, kept while there is room.

        Raises:
            FlightError: where the log is not ready or has no such channel.
        """
        channels, flight = self._channels, self.ready
        drawn = channels.get(name)
        if drawn is None:
            if name not in flight and self.fields is not None and name in self.fields.listed:
                time, column = self.fields.column(name)
                time = channels.same_times(time - (flight.epoch or 0.0))
                unshared = (time, column.stored)
                drawn = DrawnChannel(time, column, self.fields.listed[name].unit, gaps(time), unshared)
            else:
                drawn = self._channel(flight, name)
            channels.keep(name, drawn)
        return drawn

    def _channel(self, flight: Flight, name: str) -> DrawnChannel:
        unit, factor = shown_unit(flight, name)
        time, home = flight.time(name), flight.stream_of(name)
        if home not in self._gaps:
            self._gaps[home] = gaps(time)
        stored = StoredColumn.behind(flight[name])
        if stored is not None:
            return DrawnChannel(time, stored.times(factor), unit, self._gaps[home])
        values = flight.values(name)
        shown = values if factor == 1.0 else values * factor
        return DrawnChannel(time, shown, unit, self._gaps[home], () if factor == 1.0 else (shown,))

    def to_document(self) -> dict[str, Any]:
        """What the page lists of it."""
        table = self.foreign or (self.flight is not None and self.flight.provenance.reader in _TABLES)
        head = {"id": self.number, "name": Path(self.read.file).name, "state": self.state, "version": self.version}
        head |= {"foreign": self.foreign, "table": table}
        code = inspected(self.read).to_document()
        if self.state == FAILED:
            mend = remedy(self.hint)
            refusal = {"problem": self.problem, "hint": self.hint, "remedy": mend and mend.to_document()}
            return {**head, **refusal, "code": code}
        if self.flight is None or self.state == READING:
            return head
        return {**head, **self._content, "code": code}

    @property
    def _content(self) -> dict[str, Any]:
        flight, look = self.ready, self.inspection
        origin = flight.provenance
        changes = [e for e in origin.events if e.kind == "parameter"]
        return {
            "start": flight.start,
            "stop": flight.stop,
            "epoch": flight.epoch,
            "vehicle": origin.vehicle,
            "reader": origin.reader,
            "simulated": origin.simulated,
            "options": self.read.options.option_text,
            "groups": self._groups,
            "checked": look is not None,
            "listed": self.listed,
            "sweeps": [{"number": i, **vars(s), "words": str(s)} for i, s in enumerate(look.sweeps if look else ())],
            "problems": [_with_remedy(text) for text in (look.problems if look else ())],
            "notes": list(look.notes if look else origin.notes),
            "modes": _modes(flight),
            "events": [
                {"time": e.time, "kind": e.kind, "text": e.text} for e in origin.events if e.kind != "parameter"
            ],
            "changes": [{"time": e.time, **_change(flight, e.time, dict(e.details))} for e in changes],
            "parameters": [[name, value] for name, value in sorted(origin.parameters.items())],
        }


def _problem_and_hint(error: SwashError) -> tuple[str, str]:
    """What went wrong, and the hint."""
    return f"{f'{error.channel}: ' if error.channel else ''}{error.problem}", error.hint or ""


def _with_remedy(text: str) -> dict[str, Any]:
    mend = remedy(text)
    return {"text": text, "remedy": mend and mend.to_document()}


def _change(flight: Flight, time: float, details: dict[str, Any]) -> dict[str, Any]:
    name = str(details.get("name", ""))
    before = flight.provenance.parameter(name, at=float(np.nextafter(time, -np.inf)))
    return {"name": name, "value": details.get("value"), "before": before}


def _modes(flight: Flight) -> list[dict[str, Any]]:
    """Flight modes with start and end [s]."""
    switched = [event for event in flight.provenance.events if event.kind == "mode"]
    ends = [*(event.time for event in switched[1:]), flight.stop][: len(switched)]
    return [{"start": e.time, "stop": end, "text": e.text} for e, end in zip(switched, ends, strict=True)]
