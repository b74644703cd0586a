"""Where a flight comes from, what its log says happened, and what was done to it since."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

LATEST = 1e20
"""Seconds; nanoseconds since 1970 that are taken for seconds stay below."""

_FIRMWARES: Mapping[str, str] = {
    "ardupilot": "ArduPilot",
    "blackbox": "unnamed (Blackbox)",
    "ulog": "PX4",
    "px4log": "PX4",
}
"""What the format of a log tells of its autopilot, by reader."""


@dataclass(frozen=True)
class Event:
    """Something that a log says happened.

    Attributes:
        time: [s], on the flight's clock.
        kind: "message", "mode", "parameter", "sweep", "armed", "disarmed", "dropout", "error".
        text: in words.
        details: its numbers (JSON types only).
    """

    time: float
    kind: str
    text: str
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Problem:
    """What is wrong with a log as it was read, in `inspect`'s words.

    Attributes:
        text: in words, the channel's or stream's name first.
        scale: the factor by which a channel is off, and its standard error; empty where that is not what is wrong.
    """

    text: str
    scale: tuple[float, ...] = ()


@dataclass(frozen=True)
class Provenance:
    """Where a flight comes from.

    Attributes:
        source: file name, or the simulated vehicle's name.
        sha256: hash of the file's bytes ("" for a simulation).
        reader: the reader's or simulator's name.
        reader_version: its version.
        simulated: True where no aircraft flew.
        vehicle: the vehicle as the log or the user names it.
        notes: what a reader found wrong and what the user must know.
        damage: what is broken in the file itself (cut off, lost bytes, clock resets); the rest of it was read.
        parameters: an autopilot's settings as the log begins; changes in flight are events.
        events: what the log says happened, in order of time.
        problems: of the channels that are worked on, told where a log is conditioned (`checked`); they go with the
            flight into every report.
        epoch: the flight's time zero on the log's own clock [s], 0 where times are that clock's; a clock of Unix time
            counts from 1970. Readers keep stamps small with it (`flights/epoch.py`).
        firmware: the autopilot's, as the log names it ("ArduCopter V4.5.7"); "" where it does not.
    """

    source: str = ""
    sha256: str = ""
    reader: str = ""
    reader_version: str = ""
    simulated: bool = False
    vehicle: str = ""
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    problems: tuple[Problem, ...] = ()
    epoch: float = 0.0
    firmware: str = ""

    @property
    def autopilot(self) -> str:
        """The firmware that wrote the log, as far as it or its format tells; "" where no autopilot wrote it."""
        return self.firmware or _FIRMWARES.get(self.reader, "")

    def parameter(self, name: str, *, at: float = math.inf) -> float | None:
        """An autopilot's setting at a time [s], at the end of the log if none is given; None where it is not logged."""
        value = self.parameters.get(name)
        for event in self.events:
            if event.kind == "parameter" and event.time <= at and event.details.get("name") == name:
                value = float(event.details["value"])
        return value


@dataclass(frozen=True)
class ProcessingStep:
    """One thing done to a flight: the operation and its numbers (JSON types only)."""

    operation: str
    details: Mapping[str, Any] = field(default_factory=dict)
