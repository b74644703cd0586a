"""What every reader asks of what it read: possible numbers, plausible quaternions, moving inputs; faults together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights.flight import Flight
from swashplate.flights.schema import channel
from swashplate.flights.stored_column import StoredColumn

_NORM_TOLERANCE = 0.01  # six decimals of a motion capture export lose 1e-6; anything near 1 % is no unit quaternion


def finite(values: Array, *, channel: str, where: str, first_row: int = 0) -> None:
    """Refuses numbers that are not finite, naming the first sample.

    Args:
        values: shape (n,) or (n, k).
        first_row: what the file calls its first sample.
    """
    bad = ~np.isfinite(values)
    rows = np.flatnonzero(bad if bad.ndim == 1 else bad.any(axis=1))
    if rows.size:
        raise FlightError(
            f"{rows.size} of {len(values)} samples are not finite numbers, first at sample {rows[0] + first_row}.",
            where=where,
            channel=channel,
            hint="Cut these samples out of the log, or export it again.",
        )


def quaternion_notes(quaternion: Array, *, channel: str, where: str) -> tuple[str, ...]:
    """Notes on sign flips and single bad norms of quaternions, shape (n, 4); refuses what is no attitude at all."""
    with np.errstate(over="ignore"):  # damaged numbers may be as large as they like: their norm is refused below
        error = np.abs(np.sqrt(np.sum(quaternion**2, axis=1)) - 1.0)
        products = np.sum(quaternion[1:] * quaternion[:-1], axis=1)
    if np.median(error) > _NORM_TOLERANCE:
        raise FlightError(
            f"the quaternion's norm is off 1 by {np.median(error):.3g} in the median: these are not attitudes.",
            where=where,
            channel=channel,
            hint="Check which columns hold the quaternion and in which order.",
        )
    notes = []
    off = int(np.sum(error > _NORM_TOLERANCE))
    if off:
        notes.append(f"{off} attitude quaternions have a norm off 1 by more than {_NORM_TOLERANCE:g}")
    flips = int(np.sum(products < 0.0))
    if flips:
        notes.append(f"the attitude quaternion flips its sign {flips} times, as logged (conditioning repairs it)")
    return tuple(notes)


_ROUNDED = 1.0 - 1e-6
"""Of a limit: below it no rounding matters."""


def beyond_limits(flight: Flight) -> tuple[str, ...]:
    """What is told of each channel with numbers that nothing of its kind can have (`Channel.largest`)."""
    texts = []
    for name in flight.channels:
        known = channel(name)
        stored = StoredColumn.behind(flight[name])
        if stored is not None and stored.largest < known.largest * _ROUNDED:
            continue
        values = np.abs(flight.values(name))
        with np.errstate(invalid="ignore"):  # a netCDF file may hold NaN
            wrong = values > known.largest
        if count := int(np.sum(wrong)):
            shown, unit = known.shown_factor, known.shown_unit.replace("1", "")
            texts.append(
                f"{name}: {count} of {values.size} samples ({100.0 * count / values.size:.3g} %) are impossible: found "
                f"up to {shown * np.nanmax(values):.3g} {unit}".rstrip()
                + f", expected {shown * known.largest:.3g} {unit}".rstrip()
                + f" at most ({known.description}). Check the unit it was read with, and the log's header"
            )
    return tuple(texts)


def constant_notes(channels: Mapping[str, Array]) -> tuple[str, ...]:
    """A note for each channel that never moves: no parameter can be learnt from an input like that."""
    return tuple(
        f"{name} never moves ({values[0]:.6g} throughout): nothing about it can be identified from this record"
        for name, values in channels.items()
        if len(values) > 1 and np.all(values == values[0])
    )


_MOST = 20
"""Faults that are listed; the rest is counted."""


class Faults:
    """Errors of one file, gathered until `refuse` is asked.

    Args:
        where: the file.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.errors: list[FlightError] = []

    @contextmanager
    def gathered(self) -> Iterator[None]:
        """Keeps a FlightError that is raised inside; what comes next goes on without what it was about."""
        try:
            yield
        except FlightError as error:
            self.errors.append(error)

    def add(self, error: FlightError) -> None:
        self.errors.append(error)

    def refuse(self, beside: Sequence[str] = ()) -> None:
        """Raises what was gathered: a single error as it is, several as one list.

        Args:
            beside: what else was found on the way, for the end of the message.

        Raises:
            FlightError: UnitError where units are all that is wrong.
        """
        if not self.errors:
            return
        also = [f"Beside that: {'; '.join(beside)}."] if beside else []
        kind = UnitError if all(isinstance(error, UnitError) for error in self.errors) else FlightError
        if len(self.errors) == 1:
            (only,) = self.errors
            raise kind(" ".join([only.problem, *also]), where=only.where, channel=only.channel, hint=only.hint)
        places = {error.where for error in self.errors}
        place = next(iter(places)) if len(places) == 1 else self.where
        heads = [
            ": ".join(part for part in (e.where if e.where != place else "", e.channel) if part) for e in self.errors
        ]
        faults = [
            f"({i}) {f'{head}: ' if head else ''}{e.problem}"
            for i, (head, e) in enumerate(zip(heads, self.errors, strict=True), 1)
        ]
        more = [f"and {len(faults) - _MOST} more."] if len(faults) > _MOST else []
        raise kind(
            " ".join([f"has {len(faults)} faults:", *faults[:_MOST], *more, *also]),
            where=place,
            hint=" ".join(dict.fromkeys(error.hint for error in self.errors if error.hint)) or None,
        )
