"""The likelihood of errors along records in time: one for every model, whatever its gain.

A model says what its errors are at a row of numbers, how large it expects them, and how both move (`errors_of`,
`moved_errors`). Cost, gradient, Fisher information and what bounds are made of follow here. Errors count by Huber's
loss and the covariance that goes with them: of a Kalman filter, along the flight where its gain follows, or the last
accepted row's. `OwnCovariance` is for models whose noise is not told apart: their covariance is that of the errors
themselves, and no outlier is weighed down.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core import robust
from swashplate.identification.core.missing_parts import MissingParts
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.records import Comparison, Record

NOTHING = np.array([], dtype=np.intp)
"""Places of no entries."""

_FIRST_GAIN = 0.3
_DIVERGED = 1e9
_EXACT = 1e-6

_GUST = 0.3
"""First guess: share of a state's size by which its rate is disturbed."""

SPREAD = 2.0
"""Of the prior on the logarithm of a gust's intensity: a factor of seven either way."""


@dataclass(frozen=True)
class Errors:
    """Errors of a record, or of a window of it, where samples count.

    Attributes:
        number: of the record or window; errors of several belong to one where they follow each other.
        errors: measured less foretold (n, outputs).
        factor: lower factor L of their covariance L L', (outputs, outputs), or by sample (n, outputs, outputs); not a
            number where there is none.
    """

    number: int
    errors: Array
    factor: Array

    @cached_property
    def inverse(self) -> Array:
        """L^-1."""
        return np.asarray(np.linalg.inv(self.factor), dtype=np.float64)

    def whitened(self, rows: Array) -> Array:
        """L^-1 times rows (..., n, outputs)."""
        inverse = self.inverse
        if inverse.ndim == 2:
            return np.asarray((rows.reshape(-1, len(inverse)) @ inverse.T).reshape(rows.shape))
        return np.asarray((inverse @ rows[..., None])[..., 0])

    @property
    def size(self) -> float:
        """Half the logarithm of the covariances' determinants."""
        logarithms = np.log(np.diagonal(self.factor, axis1=-2, axis2=-1))
        return float(logarithms.sum()) * (len(self.errors) if self.factor.ndim == 2 else 1)


@dataclass(frozen=True)
class MovedErrors(Errors):
    """The same, and how they move with some entries of the scaled row.

    Attributes:
        places: of these entries (m,).
        slopes: of the errors (m, n, outputs).
        turned: L^-1 dS L^-T for the covariance's slopes dS, (m, outputs, outputs), or by sample (m, n, outputs,
            outputs); None: the covariance is held.
        telling: of the slopes what makes a flight more or less likely (None: all), and the information (m, m) that
            lies in the covariance.
    """

    places: NDArray[np.intp]
    slopes: Array
    turned: Array | None = None
    telling: tuple[Array | None, Array] | None = None

    def information(self, weights: Array | None) -> tuple[Array, Array, Array]:
        """Information in the errors and in their covariance, (m, m) each, and whitened slopes (m, n, outputs)."""
        telling, beside = self.telling or (None, np.zeros((len(self.places), len(self.places))))
        white = self.whitened(self.slopes if telling is None else telling)
        flat = white.reshape(len(white), -1)
        flat = flat if weights is None else flat * np.sqrt(weights).ravel()
        return flat @ flat.T, beside, white


E = TypeVar("E", bound=Errors)


def factor_of(covariance: Array) -> Array:
    """The lower factor of covariances; not a number where there is none."""
    if np.isfinite(covariance).all():
        try:
            return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
        except np.linalg.LinAlgError:
            pass
    return np.full_like(covariance, np.nan)


