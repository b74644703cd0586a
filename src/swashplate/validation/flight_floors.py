"""The floors of predictions from many start points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core.records import POSE, Record
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation.black_box import FilteredMotion, ceiling
from swashplate.validation.floors import Floor, floors

_PLACE = [PREDICTED.index(name) for name in ("x", "y")]
_FEWEST = 2  # starts of a record below which nothing is told of it


class ScoredRecord(NamedTuple):
    """A record with its starts at one horizon, and the standard deviations (12,) that the filter promises there."""

    name: str
    motion: FilteredMotion
    promised: Array


class ClosedRecord(NamedTuple):
    """A record at one horizon, from starts at `time` [s] (s,): states (s, 12) predicted with loops closed and on the
    recorded inputs, those that came, and those at the start."""

    time: Array
    closed: Array
    recorded: Array
    truth: Array
    first: Array


LOOP_CLOSED = "loop closed"


def closed_floors(by_horizon: Mapping[float, Sequence[ClosedRecord]]) -> tuple[Floor, ...]:
    """Fits with loops closed, and by how much they lead those on the recorded inputs (same blocks for both)."""
    rows: list[Floor] = []
    for horizon, records in by_horizon.items():
        movement = [(r.truth - r.first) ** 2 for r in records]
        squares = {
            LOOP_CLOSED: [(r.closed - r.truth) ** 2 for r in records],
            "model": [(r.recorded - r.truth) ** 2 for r in records],
        }
        nothing = np.full(len(PREDICTED), np.nan)
        rows += floors(
            PREDICTED,
            horizon,
            [r.time for r in records],
            squares,
            dict.fromkeys(squares, movement),
            expected=nothing,
            ceilings=(),
        )
    return tuple(rows)


def motion_of(record: Record, truth: Array, starts: NDArray[np.intp]) -> FilteredMotion:
    """A record as the black box sees it.

    Args:
        record: with a tracked pose among its outputs. truth: body states (n, 12). starts: sample indices (s,).
    """
    columns = [record.output_names.index(name) for name in POSE]
    return FilteredMotion(record.time, record.inputs, record.outputs[:, columns], truth, starts)


def flight_floors(
    scored: Mapping[float, Sequence[ScoredRecord]],
    parts: Mapping[tuple[str, float], Sequence[tuple[Array, Array, Array]]],
    *,
    training: Sequence[FilteredMotion] = (),
) -> tuple[Floor, ...]:
    """What the scores stand beside, by horizon and channel.

    Args:
        scored: the records by horizon [s].
        parts: predicted, true and starting states (s, 12) of each record by predictor and horizon, in the same order;
            the model comes first.
        training: the records of the fit.
    """
    floor_rows: list[Floor] = []
    for horizon, records in scored.items():
        kept = [i for i, record in enumerate(records) if record.motion.starts.size >= _FEWEST]
        if not kept:
            continue
        motions = [records[i].motion for i in kept]
        mine = {name: [rows[i] for i in kept] for (name, h), rows in parts.items() if h == horizon}
        counts = [motion.starts.size for motion in motions]
        promised = np.average([records[i].promised ** 2 for i in kept], axis=0, weights=counts)
        promised[_PLACE] = promised[_PLACE].mean()  # told for a nose that points north
        learnt = [m for m in training if abs(m.dt - motions[0].dt) < 1e-9]
        boxes = [ceiling(motions, horizon), *([ceiling(motions, horizon, training=learnt)] if learnt else [])]
        floor_rows += floors(
            PREDICTED,
            horizon,
            [motion.time[motion.starts] for motion in motions],
            {name: [(predicted - truth) ** 2 for predicted, truth, _ in rows] for name, rows in mine.items()},
            {name: [(truth - first) ** 2 for _, truth, first in rows] for name, rows in mine.items()},
            expected=np.sqrt(promised),
            ceilings=boxes,
        )
    return tuple(floor_rows)
