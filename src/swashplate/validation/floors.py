"""What a score stands beside: its scatter, how far the flight moved, what the filter expected, what others reach.

Fit % is one minus error over movement. A poor one may be the model's fault or the flight's, and the number alone does
not tell which.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.schema import channel as known
from swashplate.identification.core.records import POSE, Record
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation import block_bootstrap
from swashplate.validation.black_box import LEAK, Ceiling, FilteredMotion, ceiling

NAN = float("nan")
_LOW = 50.0
"""Percent below which a ceiling means that the flight tells little: no model can be called good on it."""

_CLOSE = 5.0
"""Points of fit that are no difference worth a word."""


_ANSWERS = "where a controller's commands answer the motion, that may beat even a correct model"
"""A true model of a quadrotor, flown in gusts by its autopilot, loses to it by hundreds of points in the simulation of
`research/multirotor.md`."""


@dataclass(frozen=True)
class Floor:
    """One channel at one horizon, with all that its fit % must be read with.

    Attributes:
        channel, unit: which. horizon: seconds ahead; infinite for a model that is flown along the inputs.
        fit, low, high: the model's fit [%] and its 95 % interval (block bootstrap; NaN with fewer than three blocks).
        rms: of its error [unit]. moved: rms of what the flight moved over the horizon [unit], the excitation.
        rival: the best predictor but the model; lead, lead_low, lead_high: points by which the model is ahead of it,
            from the same blocks.
        expected: fit [%] that the filter's own covariance promises (NaN where there is none).
        ceiling: fit [%] of the black box (NaN where it is refused); by: what it learnt from.
        gap_low, gap_high: interval of the points from the model up to the ceiling, from the same blocks.
        leak: share of the black box's error [%] that inputs after the target take away.
        seen: fit [%] of the black box whether it was refused or not; past: without the inputs after the start, which
            cannot leak.
        refused: why there is no ceiling, in words; empty where there is one.
        blocks: blocks that the starts span (`block_bootstrap.block_of`).
    """

    channel: str
    unit: str
    horizon: float
    fit: float
    low: float
    high: float
    rms: float
    moved: float
    rival: str
    lead: float
    lead_low: float
    lead_high: float
    expected: float
    ceiling: float
    by: str
    gap_low: float
    gap_high: float
    leak: float
    seen: float
    past: float
    refused: str
    blocks: float

    @property
    def reached(self) -> bool:
        """Whether the ceiling is told and the model is as good as it."""
        near = self.ceiling - self.fit <= _CLOSE or (math.isfinite(self.gap_low) and self.gap_low <= 0.0)
        return math.isfinite(self.ceiling) and near

    @property
    def scatter(self) -> str:
        """The interval of the fit in words; empty where there is none."""
        return f"{_percent(self.low)} to {_percent(self.high)} %, " if math.isfinite(self.low) else ""

    @property
    def summary_text(self) -> str:
        """Whether the model or the flight is poor."""
        unit = known(self.channel)
        change, factor = f"{self.moved * unit.shown_factor:.2g}", unit.shown_factor
        promise = f"; the filter expects a fit of {_percent(self.expected)} %" if math.isfinite(self.expected) else ""
        moves = f"in that time the flight changes by {change} {unit.shown_unit} (rms){promise}"
        if not math.isfinite(self.ceiling):
            return f"{moves}. {self._without_ceiling}No ceiling: {self.refused}."
        if self.fit - self.ceiling > _CLOSE:
            return f"{moves}. The model is better than the regression that is the ceiling ({_percent(self.ceiling)} %)."
        if self.reached and self.ceiling < _LOW:
            unforeseen = self.moved * (1.0 - self.ceiling / 100.0) * factor
            return (
                f"{moves}. Of the change, {unforeseen:.2g} {unit.shown_unit} cannot be predicted from what was "
                f"recorded: even the ceiling is a fit of {_percent(self.ceiling)} %."
            )
        if self.reached:
            return f"{moves}. The model is as good as the ceiling ({_percent(self.ceiling)} %)."
        return f"{moves}. The ceiling is {_percent(self.ceiling)} %: a better model is possible."

    @property
    def _without_ceiling(self) -> str:
        if not math.isfinite(self.seen):
            return ""
        if math.isfinite(self.past) and self.past - self.fit > _CLOSE:
            if self.leak > LEAK:
                return f"The past alone has a fit of {_percent(self.past)} %; {_ANSWERS}. "
            return f"The model is poor: the past alone has a fit of {_percent(self.past)} %. "
        if self.seen - self.fit <= _CLOSE:
            return f"Even a regression that also reads the controller's later answers has {_percent(self.seen)} %. "
        alone = f"The past alone has a fit of {_percent(self.past)} %; a" if math.isfinite(self.past) else "A"
        return f"{alone} regression that also reads the controller's later answers has {_percent(self.seen)} %. "


def _shown(floor: Floor, value: float) -> str:
    return "-" if not math.isfinite(value) else f"{value * known(floor.channel).shown_factor:.3g}"


def _percent(value: float) -> str:
    return "-" if not math.isfinite(value) else f"{value:.0f}" if abs(value) < 1000.0 else "<-999"


ROWS: tuple[tuple[str, Callable[[Floor], str]], ...] = (
    ("model, 95 % from", lambda f: _percent(f.low)),
    ("to", lambda f: _percent(f.high)),
    ("filter expects", lambda f: _percent(f.expected)),
    ("past alone", lambda f: _percent(f.past)),
    ("ceiling", lambda f: _percent(f.ceiling) if math.isfinite(f.ceiling) else "refused"),
    ("error, rms", lambda f: _shown(f, f.rms)),
    ("movement, rms", lambda f: _shown(f, f.moved)),
    ("unit", lambda f: known(f.channel).shown_unit),
)
"""What stands beside the scores, by row: words, and the cell of a channel."""


def _signed(value: float) -> str:
    return "-" if not math.isfinite(value) else f"{value:+.0f}" if abs(value) < 1000.0 else "<-999"


CLOSED_ROWS: tuple[tuple[str, Callable[[Floor], str]], ...] = (
    ("on recorded inputs", lambda f: _percent(f.fit - f.lead)),
    ("loop closed", lambda f: _percent(f.fit)),
    ("95 % from", lambda f: _percent(f.low)),
    ("to", lambda f: _percent(f.high)),
    ("gain", lambda f: _signed(f.lead)),
    ("95 % from", lambda f: _signed(f.lead_low)),
    ("to", lambda f: _signed(f.lead_high)),
)
"""What is told of fits with loops closed, the same way [%]."""


def floors(
    channels: Sequence[str],
    horizon: float,
    times: Sequence[Array],
    squares: Mapping[str, Sequence[Array]],
    moved: Mapping[str, Sequence[Array]],
    *,
    expected: Array,
    ceilings: Sequence[Ceiling],
) -> tuple[Floor, ...]:
    """The floors of all channels at one horizon.

    Args:
        channels: names of the columns. horizon: seconds ahead. times: start times [s] by record.
        squares: squared errors by predictor and record (s, channels); the first predictor is the model. A channel that
            the schema does not know has no unit here.
        moved: squared changes since the start, the same way.
        expected: standard deviation of the prediction that the filter promises, by channel [unit]; NaN for none.
        ceilings: candidates; by channel the best of those that pass the leak test counts.
    """
    names = list(squares)
    boxes = [box for box in ceilings if box.squares]
    stacked = [
        np.stack(
            [part for name in names for part in (squares[name][r], moved[name][r])]
            + [part for box in boxes for part in (box.squares[r], box.past[r] if box.past else _none(box.squares[r]))],
            axis=1,
        )
        for r in range(len(times))
    ]
    sums, draws = np.concatenate(stacked).sum(axis=0), block_bootstrap.drawn(times, stacked, horizon=horizon)
    count = sum(t.size for t in times)
    fits = {name: _fit(sums[2 * i], sums[2 * i + 1]) for i, name in enumerate(names)}
    drawn = {
        name: None if draws is None else _fit(draws[:, 2 * i], draws[:, 2 * i + 1]) for i, name in enumerate(names)
    }
    of_boxes = [_fit(sums[2 * (len(names) + i)], sums[1]) for i in range(len(boxes))]
    of_past = [_fit(sums[2 * (len(names) + i) + 1], sums[1]) for i in range(len(boxes))]
    rows = []
    for c, name in enumerate(channels):

        def differing(ahead: Array | None, behind: Array | None, c: int = c) -> tuple[float, float]:
            return block_bootstrap.interval(None if ahead is None or behind is None else ahead[:, c] - behind[:, c])

        of_model = drawn[names[0]]
        low, high = block_bootstrap.interval(None if of_model is None else of_model[:, c])
        rival = max(names[1:], key=lambda n: fits[n][c]) if len(names) > 1 else ""
        lead_low, lead_high = differing(of_model, drawn[rival]) if rival else (NAN, NAN)
        leaks = [float(box.leak[c]) if box.leak is not None else NAN for box in boxes]
        passing = [i for i, leak in enumerate(leaks) if leak <= LEAK and sums[1, c] > 0.0]
        best = max(passing or range(len(boxes)), key=lambda i: of_boxes[i][c], default=None)
        has_ceiling = best is not None and best in passing
        gap = (NAN, NAN)
        if has_ceiling and draws is not None and best is not None:
            gap = differing(_fit(draws[:, 2 * (len(names) + best)], draws[:, 1]), of_model)
        size = math.sqrt(sums[1, c] / max(count, 1))
        rows.append(
            Floor(
                channel=name,
                unit=known(name).unit,
                horizon=horizon,
                fit=float(fits[names[0]][c]),
                low=low,
                high=high,
                rms=math.sqrt(sums[0, c] / max(count, 1)),
                moved=size,
                rival=rival,
                lead=float(fits[names[0]][c] - fits[rival][c]) if rival else NAN,
                lead_low=lead_low,
                lead_high=lead_high,
                expected=float(100.0 * (1.0 - expected[c] / size)) if size > 0.0 else NAN,
                ceiling=float(of_boxes[best][c]) if has_ceiling and best is not None else NAN,
                by=boxes[best].how if best is not None else "",
                gap_low=gap[0],
                gap_high=gap[1],
                leak=leaks[best] if best is not None else NAN,
                seen=float(of_boxes[best][c]) if best is not None else NAN,
                past=max((float(fit[c]) for fit in of_past), default=NAN),
                refused="" if has_ceiling else _refused(ceilings, leaks, best),
                blocks=block_bootstrap.blocks_of(times, horizon),
            )
        )
    return tuple(rows)


def _none(like: Array) -> Array:
    return np.full_like(like, NAN)


def _fit(squares: Array, movement: Array) -> Array:
    return np.asarray(100.0 * (1.0 - np.sqrt(squares / np.maximum(movement, 1e-300))))


def _refused(ceilings: Sequence[Ceiling], leaks: Sequence[float], best: int | None) -> str:
    if best is None:
        return "; ".join(dict.fromkeys(box.refused for box in ceilings)) or "none was asked for"
    return f"inputs after the target take {leaks[best]:.0f} % of its error away, so they answer the motion"


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
