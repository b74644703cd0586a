"""What serves as the references of the inputs: their own sweeps only, and which other inputs have to be held still.

Sweeps as their own references: what a loop makes of gusts is not in the part of a stick that follows its sweep.

Autopilots say when they sweep and by which law: the reference is that law. Every other sweep is looked for in the
commands themselves, and followed there (`sweep_tracking`). Doublets, steps and what a pilot does between sweeps are no
part of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.sweep_tracking import Course, Ridge, course_of
from swashplate.flights.maneuvers.sweeps import all_rising
from swashplate.flights.provenance import Event
from swashplate.identification.responses.copies import broken_at
from swashplate.identification.responses.excitations import (
    SweepOfCommand,
    ToldSweeps,
    answering_words,
    axis_of,
    channel_of,
    only_answering,
    owners_of,
    times_of,
)
from swashplate.identification.responses.spectra import Signals, spectral_matrix

_FOLDED = 0.45
"""Share of the rate up to which a chirp is followed."""


def own_references(
    pieces: Sequence[Signals], logged: Sequence[ToldSweeps], commands: Sequence[int]
) -> tuple[SweepOfCommand, ...]:
    """What sweeps in the commands serve as references for.

    Args:
        pieces: records. logged: what the log says of each (`told_sweeps`).
        commands: columns of the commands in the records.
    """
    places = list(commands)
    return tuple(
        excitation
        for k, (piece, (_, events)) in enumerate(zip(pieces, logged, strict=True))
        for excitation in _sweeps_in(k, piece, piece.values[:, places], events)
    )


def _sweeps_in(k: int, piece: Signals, commands: Array, events: Sequence[Event]) -> list[SweepOfCommand]:
    """The sweeps of one record: those that the log tells of, and where it tells none, those that are seen."""
    time: Array = np.asarray(piece.start + np.arange(len(commands)) * piece.dt, dtype=np.float64)
    logged = [one for event in events if (one := _logged_sweep(k, time, commands, event)) is not None]
    if logged:
        return logged
    ridges: list[tuple[float, int, Ridge]] = []
    for i in range(commands.shape[1]):
        for ridge in all_rising(time, commands[:, i]):
            octaves = float(np.log2(ridge.frequency[-1] / ridge.frequency[0]))
            ridges.append((ridge.share * octaves, i, ridge))
    kept: list[tuple[int, Ridge]] = []
    for _, i, ridge in sorted(ridges, key=lambda item: -item[0]):
        if not any(ridge.start < other.stop and other.start < ridge.stop for _, other in kept):
            kept.append((i, ridge))
    return [
        _followed(
            k,
            time,
            commands,
            course_of(time, commands[:, i], ridge),
            band=(float(ridge.frequency[0]), float(ridge.frequency[-1])),
        )
        for i, ridge in kept
    ]


def _followed(
    k: int,
    time: Array,
    commands: Array,
    course: Course,
    *,
    band: tuple[float, float],
    added: Array | None = None,
    event: Event | None = None,
) -> SweepOfCommand:
    """A sweep with what each command has of it; what the program added is its reference where that is known."""
    parts = np.stack([course.in_signal(command) for command in commands.T], axis=1)
    inside = course.inside
    power, total = np.mean(parts[inside] ** 2, axis=0), np.mean(commands[inside] ** 2, axis=0)
    how = "the log's law" if added is not None else "its law" if course.lawful else "its phase"
    start, stop = time[inside][[0, -1]]
    return SweepOfCommand(
        references={k: parts if added is None else np.repeat(added[:, None], parts.shape[1], axis=1)},
        size=np.sqrt(power),
        share=power / np.where(total > 0.0, total, 1.0),
        times=f"{start:.1f} to {stop:.1f} s, {band[0]:.3g} to {band[1]:.3g} Hz, by {how}",
        axis="" if event is None else axis_of(event),
        channel="" if event is None else channel_of(event),
    )


def _logged_sweep(k: int, time: Array, commands: Array, event: Event) -> SweepOfCommand | None:
    """An autopilot's chirp by its law, as far as it was flown; None where it lies outside the record."""
    law = [event.details.get(field.name) for field in fields(Chirp)]
    numbers = [value for value in law if isinstance(value, int | float) and not isinstance(value, bool)]
    if len(numbers) < len(law):
        return None  # a sweep without its law is looked for in the inputs
    chirp = Chirp(int(numbers[0]), *map(float, numbers[1:]))
    start, stop = times_of(event)
    # Faster than half the rate the chirp is folded: it would be the reference of other frequencies.
    inside = (time >= start) & (time <= stop) & (chirp.frequency(time - start) < _FOLDED / float(time[1] - time[0]))
    if inside.sum() * float(time[1] - time[0]) < 2.0 / chirp.start_hz:
        return None
    elapsed = time[inside] - start
    frequency = chirp.frequency(elapsed)
    phase = 2.0 * np.pi * np.cumsum(frequency) * float(time[1] - time[0])
    added = np.zeros(time.size)
    added[inside] = chirp.signal(elapsed)
    course = Course(inside, phase, lawful=True)
    band = (float(frequency[0]), float(frequency[-1]))
    return _followed(k, time, commands, course, band=band, added=added, event=event)


