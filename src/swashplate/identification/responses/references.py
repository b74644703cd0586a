"""Which part of a reference belongs to which sweep: one signal that sweeps axis after axis is a reference for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.identification.responses.spectra import Signals


def sweeps_of(flights: Sequence[Flight]) -> list[NDArray[np.int64]]:
    """For every unbroken piece of the flights, which sweep each sample belongs to (-1 for none), shape (n,) each.

    By axis, where all logs tell of their sweeps and more than one axis was swept; else every flight is one sweep (one
    log per swept axis).
    """
    told = [[event.details for event in flight.provenance.events if event.kind == "sweep"] for flight in flights]
    seen = [
        [d for d in one if "axis" in d and float(d["start"]) < flight.stop and float(d["stop"]) > flight.start]
        for one, flight in zip(told, flights, strict=True)
    ]
    axes = sorted({int(d["axis"]) for one in seen for d in one})
    labels = []
    for number, (flight, sweeps) in enumerate(zip(flights, seen, strict=True)):
        for piece in flight.split():
            time = piece.time(piece.channels[0])
            own = np.full(time.size, number, dtype=np.int64)
            if all(seen) and len(axes) > 1:
                own[:] = -1
                for d in sweeps:
                    own[(time >= float(d["start"])) & (time <= float(d["stop"]))] = axes.index(int(d["axis"]))
            labels.append(own)
    return labels


def reference_columns(
    sweep: Sequence[NDArray[np.int64]], pieces: Sequence[Signals], first: int, count: int, inputs: tuple[str, ...]
) -> list[Array]:
    """The references of each piece; a single one is split by sweep where that gives one per input.

    Args:
        sweep: from `sweeps_of`, for these pieces.
        pieces: records; the references begin at column `first`, and are `count`.
        inputs: names.

    Raises:
        FlightError: fewer references than inputs.
    """
    columns = [piece.values[:, first : first + count] for piece in pieces]
    flown = np.array(sorted({int(k) for labels in sweep for k in np.unique(labels) if k >= 0}))
    if count == 1 and len(inputs) > 1 and flown.size >= len(inputs):
        columns = [column * (labels[:, None] == flown) for column, labels in zip(columns, sweep, strict=True)]
    if columns[0].shape[1] < len(inputs):
        raise FlightError(
            f"{columns[0].shape[1]} reference(s) cannot tell {len(inputs)} inputs apart: {max(flown.size, 1)} sweep(s) "
            "found.",
            channel=", ".join(inputs),
            hint="Give as many independent references as inputs, or sweeps of each axis, one after the other or in "
            "logs of their own.",
        )
    return columns
