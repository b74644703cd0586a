"""What a filter's code is asked for, whatever runs it: rows of numbers in, rows of numbers out."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array


class RecordSeries(NamedTuple):
    """Of a record by sample: readings (n, outputs), and inputs as they arrive, wind and voltage (n, inputs + 4)."""

    readings: Array
    driving: Array


class Fixed(NamedTuple):
    """What a run has beside its series, or directions in which that moves (count, ...).

    Attributes:
        start: joined state at the first sample. given: gain, nuisance and what lasts (`filter_c`). numbers: of the
            equations, with the constant surroundings.
    """

    start: Array
    given: Array
    numbers: Array


class Along(NamedTuple):
    """Directions in which a run moves, which come first in every part.

    Attributes:
        fixed: of what it has beside its series.
        arriving: the first of the directions that move commands. commands: how they do (directions, n, inputs).
        marks: samples, ascending, whose states' slopes are wanted.
    """

    fixed: Fixed
    arriving: int
    commands: Array
    marks: NDArray[np.intp]


class Pushed(NamedTuple):
    """Commands and air (rows, inputs + 4) and added accelerations (rows, 6)."""

    driving: Array
    push: Array


class Onward(NamedTuple):
    """What predictions begin with and depend on, or directions in which that moves (count, ...).

    Attributes:
        states: joined, at their starts (rows, joined).
        fade: what is left of gusts after a sample (gusts,). numbers: of the equations (numbers,).
    """

    states: Array
    fade: Array
    numbers: Array


class Following(NamedTuple):
    """What filters whose gain follows begin with and depend on, by row.

    Attributes:
        states (rows, joined), covariances (rows, joined, joined): predicted for the first sample.
        nuisance: of the record (rows, numbers).
        fade: what is left of gusts after a sample (rows, gusts).
        white: variance of the accelerations' white noise, held over a sample (rows, 6).
        added: variance that a sample adds to gusts and drifts (rows, both).
        sensors: variances of the readings (rows, outputs). numbers: of the equations (rows, numbers).
    """

    states: Array
    covariances: Array
    nuisance: Array
    fade: Array
    white: Array
    added: Array
    sensors: Array
    numbers: Array


class Followed(NamedTuple):
    """Of some rows along a record: innovations (rows, n, outputs), their covariances, and the joined states after each
    reading (rows, n, joined)."""

    innovations: Array
    covariances: Array
    states: Array


class FilterCode(Protocol):
    """A model's filter as it runs here: by C or by NumPy, the same numbers to rounding."""

    compiled_by: str

    def along(self, dt: float, fixed: Fixed, series: RecordSeries) -> tuple[Array, Array, Array]:
        """Innovations (n, outputs), states after each reading (n, joined), and what `filter_slopes` asks for."""
        ...

    def filter_slopes(
        self, dt: float, fixed: Fixed, series: RecordSeries, went: Array, along: Along
    ) -> tuple[Array, Array]:
        """Slopes of innovations (count, n, outputs), and of the states after some readings (count, marks, joined)."""
        ...

    def step(self, dt: float, x: Array, pushed: Pushed, numbers: Array) -> Array:
        """States (rows, states) one sample later; numbers of all rows, or of each (rows, numbers)."""
        ...

    def ahead(
        self,
        dt: float,
        starts: NDArray[np.intp],
        onward: Onward,
        driving: Array,
        count: int,
        kicks: Array | None = None,
    ) -> Array:
        """States (rows, count, states) 1, 2, ... samples after some starts, with nothing measured any more.

        Args:
            starts: samples. onward: what they begin with.
            driving: by sample (n, inputs + 4), `count` of them beyond the last start.
            kicks: what is added to the joined states after every sample, nose north (rows, count, joined).
        """
        ...

    def ahead_moved(
        self,
        dt: float,
        starts: NDArray[np.intp],
        onward: Onward,
        driving: Array,
        steps: NDArray[np.intp],
        directions: tuple[Onward, int, Array],
    ) -> tuple[Array, Array]:
        """States after `steps` samples, ascending (rows, steps, states), and their slopes (count, rows, steps, states).

        Args:
            starts, onward, driving: as of `ahead`.
            directions: of `onward`, and as in `Along` the first that moves commands and how they do.
        """
        ...

    def rates(self, x: Array, w: Array, p: Array) -> Array:
        """Rates (..., n) of states under what drives them and numbers, with any axes in front."""
        ...

    def rates_and_slopes(self, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
        """Rates (..., n), slopes by the state (..., n, n) and by what drives it (..., n, driving)."""
        ...

    def follow(self, dt: float, begin: Following, series: RecordSeries) -> Followed:
        """Filters whose gain follows, for models with a wind: readings that are no number tell nothing; what
        drives is told by row (n, rows, inputs + 4)."""
        ...


def driving_rows(commands: Array, voltage: Array) -> Array:
    """What drives in calm air: commands (n, ..., inputs) and the voltage (n,) side by side (n, ..., inputs + 4)."""
    front = commands.shape[:-1]
    volts = np.broadcast_to(voltage.reshape(-1, *(1,) * (len(front) - 1)), front)
    return np.concatenate([commands, np.zeros((*front, 3)), volts[..., None]], axis=-1)