_LINES, _WINDOWS = 40, 8
"""Frequencies, and windows in a stretch, by which it is seen how far a command follows a recorded reference."""
_FOLLOWS = 0.3
"""Share of an unnamed command's power that must follow a recorded reference for it to be this command's."""
_LEAST = 0.1
"""Share of a sweep that must lie in a record to count there."""
_SILENT = 1e-3
"""Power of an injected signal outside the sweeps that the log tells of, over that within."""


@dataclass(frozen=True)
class References:
    """What serves as references.

    Attributes:
        beside: inputs that are not named but were swept: the responses are conditioned on them.
        columns: for every record, shape (n, n_references).
        swept: whether each input, named and beside, has a sweep of its own.
        reference_of: the place among the references of that of each input, where it has one.
        sweeps: of the inputs, in words.
        unused: sweeps of commands that are not there, in words.
        answering: named inputs that only answer the sweeps of others.
        tracked: whether the sweeps are their own references.
    """

    beside: tuple[str, ...]
    columns: tuple[Array, ...]
    swept: tuple[bool, ...]
    reference_of: Mapping[int, int]
    sweeps: tuple[str, ...]
    unused: tuple[str, ...]
    answering: tuple[str, ...]
    tracked: bool

    def broken_loops(
        self, pieces: Sequence[Signals], place: Mapping[str, int], inputs: Sequence[str], outputs: Sequence[str]
    ) -> tuple[str, ...]:
        """The outputs that are the rest of a named input beside its own reference: loops broken there.

        Args:
            pieces: records. place: columns by name. inputs: all, named and beside. outputs: names.
        """
        fed = {name: place[name] for name in outputs}
        broken = [
            broken_at(pieces, [columns[:, self.reference_of[i]] for columns in self.columns], place[name], fed)
            for i, name in enumerate(inputs[: len(inputs) - len(self.beside)])
            if i in self.reference_of
        ]
        return tuple(dict.fromkeys(name for names in broken for name in names))

    def notes(self, hertz: Array, held: NDArray[np.bool_], outputs: Sequence[str], loops: Sequence[str]) -> list[str]:
        """What a reader must know of sweeps that the named inputs do not own.

        Args:
            hertz: frequencies. held: where each input is held still, shape (n_f, n_inputs).
            outputs: names. loops: those that are loops broken at an input.
        """
        aircraft = ", ".join(name for name in outputs if name not in loops)
        said = []
        if loops:
            said.append(
                f"{', '.join(loops)}: what the input is made of beside its sweep. The response is that of the loop "
                "broken there; loops of inputs that are not named stay closed."
            )
        for name, still in zip(self.beside, held[:, len(self.swept) - len(self.beside) :].T, strict=True):
            inside = hertz[still] if aircraft else hertz[:0]
            text = f"'{name}' was swept too."
            if inside.size:
                text += f" In the responses of {aircraft} it is held still"
                text += "." if still.all() else f" from {inside.min():.3g} to {inside.max():.3g} Hz."
            if inside.size < hertz.size:
                text += " Elsewhere" if inside.size else " Its stretch is left out, and else"
                text += " its loop moves it along."
            said.append(f"{text} Add it to --inputs for the responses to it.")
        if self.unused:
            said.append(f"sweeps of commands that are not in these records were not used: {'; '.join(self.unused)}.")
        return said


