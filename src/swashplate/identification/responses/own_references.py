"""Sweeps as their own references: what a loop makes of gusts is not in the part of a stick that follows its sweep.

Autopilots say when they sweep and by which law: the reference is that law. Every other sweep is looked for in the
commands themselves, and followed there (`sweep_tracking`). Doublets, steps and what a pilot does between sweeps are no
part of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.sweep_tracking import Course, Ridge, course_of
from swashplate.flights.maneuvers.sweeps import all_rising
from swashplate.flights.provenance import Event
from swashplate.identification.responses.excitations import SweepOfCommand, ToldSweeps, axis_of, channel_of, times_of
from swashplate.identification.responses.spectra import Signals

_FOLDED = 0.45
"""Share of the rate up to which a chirp is followed."""


def own_references(
    pieces: Sequence[Signals], told: Sequence[ToldSweeps], commands: Sequence[int]
) -> tuple[SweepOfCommand, ...]:
    """What sweeps in the commands serve as references for.

    Args:
        pieces: records. told: what the log says of each (`told_sweeps`).
        commands: columns of the commands in the records.
    """
    places = list(commands)
    return tuple(
        excitation
        for k, (piece, (_, events)) in enumerate(zip(pieces, told, strict=True))
        for excitation in _sweeps_in(k, piece, piece.values[:, places], events)
    )


def _sweeps_in(k: int, piece: Signals, commands: Array, events: Sequence[Event]) -> list[SweepOfCommand]:
    """The sweeps of one record: those that the log tells of, and where it tells none, those that are seen."""
    time: Array = np.asarray(piece.start + np.arange(len(commands)) * piece.dt, dtype=np.float64)
    told = [one for event in events if (one := _told(k, time, commands, event)) is not None]
    if told:
        return told
    seen: list[tuple[float, int, Ridge]] = []
    for i in range(commands.shape[1]):
        for ridge in all_rising(time, commands[:, i]):
            octaves = float(np.log2(ridge.frequency[-1] / ridge.frequency[0]))
            seen.append((ridge.share * octaves, i, ridge))
    kept: list[tuple[int, Ridge]] = []
    for _, i, ridge in sorted(seen, key=lambda item: -item[0]):
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
    power, whole = np.mean(parts[inside] ** 2, axis=0), np.mean(commands[inside] ** 2, axis=0)
    how = "the log's law" if added is not None else "its law" if course.lawful else "its phase"
    start, stop = time[inside][[0, -1]]
    return SweepOfCommand(
        references={k: parts if added is None else np.repeat(added[:, None], parts.shape[1], axis=1)},
        size=np.sqrt(power),
        share=power / np.where(whole > 0.0, whole, 1.0),
        words=f"{start:.1f} to {stop:.1f} s, {band[0]:.3g} to {band[1]:.3g} Hz, by {how}",
        axis="" if event is None else axis_of(event),
        channel="" if event is None else channel_of(event),
    )


def _told(k: int, time: Array, commands: Array, event: Event) -> SweepOfCommand | None:
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
    own = time[inside] - start
    frequency = chirp.frequency(own)
    phase = 2.0 * np.pi * np.cumsum(frequency) * float(time[1] - time[0])
    added = np.zeros(time.size)
    added[inside] = chirp.signal(own)
    course = Course(inside, phase, lawful=True)
    band = (float(frequency[0]), float(frequency[-1]))
    return _followed(k, time, commands, course, band=band, added=added, event=event)
