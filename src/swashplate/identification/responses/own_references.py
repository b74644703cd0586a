"""Sweeps as their own references: what a loop makes of gusts is not in the part of a stick that follows its sweep.

Autopilots say when they sweep and by which law: the reference is that law. Every other sweep is looked for in the
inputs themselves, and followed there (`sweep_tracking`). Doublets, steps and what a pilot does between sweeps are no
part of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.sweep_tracking import Course, Ridge, course_of
from swashplate.flights.maneuvers.sweeps import all_rising
from swashplate.flights.provenance import Event
from swashplate.identification.responses.spectra import Signals

_FOLDED = 0.45
"""Share of the rate up to which a chirp is followed."""


@dataclass(frozen=True)
class OwnReferences:
    """What serves as references.

    Attributes:
        columns: one reference per input, for every record, shape (n, n_inputs): where an input was never swept, itself.
        swept: whether a sweep was found for each input.
        sweeps: in words.
    """

    columns: tuple[Array, ...]
    swept: tuple[bool, ...]
    sweeps: tuple[str, ...]


@dataclass(frozen=True)
class _Found:
    piece: int
    course: Course
    chirp: Array | None
    """What the program added, where the log says so."""
    band: tuple[float, float]


def own_references(flights: Sequence[Flight], pieces: Sequence[Signals], inputs: Sequence[str]) -> OwnReferences | None:
    """References from the sweeps in the inputs; None where there is none.

    A sweep belongs to the input that follows it with more of its largest amplitude in any sweep than the others do: an
    off-axis stick, which the loop moves along, has moved more in its own.

    Args:
        flights: with their events. pieces: records, inputs first, in the flights' order.
        inputs: names.
    """
    events = _events_of(flights, pieces)
    sweeps = [one for k, piece in enumerate(pieces) for one in _sweeps_in(k, piece, len(inputs), events[k])]
    if not sweeps:
        return None
    followed = [
        np.stack([one.course.in_signal(pieces[one.piece].values[:, i]) for i in range(len(inputs))], axis=1)
        for one in sweeps
    ]
    power = np.array(
        [np.mean(part[one.course.inside] ** 2, axis=0) for one, part in zip(sweeps, followed, strict=True)]
    )
    own = [pieces[one.piece].values[one.course.inside, : len(inputs)] for one in sweeps]
    whole = np.array([np.mean(part**2, axis=0) for part in own])
    size = np.sqrt(power)
    largest = np.maximum(size.max(axis=0), 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        score = size / largest + 0.2 * np.nan_to_num(power / whole)
    owner = np.where(size > 0.0, score, -1.0).argmax(axis=1)
    swept = tuple(bool(np.any(owner == i)) for i in range(len(inputs)))
    columns = [np.zeros((len(piece.values), len(inputs))) for piece in pieces]
    words = []
    for one, part, i in zip(sweeps, followed, owner, strict=True):
        columns[one.piece][:, i] += part[:, i] if one.chirp is None else one.chirp
        where = pieces[one.piece].start + np.flatnonzero(one.course.inside)[[0, -1]] * pieces[one.piece].dt
        how = "the log's law" if one.chirp is not None else "its law" if one.course.lawful else "its phase"
        words.append(
            f"{inputs[i]}: {where[0]:.1f} to {where[1]:.1f} s, {one.band[0]:.3g} to {one.band[1]:.3g} Hz, by {how}"
        )
    for column, piece in zip(columns, pieces, strict=True):
        for i in np.flatnonzero(~np.array(swept)):
            column[:, i] = piece.values[:, i]
    return OwnReferences(tuple(columns), swept, tuple(words))


def _events_of(flights: Sequence[Flight], pieces: Sequence[Signals]) -> list[list[Event]]:
    """The sweeps that the logs tell of, for every piece."""
    told = [
        [event for event in flight.provenance.events if event.kind == "sweep" and "axis" in event.details]
        for flight in flights
        for _ in flight.split()
    ]
    assert len(told) == len(pieces)
    return told


def _sweeps_in(k: int, piece: Signals, inputs: int, events: Sequence[Event]) -> list[_Found]:
    """The sweeps of one record: those that the log tells of, and where it tells none, those that are seen."""
    time: Array = np.asarray(piece.start + np.arange(len(piece.values)) * piece.dt, dtype=np.float64)
    told = [one for event in events if (one := _told(k, time, event)) is not None]
    if told:
        return told
    seen: list[tuple[float, int, Ridge]] = []
    for i in range(inputs):
        for ridge in all_rising(time, piece.values[:, i]):
            octaves = float(np.log2(ridge.frequency[-1] / ridge.frequency[0]))
            seen.append((ridge.share * octaves, i, ridge))
    kept: list[tuple[int, Ridge]] = []
    for _, i, ridge in sorted(seen, key=lambda item: -item[0]):
        if not any(ridge.start < other.stop and other.start < ridge.stop for _, other in kept):
            kept.append((i, ridge))
    return [
        _Found(
            k, course_of(time, piece.values[:, i], ridge), None, (float(ridge.frequency[0]), float(ridge.frequency[-1]))
        )
        for i, ridge in kept
    ]


def _told(k: int, time: Array, event: Event) -> _Found | None:
    """An autopilot's chirp by its law, as far as it was flown; None where it lies outside the record."""
    law = [event.details.get(field.name) for field in fields(Chirp)]
    numbers = [value for value in law if isinstance(value, int | float) and not isinstance(value, bool)]
    if len(numbers) < len(law):
        return None  # a sweep without its law is looked for in the inputs
    chirp = Chirp(int(numbers[0]), *map(float, numbers[1:]))
    start, stop = float(event.details["start"]), float(event.details.get("seen", event.details["stop"]))
    # Faster than half the rate the chirp is folded: it would be the reference of other frequencies.
    inside = (time >= start) & (time <= stop) & (chirp.frequency(time - start) < _FOLDED / float(time[1] - time[0]))
    if inside.sum() * float(time[1] - time[0]) < 2.0 / chirp.start_hz:
        return None
    own = time[inside] - start
    frequency = chirp.frequency(own)
    phase = 2.0 * np.pi * np.cumsum(frequency) * float(time[1] - time[0])
    added = np.zeros(time.size)
    added[inside] = chirp.signal(own)
    return _Found(k, Course(inside, phase, lawful=True), added, (float(frequency[0]), float(frequency[-1])))
