"""What a filter's code is asked for, whatever runs it: rows of numbers in, rows of numbers out."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array


class RecordSeries(NamedTuple):
    """Of a record by sample: readings (n, outputs), commands as they arrive (n, inputs) and voltage (n,)."""

    readings: Array
    commands: Array
    voltage: Array


class Fixed(NamedTuple):
    """What a run has beside its series, or directions in which that moves (count, ...).

    Attributes:
        start: joined state at the first sample. given: gain, nuisance and what lasts (`filter_c`). numbers: of the
            equations, with the constant surroundings.
    """

    start: Array
    given: Array
    numbers: Array


class Pushed(NamedTuple):
    """Commands and air (rows, inputs + 4) and added accelerations (rows, 6); or their directions (count, rows, ...)."""

    driving: Array
    push: Array


class FilterCode(Protocol):
    """A model's filter as it runs here: by C or by NumPy, the same numbers to rounding."""

    compiled_by: str

    def along(self, dt: float, fixed: Fixed, series: RecordSeries) -> tuple[Array, Array, Array]:
        """Innovations (n, outputs), states after each reading (n, joined), and what `moved` asks for."""
        ...

    def moved(
        self,
        dt: float,
        fixed: Fixed,
        series: RecordSeries,
        went: Array,
        directions: Fixed,
        late: tuple[int, Array],
        marks: NDArray[np.intp],
    ) -> tuple[Array, Array]:
        """Slopes of innovations (count, n, outputs), and of the states after some readings (count, marks, joined).

        `late` tells the first of the directions that move commands, and how they do (directions, n, inputs).
        """
        ...

    def step(self, dt: float, x: Array, pushed: Pushed, numbers: Array) -> Array:
        """States (rows, states) one sample later; numbers of all rows, or of each (rows, numbers)."""
        ...

    def step_moved(
        self, dt: float, x: Array, pushed: Pushed, numbers: Array, directions: tuple[Array, Pushed, Array]
    ) -> tuple[Array, Array]:
        """The same, and slopes (count, rows, states) along directions of the states, of what pushes and of the numbers
        (count, numbers)."""
        ...

    def rates(self, x: Array, w: Array, p: Array) -> Array:
        """Rates (..., n) of states under what drives them and numbers, with any axes in front."""
        ...

    def rates_and_slopes(self, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
        """Rates (..., n), slopes by the state (..., n, n) and by what drives it (..., n, driving)."""
        ...
