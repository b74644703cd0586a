"""The floors of predictions from many start points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core.records import POSE, Record
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation.black_box import MotionRecord, ceiling
from swashplate.validation.floors import Floor, floors

_PLACE = [PREDICTED.index(name) for name in ("x", "y")]
_FEWEST = 2  # starts of a record below which nothing is told of it


class ScoredRecord(NamedTuple):
    """A record with its starts at one horizon, and the standard deviations (12,) that the filter promises there."""

    name: str
    motion: MotionRecord
    promised: Array


def motion_of(record: Record, truth: Array, starts: NDArray[np.intp]) -> MotionRecord:
    """A record as the black box sees it.

    Args:
        record: with a tracked pose among its outputs. truth: body states (n, 12). starts: sample indices (s,).
    """
    columns = [record.output_names.index(name) for name in POSE]
    return MotionRecord(record.time, record.inputs, record.outputs[:, columns], truth, starts)


def flight_floors(
    scored: Mapping[float, Sequence[ScoredRecord]],
    parts: Mapping[tuple[str, float], Sequence[tuple[Array, Array, Array]]],
    *,
    training: Sequence[MotionRecord] = (),
) -> tuple[Floor, ...]:
    """What the scores stand beside, by horizon and channel.

    Args:
        scored: the records by horizon [s].
        parts: predicted, true and starting states (s, 12) of each record by predictor and horizon, in the same order;
            the model comes first.
        training: the records of the fit.
    """
    made: list[Floor] = []
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
        made += floors(
            PREDICTED,
            horizon,
            [motion.time[motion.starts] for motion in motions],
            {name: [(predicted - truth) ** 2 for predicted, truth, _ in rows] for name, rows in mine.items()},
            {name: [(truth - first) ** 2 for _, truth, first in rows] for name, rows in mine.items()},
            expected=np.sqrt(promised),
            ceilings=boxes,
        )
    return tuple(made)
