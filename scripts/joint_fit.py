"""Aircraft and controller fitted in turn: what errors ahead in closed loop make of the yaw damping, and of predictions.

    python scripts/joint_fit.py august|july AXES

The law of each of the AXES (yaw, or yaw,heave) is found by regression on the whole training flight, as `close_loop`
finds it, and held while the errors ahead are made small with the command answering what is predicted. Then the other
flight is predicted, as on the page of the real flights. Half a minute; the numbers are in docs/decisions/0138.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from typing import Any

import jax
import numpy as np
from real_flights import CHOICE, CLOSED, FLIGHTS, HORIZON

import swashplate as sp
from swashplate.arrays import Array, lengthened
from swashplate.filtering.arriving_commands import commands_moved
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.multi_step import Ahead, MultiStepErrors, Places
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.records import Record
from swashplate.identification.time import identify
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.validation.closed_loop import closed_ahead
from swashplate.validation.controller_law import Law, learnt

STEP = 1e-3
"""Of a scaled entry, for slopes by differences."""


class ClosedLoopErrors:
    """The errors ahead of a likelihood's filter with loops closed, laws held at what the first row tells."""

    def __init__(self, base: PredictionError, axes: Sequence[str]) -> None:
        self.base, self.axes = base, axes
        self.laws: list[tuple[Law, ...]] = []
        measure = partial(base.model.measure)
        every = jax.vmap(jax.vmap(lambda x, n: measure(x, Nuisance(*n)), (0, None)), (0, None))
        self._measured = jax.jit(every)

    @property
    def row(self) -> Row:
        return self.base.row

    def errors_ahead(self, row: Array, ahead: Ahead) -> list[Array]:
        vehicle, runs, by_piece = self.base.table.vehicle, self.base.runs(row), []
        kept = [vehicle.index(name) for name in PREDICTED]
        if not self.laws:
            for piece, run in zip(self.base.pieces, runs, strict=True):
                span = float(piece.time[-1] - piece.time[0])
                self.laws.append(learnt(vehicle, piece, run.states.x[:, kept], axes=self.axes, seconds=span))
        for piece, run, laws, starts in zip(self.base.pieces, runs, self.laws, ahead.starts, strict=True):
            places, steps, last = np.array(starts, dtype=np.intp), np.array(ahead.steps), max(ahead.steps)
            if not places.size:
                by_piece.append(np.zeros((0, steps.size, piece.outputs.shape[1])))
                continue
            inputs, voltage = (lengthened(rows, piece.time.size + last) for rows in (piece.inputs, piece.voltage))
            reaching, _ = commands_moved(vehicle, piece.dt, inputs, Nuisance(*run.numbers.nuisance), np)
            model, numbers = self.base.model, run.numbers
            states = closed_ahead(
                model, run.states, numbers, laws, piece.inputs, reaching, voltage, places, last
            )  # (starts, samples, states)
            seen = np.asarray(self._measured(states[:, steps - 1], numbers.nuisance))
            by_piece.append(piece.outputs[places[:, None] + steps] - seen)
        return by_piece

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        here, moved = self.errors_ahead(row, ahead), []
        for step in STEP * np.eye(len(row))[places]:
            aside = zip(self.errors_ahead(row + step, ahead), self.errors_ahead(row - step, ahead), strict=True)
            moved.append([(after - before) / (2.0 * STEP) for after, before in aside])
        return here, [np.stack(parts) for parts in zip(*moved, strict=True)]


def main(flight: str, axes: str) -> int:
    other = next(name for name in FLIGHTS if name != flight)
    flights = {name: sp.read(where).condition(rate=100.0, cutoff=0.0) for name, where in FLIGHTS.items()}
    bases = []

    def closed(base: PredictionError, row: Array, pieces: Sequence[Record], **how: Any) -> MultiStepErrors:
        bases.append(ClosedLoopErrors(base, axes.split(",")))
        return MultiStepErrors(bases[-1], row, pieces, **how)

    plain = identify.MultiStepErrors
    for name, criterion in (("recorded commands", plain), ("loops closed", closed)):
        identify.MultiStepErrors = criterion  # type: ignore[assignment,misc]
        fit = sp.identify(sp.vehicle("coax"), flights[flight], free=CHOICE, horizon=HORIZON, keep_unexcited=True)
        damping = next(e for e in fit.estimates if e.name == "damping_r")
        print(f"{name}: damping_r {damping.value:.2g} +- {damping.sigma_corrected:.2g} N m s")
        print(sp.validate(fit, flights[other], close_loop=CLOSED, horizons=(0.5, 1.0)))
    print("\n".join(law.words for base in bases for laws in base.laws for law in laws))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