def gain_entries(states: Sequence[str], size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
    """A free gain from every innovation to every state.

    Args:
        states: names. size, spread: sizes of the states and of the outputs.
    """
    return [
        Entry(f"gain {s}/{o}", "noise", _FIRST_GAIN * (s == o), 0.1 * size[s] / around)
        for s in states
        for o, around in spread.items()
    ]


def gust_entries(states: Sequence[str], size: Mapping[str, float]) -> list[Entry]:
    """What a Kalman gain is made of beside the sensors' noise: white noise on every state's rate, its logarithm."""
    first = {f"gust {s}": float(np.log(_GUST * size[s])) for s in states}
    return [Entry(name, "noise", log, 1.0, mean=log, sigma=SPREAD, logarithmic=True) for name, log in first.items()]


class Likelihood(ABC):
    """The negative log-likelihood of a row of numbers, priors not included.

    Attributes:
        row: what is sought.
        records: along which.
    """

    row: Row
    records: tuple[Record, ...]

    @abstractmethod
    def errors_of(self, row: Array) -> list[Errors]:
        """The errors of every record or window."""

    @abstractmethod
    def moved_errors(self, row: Array) -> Iterator[MovedErrors]:
        """The same, and how they move; of samples that follow each other, never of two records."""

    @abstractmethod
    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """Per record, measured less predicted from the filter's states (starts, horizons, outputs), and the slopes by
        some entries of the scaled row, (places, starts, horizons, outputs)."""

    @abstractmethod
    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        """Every record beside what the model foretells of it."""

    def errors_ahead(self, row: Array, ahead: Ahead) -> list[Array]:
        """Per record errors ahead alone."""
        return self.errors_ahead_moved(row, ahead, NOTHING)[0]

    def refresh(self, row: Array) -> None:
        """Take an accepted row for what is held during an iteration: here nothing."""
        del row

    def sized(self, row: Array) -> Array:
        """A scaled row with what the errors' covariance alone tells: here nothing."""
        return row

    # ---- how errors count --------------------------------------------------------------------------------------
    def _loss(self, white: Array) -> float:
        return robust.huber(white)

    def _weights(self, white: Array) -> Array | None:
        """Slope of the loss over the whitened error; None: one everywhere."""
        return robust.weights(white)

    def _expected(self, parts: Sequence[E]) -> Sequence[E]:
        """The errors with the covariance that a cost has."""
        return parts

    # ---- cost and scores ---------------------------------------------------------------------------------------
    def cost(self, row: Array) -> float:
        """Negative log-likelihood without constants; infinite where the model diverges."""
        with np.errstate(over="ignore", invalid="ignore"):
            parts = self.errors_of(row)
        return self.cost_of(parts)

    def cost_of(self, parts: Sequence[Errors]) -> float:
        """The cost of some errors."""
        if not all(np.isfinite(p.errors).all() and np.max(np.abs(p.errors), initial=0.0) < _DIVERGED for p in parts):
            return np.inf
        expected = self._expected(parts)
        if not all(np.isfinite(part.factor).all() for part in expected):
            return np.inf
        return sum(self._loss(part.whitened(part.errors)) + part.size for part in expected)

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        """Cost, gradient and Fisher information (the covariance's part included; Ljung 1999, sec. 9.4)."""
        p = len(self.row)
        gradient, information, every = np.zeros(p), np.zeros((p, p)), []
        with np.errstate(over="ignore", invalid="ignore"):
            for part in self._moved_here(row):
                every.append(Errors(part.number, part.errors, part.factor))
                if not (np.isfinite(part.errors).all() and np.isfinite(part.slopes).all()):
                    continue
                white = part.whitened(part.errors)
                gradient[part.places] += self._gradient(part, white)
                by_errors, by_covariance, _ = part.information(self._weights(white))
                information[np.ix_(part.places, part.places)] += by_errors + by_covariance
        return self.cost_of(every), gradient, information

    def slope(self, row: Array) -> tuple[float, Array]:
        """Cost and gradient at the covariance that a cost has, and nothing kept: for samplers, from several threads
        too. A Kalman gain keeps the sensors' noise of the last `refresh`."""
        with np.errstate(over="ignore", invalid="ignore"):
            errors = list(self.moved_errors(row))
        cost, gradient = self.cost_of(errors), np.zeros(len(self.row))
        if np.isfinite(cost):
            for part in self._expected(errors):
                gradient[part.places] += self._gradient(part, part.whitened(part.errors))
        return cost, gradient

    def _gradient(self, part: MovedErrors, white: Array) -> Array:
        """Slopes of a part's cost (m,), by d(L^-1) = -L^-1 Phi(dM), Phi: the lower triangle with half the diagonal."""
        weights, inverse = self._weights(white), part.inverse
        weighted = white if weights is None else white * weights
        pull = weighted @ inverse if inverse.ndim == 2 else (np.swapaxes(inverse, 1, 2) @ weighted[..., None])[..., 0]
        gradient = part.slopes.reshape(len(part.slopes), -1) @ pull.ravel()
        if part.turned is not None:
            lower = np.tril(np.ones((white.shape[1],) * 2)) * (1.0 - 0.5 * np.eye(white.shape[1]))
            if part.turned.ndim == 3:
                by_turn = 0.5 * len(white) * np.eye(white.shape[1]) - lower * (weighted.T @ white)
            else:
                by_turn = 0.5 * np.eye(white.shape[1]) - lower * (weighted[:, :, None] * white[:, None, :])
            gradient += part.turned.reshape(len(part.turned), -1) @ by_turn.ravel()
        return np.asarray(gradient)

    def _moved_here(self, row: Array) -> Iterator[MovedErrors]:
        """`moved_errors`, perhaps of a row before."""
        return self.moved_errors(row)

    def missing_parts(self, row: Array) -> MissingParts | None:
        """What the model may lack, as it moves the errors; here nothing that is known."""
        del row
        return None

    # ---- what the accuracy analysis needs ----------------------------------------------------------------------
    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record or window: whitened errors (n, outputs) and their sensitivities (p, n, outputs).

        The last is the information (p, p) that lies in the errors' covariance instead.
        """
        by_number: dict[int, list[Array]] = {}
        slopes: dict[int, list[Array]] = {}
        rest = np.zeros((len(self.row), len(self.row)))
        for part in self._moved_here(row):
            _, by_covariance, white = part.information(None)
            rest[np.ix_(part.places, part.places)] += by_covariance
            every = np.zeros((len(self.row), *part.errors.shape))
            every[part.places] = white
            by_number.setdefault(part.number, []).append(part.whitened(part.errors))
            slopes.setdefault(part.number, []).append(every)
        joined = [np.concatenate(each, axis=1) if len(each) > 1 else each[0] for each in slopes.values()]
        return [np.concatenate(each) for each in by_number.values()], joined, rest


class OwnCovariance(Likelihood):
    """Errors whose covariance is their own; `refresh` takes it anew for gradient and information.

    Args:
        parameters: entries of the model's free parameters.
        states, outputs: names of the model's states and of the fitted channels.
        records: the measured ones.
        rest: where states begin that are no output.
        shifts: constants in the states' rates, per record. biases: outputs with a constant per record.
    """

    def __init__(
        self,
        parameters: Sequence[Entry],
        *,
        states: Sequence[str],
        outputs: tuple[str, ...],
        records: Sequence[Record],
        rest: Mapping[str, float],
        shifts: bool,
        biases: Sequence[str],
    ) -> None:
        self.outputs, self.records = outputs, tuple(records)
        spread = np.std(np.concatenate([record.outputs for record in records]), axis=0) + 1e-12
        self.floor = (_EXACT * spread) ** 2
        self.covariance = np.diag((0.1 * spread) ** 2)
        around = dict(zip(outputs, map(float, spread), strict=True))
        size = {s: around.get(s, 1.0) for s in states}
        entries = list(parameters)
        for number, record in enumerate(records):
            first = dict(zip(outputs, map(float, record.outputs[0]), strict=True))
            for s in states:
                begin = first.get(s, rest.get(s, 0.0))
                entries.append(Entry(f"start {s}[{number}]", "initial", begin, 0.3 * size[s]))
                if shifts:
                    entries.append(Entry(f"shift {s}[{number}]", "nuisance", 0.0, 0.1 * size[s]))
            entries += [Entry(f"bias {o}[{number}]", "nuisance", 0.0, 0.1 * around[o]) for o in biases]
        self.row = Row((*entries, *self._noise_entries(size, around)))
        self._place = {name: i for i, name in enumerate(self.row.names)}

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        """What a gain is made of, from the sizes of states and outputs; nothing for output error."""
        del size, spread
        return []

    @abstractmethod
    def _errors_in_a_row(self, row: Array) -> Array:
        """Errors of every record, one after the other, (n_t, n_outputs)."""

    def errors_of(self, row: Array) -> list[Errors]:
        factor = factor_of(self.covariance)
        return [Errors(number, part, factor) for number, part in enumerate(self._by_record(self._errors_in_a_row(row)))]

    def _loss(self, white: Array) -> float:
        return 0.0  # at their own covariance it is the same for all errors

    def _weights(self, white: Array) -> Array | None:
        return None

    def _expected(self, parts: Sequence[E]) -> Sequence[E]:
        factor = factor_of(self._covariance(np.concatenate([part.errors for part in parts])))
        return [replace(part, factor=factor) for part in parts]

    def refresh(self, row: Array) -> None:
        errors = self._errors_in_a_row(row)
        if np.all(np.isfinite(errors)) and np.max(np.abs(errors)) < _DIVERGED:
            self.covariance = self._covariance(errors)

    def _covariance(self, errors: Array) -> Array:
        return np.asarray(errors.T @ errors / len(errors) + np.diag(self.floor))

    def _by_record(self, every: Array) -> list[Array]:
        """What belongs to each record of rows one after the other, (n_t, ...) each."""
        return np.split(every, np.cumsum([record.time.size for record in self.records])[:-1])

    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        """Every record beside what the model predicts: from its inputs alone, or one sample ahead with a gain."""
        sigma = np.sqrt(np.diag(self.covariance))
        return tuple(
            Comparison(
                record=record,
                counted=np.ones(record.time.size),
                model=record.outputs - errors,
                sigma=sigma,
                states=np.zeros((record.time.size, 0)),
            )
            for record, errors in zip(self.records, self._by_record(self._errors_in_a_row(row)), strict=True)
        )