def references_of(
    pieces: Sequence[Signals],
    logged: Sequence[ToldSweeps],
    commands: Mapping[str, int],
    named: int,
    recorded: Mapping[str, int],
    *,
    called: Mapping[str, str],
) -> References | None:
    """The references of the named inputs and of what was swept beside them; None where nothing serves.

    A recorded reference that is silent outside the log's sweeps is split by them; another one by flight, because one
    log per axis is how axes are swept. Several recorded references stay as they are.

    Args:
        pieces: records. logged: what the log says of each.
        commands: their columns in the records by name; the first `named` are the inputs that were asked for.
        recorded: columns of recorded references by name; none where the sweeps themselves serve.
        called: the log's names of commands that were given others.

    Raises:
        FlightError: fewer references than inputs, or sweeps of other commands only.
    """
    names, places = list(commands), list(commands.values())
    inputs = names[:named]
    groups = [_recorded(pieces, logged, places, named, column) for column in recorded.values()]
    excitations = [one for group in groups for one in group] if recorded else own_references(pieces, logged, places)
    if not excitations:
        return None
    owners = owners_of(excitations, names, named, called=called)
    # Another recorded reference, as a set-point, may move what no sweep does.
    by_log = not recorded or all(one.channel for one in excitations)
    answering = only_answering(logged, inputs, called=called) if by_log else ()
    if len(answering) == named:
        raise FlightError(
            answering_words(logged, answering).removeprefix(f"{', '.join(answering)}: "),
            channel=", ".join(answering),
            hint="Name the command that was swept, or fly a sweep of this axis. --direct without --references gives "
            "what the records show, as it is.",
        )
    beside = tuple(name for name in names[named:] if name in owners)
    every = (*inputs, *beside)
    if not recorded and not any(name in owners for name in every):
        return None
    swept = tuple(name in owners for name in every)
    columns: list[list[Array]] = []  # for every reference, one a record
    of_input: dict[int, int] = {}
    owned = list(zip(excitations, owners, strict=True))
    for group, place in zip(groups, recorded.values(), strict=True) if recorded else ((excitations, -1),):
        if len(recorded) > 1 and not all(one.axis for one in group):
            columns.append([piece.values[:, place] for piece in pieces])
            continue
        for i, name in enumerate(every):
            parts = [np.zeros(len(piece.values)) for piece in pieces]
            mine = [one for one, owner in owned if owner == name and one in group]
            for one in mine:
                for k, part in one.references.items():
                    parts[k] += part[:, names.index(name)]
            if not mine and not recorded:  # an input without a sweep is its own reference
                parts = [piece.values[:, places[names.index(name)]] for piece in pieces]
            if mine or not recorded:
                of_input |= {i: len(columns)} if mine else {}
                columns.append(parts)
    references = References(
        beside,
        tuple(np.stack(parts, axis=1) for parts in zip(*columns, strict=True)),
        swept,
        of_input,
        tuple(f"{owner}: {one.times}" for one, owner in owned if owner in every),
        tuple(f"{one.axis}: {one.times}" for one, owner in owned if owner not in every),
        answering,
        tracked=not recorded,
    )
    if len(columns) < len(every):
        lacking = ", ".join(f"'{name}'" for name, known in zip(every, swept, strict=True) if not known)
        raise FlightError(
            f"{len(columns)} reference(s) cannot tell {len(every)} inputs apart"
            + (f": no sweep of {lacking} was found." if lacking else "."),
            channel=", ".join(every),
            hint="Give as many independent references as inputs, or sweeps of each axis, one after the other or in "
            "logs of their own.",
        )
    return references


