"""Errors some time ahead as a criterion: what a model is for when it is to predict or to design a controller.

Maximum likelihood weighs one-step errors, in which a model that is wrong a little everywhere may win by what matters
least a second later. Here predictions start from the filter's states every so often, run on the recorded inputs with
nothing measured, and are compared after each of some horizons (multi-step prediction errors: Farina and Piroddi 2010;
direct and iterated predictions of a wrong model: Findley 1983). Noise, gains and start states stay as the likelihood
found them; parameters and the records' constants move. What the likelihood knows of them stands beside the errors as a
prior, with its corrected covariance: the errors move what one step hardly tells, and leave the rest.

The recorded inputs of a flight under feedback answer the gusts that the prediction cannot know, so that long horizons
lean towards output error with its bias: see docs/explanation/flights-under-feedback.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.core import accuracy, robust
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.records import Record

Places = NDArray[np.intp]
"""Of entries in a row."""

_MOVED = ("parameter", "nuisance")
"""Groups of entries that the criterion moves."""

TWICE = 2.0
"""By what the covariance is multiplied where the likelihood and the errors ahead tell the same records: as if the two
erred together, (a + b)^2 <= 2 a^2 + 2 b^2."""

_MEMORY = 2.0
"""Longest horizons over which the errors of overlapping predictions are taken to be correlated."""


@dataclass(frozen=True)
class Horizon:
    """How far ahead errors count: after `first`, 2 `first`, ... seconds, up to `last`; a start every `first`."""

    first: float
    last: float

    @classmethod
    def of(cls, given: Sequence[float]) -> Horizon:
        """From one or two numbers [s].

        Raises:
            IdentificationError: where they are not (FIRST,) or (FIRST, LAST) with 0 < FIRST <= LAST.
        """
        numbers = [float(value) for value in given]
        if len(numbers) not in (1, 2) or not all(np.isfinite(numbers)) or not 0.0 < numbers[0] <= numbers[-1]:
            raise IdentificationError(
                f"is {', '.join(f'{n:g}' for n in numbers) or 'empty'}, expected FIRST,LAST in seconds, "
                "0 < FIRST <= LAST, or one number.",
                channel="horizon",
                hint="For example 0.25,1.",
            )
        return cls(numbers[0], numbers[-1])

    def samples(self, dt: float) -> tuple[int, ...]:
        """The horizons in samples, ascending."""
        every = max(1, round(self.first / dt))
        return tuple(range(every, max(every, round(self.last / dt)) + 1, every))


@dataclass(frozen=True)
class Ahead:
    """Predictions to make: from the samples `starts` of each record, errors after `steps` samples."""

    starts: tuple[tuple[int, ...], ...]
    steps: tuple[int, ...]


class PredictsAhead(Protocol):
    """A likelihood whose filter can run ahead of its record."""

    @property
    def row(self) -> Row: ...

    def errors_ahead(self, row: Array, ahead: Ahead) -> list[Array]:
        """Per record, measured less predicted, (starts, horizons, outputs)."""
        ...

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """The same, and the slopes by some entries of the scaled row, (places, starts, horizons, outputs)."""
        ...


class MultiStepErrors:
    """The criterion: half the sum of squares (Huber's beyond 4 sigmas) of errors ahead over their size at the start.

    Every error is divided by its channel's root mean square at that horizon where the search begins, and all weighed so
    that predictions which do not overlap count as one each.

    Args:
        base: the likelihood, whose filter it is.
        row: where the likelihood has its optimum.
        pieces: its records.
        horizon: how far ahead.
        settling: seconds at the start of every record that are left out.
        known: corrected covariance (p, p) of the likelihood's scaled row at its optimum, priors included; None: the
            errors ahead and the priors alone.

    Raises:
        IdentificationError: where no record is long enough, or predictions diverge where the search begins.
    """

    def __init__(
        self,
        base: PredictsAhead,
        row: Array,
        pieces: Sequence[Record],
        *,
        horizon: Horizon,
        settling: float = 0.0,
        known: Array | None = None,
    ) -> None:
        dt = pieces[0].dt
        steps = horizon.samples(dt)
        first = round(settling / dt)
        starts = tuple(
            tuple(
                start
                for counts in (piece.counts,)
                for start in range(first, piece.time.size - steps[-1], steps[0])
                if counts[start : start + steps[-1] + 1].all()
            )
            for piece in pieces
        )
        self.horizon, self.ahead, self._base, self._found = horizon, Ahead(starts, steps), base, np.array(row)
        if not any(starts):
            longest = max(piece.time[-1] - piece.time[0] for piece in pieces)
            raise IdentificationError(
                f"the longest record has {longest:.1f} s, expected more than {settling:g} s to settle and "
                f"{horizon.last:g} s ahead.",
                channel="horizon",
                hint="Choose a shorter horizon.",
            )
        self._places = np.flatnonzero([entry.group in _MOVED for entry in base.row.entries])
        at = {int(place): i for i, place in enumerate(self._places)}
        self.row = Row(
            tuple(base.row.entries[place] for place in self._places),
            tuple((at[i], at[j], c) for i, j, c in base.row.prior_correlations if i in at and j in at),
        )
        square = np.ix_(self._places, self._places)
        self.known = np.zeros((len(self.row), len(self.row)))
        if known is not None:
            prior = base.row.prior(self._found)[2]
            self.known = accuracy.information_beyond(known[square], prior[square])
        errors = np.concatenate(base.errors_ahead(self._found, self.ahead))
        wild = np.asarray(~np.isfinite(errors).all(axis=(1, 2)))
        if wild.any():
            raise IdentificationError(
                f"{int(wild.sum())} of {len(wild)} predictions up to {horizon.last:g} s ahead diverge with what "
                "maximum likelihood found.",
                where=pieces[0].name,
                channel="horizon",
                hint="Choose a shorter horizon.",
            )
        size = np.sqrt(np.mean(errors**2, axis=0))
        if not np.all(size > 0.0):
            raise IdentificationError("a channel never errs: there is nothing to fit.", channel="horizon")
        share = steps[0] / steps[-1]  # of a start among those that overlap it
        self._scale = np.sqrt(share) / size
        self._share = share
        self._last: tuple[Array, tuple[list[Array], list[Array]]] | None = None

    @property
    def start(self) -> Array:
        """Where the search begins."""
        return np.asarray(self._found[self._places])

    def whole_row(self, row: Array) -> Array:
        """The likelihood's row with what the criterion moved."""
        full = self._found.copy()
        full[self._places] = row
        return full

    @property
    def lags(self) -> int:
        """Starts over which errors are correlated, for the bounds."""
        return max(1, round(_MEMORY * len(self.ahead.steps)))

    def refresh(self, row: Array) -> None:
        """Nothing is held between iterations: the errors' sizes are those where the search began."""

    def cost(self, row: Array) -> float:
        with np.errstate(over="ignore", invalid="ignore"):
            errors = np.concatenate(self._base.errors_ahead(self.whole_row(row), self.ahead))
        return self._cost(errors) + self._apart(row)[0] if np.isfinite(errors).all() else float("inf")

    def _apart(self, row: Array) -> tuple[float, Array]:
        """Cost and gradient of how far the row is from what the likelihood found."""
        away = row - self.start
        pull = self.known @ away
        return 0.5 * float(away @ pull), pull

    def _cost(self, errors: Array) -> float:
        # Huber's knee is in sizes of an error, not of its share.
        return self._share * robust.huber(errors * self._scale / np.sqrt(self._share))

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        errors, slopes = (np.concatenate(part, axis=k) for k, part in enumerate(self._errors_and_slopes(row)))
        if not (np.isfinite(errors).all() and np.isfinite(slopes).all()):
            p = len(self.row)
            return float("inf"), np.zeros(p), np.zeros((p, p))
        white = errors * self._scale
        weight = robust.weights(white / np.sqrt(self._share)).ravel()
        flat = (slopes * self._scale).reshape(len(slopes), -1)
        weighted = flat * weight
        apart, pull = self._apart(row)
        return self._cost(errors) + apart, weighted @ white.ravel() + pull, weighted @ flat.T + self.known

    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record: whitened errors (starts, horizons x outputs) and sensitivities (p, ...); what is known beside."""
        errors, slopes = self._errors_and_slopes(row)
        kept = [i for i, part in enumerate(errors) if len(part)]
        white = [(errors[i] * self._scale).reshape(len(errors[i]), -1) for i in kept]
        scaled = [(slopes[i] * self._scale).reshape(*slopes[i].shape[:2], -1) for i in kept]
        return white, scaled, self.known

    def _errors_and_slopes(self, row: Array) -> tuple[list[Array], list[Array]]:
        """Those of the last row are kept, which a search ends with and its judges ask for."""
        if self._last is None or not np.array_equal(self._last[0], row):
            with np.errstate(over="ignore", invalid="ignore"):
                parts = self._base.errors_ahead_moved(self.whole_row(row), self.ahead, self._places)
            self._last = np.array(row), parts
        return self._last[1]


def told_horizon(horizon: Horizon | None) -> dict[str, list[float]]:
    """What a result's settings say of the horizon, nothing where there is none."""
    return {} if horizon is None else {"horizon": [horizon.first, horizon.last]}
