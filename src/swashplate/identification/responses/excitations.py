"""What moves the commands from outside: one sweep or one recorded reference, and whose it is.

A loop and a vehicle that couples its axes move every command while one of them is swept. An autopilot's log says which
command its sweep is added to. Elsewhere a sweep belongs to the command that it moves most, of what it is ever moved by
any sweep: a command that only answers has moved more in its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import MOVED
from swashplate.flights.provenance import Event

_RATE_LOOPS = frozenset(MOVED[axis] for axis in (7, 8, 9))
"""Commands that only rate loops make. The collective may be the pilot's own."""
_CLEAR = 0.2
"""Of a command's largest motion in any sweep, by which another command must be moved more to take a sweep from one
that is named: commands one behind the other move alike."""
_SHARE = 0.2
"""Weight of the share of a command's power between named commands that a sweep moves alike."""


@dataclass(frozen=True, eq=False)
class SweepOfCommand:
    """One sweep, or one recorded reference.

    Attributes:
        references: what serves as the reference for each command if the excitation is its own, by record, shape (n,
            n_commands) each.
        size: rms of what each command has of it, shape (n_commands,). share: of its power meanwhile, same shape.
        times: when, and how it is known.
        axis: that the log names ("" where it names none). channel: the log's name of the command that it is added to.
    """

    references: Mapping[int, Array]
    size: Array
    share: Array
    times: str
    axis: str = ""
    channel: str = ""


class ToldSweeps(NamedTuple):
    """What the log says of one unbroken piece: the place of its flight, and the sweeps that lie in it."""

    flight: int
    sweeps: tuple[Event, ...]


def told_sweeps(flights: Sequence[Flight]) -> list[ToldSweeps]:
    """The sweeps that the logs tell of, for every unbroken piece of the flights."""
    return [
        ToldSweeps(k, tuple(event for event in flight.provenance.events if _swept(event) and _within(event, piece)))
        for k, flight in enumerate(flights)
        for piece in flight.split()
    ]


def _swept(event: Event) -> bool:
    return event.kind == "sweep" and "axis" in event.details


def _within(event: Event, piece: Flight) -> bool:
    start, stop = times_of(event)
    return start < piece.stop and stop > piece.start


def times_of(event: Event) -> tuple[float, float]:
    """When a sweep began and how long it was seen [s]."""
    return float(event.details["start"]), float(event.details.get("seen", event.details["stop"]))


def axis_of(event: Event) -> str:
    """The axis of a sweep as the log names it."""
    return event.text.partition(",")[0] or f"axis {event.details['axis']}"


def channel_of(event: Event) -> str:
    """The command that a sweep is added to, by the log's name; "" where the log does not say."""
    return str(event.details.get("channel", ""))


def owners_of(
    excitations: Sequence[SweepOfCommand], commands: Sequence[str], named: int, *, called: Mapping[str, str]
) -> list[str]:
    """The command that each excitation belongs to; "" where it is one that is not there.

    Args:
        excitations: of the same records.
        commands: names; the first `named` were asked for.
        called: the log's names of commands that were given others.

    Raises:
        FlightError: a named command that sweeps of several axes move alike, and none of them alone.
    """
    if not excitations:
        return []
    # What the log calls one axis has one owner.
    groups = [[other for other in excitations if other is one or one.axis == other.axis != ""] for one in excitations]
    size = np.array([np.sqrt(np.mean([one.size**2 for one in group], axis=0)) for group in groups])
    share = np.array([np.mean([one.share for one in group], axis=0) for group in groups])
    relative = size / np.maximum(size.max(axis=0), 1e-300)
    score = np.where(size > 0.0, relative + _SHARE * share, -1.0)
    logged = [called.get(name, name) for name in commands]
    owners = [_owner(one.channel, logged, named, relative[k], score[k]) for k, one in enumerate(excitations)]
    owned = ["" if owner is None else commands[owner] for owner in owners]
    _refuse_mixtures(excitations, owned, {commands[i]: logged[i] for i in range(named)})
    return owned


def _owner(channel: str, logged: Sequence[str], named: int, relative: Array, score: Array) -> int | None:
    """Place of the command that an excitation belongs to."""
    if channel in logged[:named]:
        return logged.index(channel)
    # What an autopilot adds another axis' sweep to only answers this one.
    able = [i for i in range(named) if not channel or logged[i] not in MOVED.values()]
    best = max(able, key=lambda i: score[i], default=None)
    if channel:
        rival = logged.index(channel) if channel in logged else None
        ahead = 1.0 if rival is None else float(relative[rival])
    else:
        rival = max(range(named, len(logged)), key=lambda i: score[i], default=None)
        ahead = -np.inf if rival is None else float(relative[rival])
    return best if best is not None and relative[best] > ahead - _CLEAR else rival


def _refuse_mixtures(excitations: Sequence[SweepOfCommand], owners: Sequence[str], logged: Mapping[str, str]) -> None:
    for name, source in logged.items():
        axes = {one.axis: one.times for one, owner in zip(excitations, owners, strict=True) if owner == name}
        channels = {one.channel for one, owner in zip(excitations, owners, strict=True) if owner == name}
        if len(channels - {""}) > 1 and source not in channels:
            raise FlightError(
                f"was moved alike by sweeps of several axes, {listed_sweeps(axes)}: one response cannot be of all.",
                channel=name,
                hint="Take the stretch of one sweep (FILE@START-STOP), or name the axes' own commands: "
                f"{', '.join(sorted(channels - {''}))}.",
            )


def listed_sweeps(sweeps: Mapping[str, str]) -> str:
    """Axes or commands with the times of their sweeps."""
    return ", ".join(f"{name} ({text.partition(',')[0]})" for name, text in sweeps.items())


def only_answering(logs: Sequence[ToldSweeps], inputs: Sequence[str], *, called: Mapping[str, str]) -> tuple[str, ...]:
    """The inputs that a rate loop makes, in records of which the log says that only other commands were swept."""
    sweeps = [event for one in logs for event in one.sweeps]
    swept = {channel_of(event) for event in sweeps}
    if not sweeps or "" in swept:
        return ()
    return tuple(name for name in inputs if called.get(name, name) in _RATE_LOOPS - swept)


def answering_words(logs: Sequence[ToldSweeps], answering: Sequence[str]) -> str:
    """Why inputs have no response, and which sweeps there are."""
    swept = {
        f"{axis_of(event)} ('{channel_of(event)}')": f"{times_of(event)[0]:.1f} to {times_of(event)[1]:.1f} s"
        for one in logs
        for event in one.sweeps
    }
    return (
        f"{', '.join(answering)}: moved by no sweep; the log's are of {listed_sweeps(swept)}. What the loop makes of "
        "them is the controller's answer, and a response to it is not the aircraft's."
    )