def _recorded(
    pieces: Sequence[Signals], logged: Sequence[ToldSweeps], commands: Sequence[int], named: int, column: int
) -> list[SweepOfCommand]:
    """A recorded reference, split by the log's sweeps where it is one of them, otherwise by flight."""
    stretches: list[tuple[int, Event, NDArray[np.bool_]]] = []
    loud = quiet = 0.0
    for k, (piece, (_, events)) in enumerate(zip(pieces, logged, strict=True)):
        time = piece.start + np.arange(len(piece.values)) * piece.dt
        rest = np.ones(time.size, dtype=bool)
        for event in events:
            start, stop = times_of(event)
            inside = (time >= start) & (time <= stop)
            rest &= ~inside
            if inside.sum() * piece.dt >= _LEAST * (stop - start):
                stretches.append((k, event, inside))
        power = piece.values[:, column] ** 2
        loud, quiet = loud + float(power[~rest].sum()), quiet + float(power[rest].sum())
    if stretches and quiet <= _SILENT * loud:
        return [
            _followed_stretch({k: (pieces[k], inside)}, commands, named, column, event)
            for k, event, inside in stretches
        ]
    flights: dict[int, dict[int, tuple[Signals, NDArray[np.bool_]]]] = {}
    for k, (piece, (flight, _)) in enumerate(zip(pieces, logged, strict=True)):
        flights.setdefault(flight, {})[k] = piece, np.ones(len(piece.values), dtype=bool)
    return [_followed_stretch(parts, commands, named, column, None) for parts in flights.values()]


def _followed_stretch(
    parts: Mapping[int, tuple[Signals, NDArray[np.bool_]]],
    commands: Sequence[int],
    named: int,
    column: int,
    event: Event | None,
) -> SweepOfCommand:
    """A stretch of a recorded reference with what each command has of it, by their cross spectra."""
    cut = [replace(piece, values=piece.values[inside][:, [*commands, column]]) for piece, inside in parts.values()]
    window = max(piece.duration for piece in cut) / _WINDOWS
    omega = 2.0 * np.pi * np.geomspace(2.0 / window, 0.25 / cut[0].dt, _LINES)
    matrix = spectral_matrix(cut, omega, window=window, overlap=0.75)
    size = share = np.zeros(len(commands))
    if matrix is not None:
        width, g = np.gradient(omega), matrix.values
        auto = np.diagonal(g, axis1=1, axis2=2).real
        power = width @ (np.abs(g[:, :-1, -1]) ** 2 / np.maximum(auto[:, -1:], 1e-300))
        share = power / np.maximum(width @ auto[:, :-1], 1e-300)
        size = np.sqrt(np.where((share >= _FOLLOWS) | (np.arange(share.size) < named), power, 0.0))
    records = list(parts.values())
    (first, begun), (last, _) = records[0], records[-1]
    start = first.start + int(np.argmax(begun)) * first.dt
    stop = (start if last is first else last.start) + cut[-1].duration
    return SweepOfCommand(
        references={
            k: np.repeat((piece.values[:, column] * inside)[:, None], len(commands), axis=1)
            for k, (piece, inside) in parts.items()
        },
        size=size,
        share=share,
        times=f"{start:.1f} to {stop:.1f} s, as recorded",
        axis="" if event is None else axis_of(event),
        channel="" if event is None else channel_of(event),
    )
