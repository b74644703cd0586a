"""Likelihoods of errors along records in time: what linear and nonlinear models have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.records import Comparison, Record

Moved = tuple[NDArray[np.intp], Array, Array]
"""Places of entries (m,), errors of a record (n_t, n_outputs), their slopes by those entries (m, n_t, n_outputs)."""

NOTHING = np.array([], dtype=np.intp)
"""Places of no entries."""

_FIRST_GAIN = 0.3
_DIVERGED = 1e9
_EXACT = 1e-6

_GUST = 0.3
"""First guess: share of a state's size by which its rate is disturbed."""

SPREAD = 2.0
"""Of the prior on the logarithm of a gust's intensity: a factor of seven either way."""


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


class TimeErrors(ABC):
    """The likelihood of output errors or innovations; `refresh` takes their covariance anew for gradient and metric.

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
            seen = dict(zip(outputs, map(float, record.outputs[0]), strict=True))
            for s in states:
                begin = seen.get(s, rest.get(s, 0.0))
                entries.append(Entry(f"start {s}[{number}]", "initial", begin, 0.3 * size[s]))
                if shifts:
                    entries.append(Entry(f"shift {s}[{number}]", "nuisance", 0.0, 0.1 * size[s]))
            entries += [Entry(f"bias {o}[{number}]", "nuisance", 0.0, 0.1 * around[o]) for o in biases]
        self._row = Row((*entries, *self._noise_entries(size, around)))
        self._place = {name: i for i, name in enumerate(self._row.names)}

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        """What a gain is made of, from the sizes of states and outputs; nothing for output error."""
        del size, spread
        return []

    @abstractmethod
    def _plain(self, row: Array) -> Array:
        """Errors of every record, one after the other, (n_t, n_outputs)."""

    @abstractmethod
    def _moved(self, row: Array) -> Iterator[Moved]:
        """Of samples that follow each other, never of two records: places of the entries that move their errors, the
        errors, their slopes by those entries."""

    def errors_ahead(self, row: Array, ahead: Ahead) -> list[Array]:
        """Per record, measured less predicted from the filter's states, (starts, horizons, outputs)."""
        return self.errors_ahead_moved(row, ahead, NOTHING)[0]

    @abstractmethod
    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """The same, and the slopes by some entries of the scaled row, (places, starts, horizons, outputs)."""

    @property
    def row(self) -> Row:
        return self._row

    def refresh(self, row: Array) -> None:
        errors = self._plain(row)
        if np.all(np.isfinite(errors)) and np.max(np.abs(errors)) < _DIVERGED:
            self.covariance = self._covariance(errors)

    def _covariance(self, errors: Array) -> Array:
        return np.asarray(errors.T @ errors / len(errors) + np.diag(self.floor))

    def cost(self, row: Array) -> float:
        """Negative log-likelihood at its own covariance, without constants: n/2 log det S."""
        with np.errstate(over="ignore", invalid="ignore"):
            errors = self._plain(row)
        return self._cost_of(errors)

    def _cost_of(self, errors: Array) -> float:
        """Infinite for errors of a model that diverges."""
        if not np.all(np.isfinite(errors)) or np.max(np.abs(errors)) > _DIVERGED:
            return float("inf")
        return self._cost(errors)

    def _cost(self, errors: Array) -> float:
        return 0.5 * len(errors) * float(np.linalg.slogdet(self._covariance(errors))[1])

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        inverse = np.linalg.inv(np.linalg.cholesky(self.covariance))
        gradient, information = np.zeros(len(self._row)), np.zeros((len(self._row), len(self._row)))
        every = []
        for places, errors, slopes in self._moved(row):
            white = (slopes.reshape(-1, errors.shape[1]) @ inverse.T).reshape(places.size, -1)
            gradient[places] += white @ (errors @ inverse.T).ravel()
            information[np.ix_(places, places)] += white @ white.T
            every.append(errors)
        return self._cost(np.concatenate(every)), gradient, information

    def slope(self, row: Array) -> tuple[float, Array]:
        """Cost and gradient at the row's own covariance, and nothing kept: for samplers, from several threads too.

        A Kalman gain keeps the sensors' noise of the last `refresh`.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            moved = list(self._moved(row))
        errors, gradient = np.concatenate([part for _, part, _ in moved]), np.zeros(len(self._row))
        cost = self._cost_of(errors)
        if np.isfinite(cost):
            inverse = np.linalg.inv(self._covariance(errors))
            for places, part, slopes in moved:
                gradient[places] += slopes.reshape(places.size, -1) @ (part @ inverse).ravel()
        return cost, gradient

    def sized(self, row: Array) -> Array:
        """A scaled row with what the errors' covariance alone tells: here nothing."""
        return row

    # ---- what the accuracy analysis and the report need --------------------------------------------------------
    def _by_record(self, every: Array) -> list[Array]:
        """What belongs to each record of rows one after the other, (n_t, ...) each."""
        return np.split(every, np.cumsum([record.time.size for record in self.records])[:-1])

    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record: whitened errors (n, outputs) and their sensitivities (p, n, outputs); no other information."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.covariance))
        lengths = [record.time.size for record in self.records]
        plain = [np.zeros((length, len(self.outputs))) for length in lengths]
        moved = [np.zeros((len(self._row), length, len(self.outputs))) for length in lengths]
        number, at = 0, 0
        for places, errors, slopes in self._moved(row):
            if at == lengths[number]:
                number, at = number + 1, 0
            here = slice(at, at + len(errors))
            plain[number][here] = errors @ inverse.T
            moved[number][places, here] = (slopes.reshape(-1, errors.shape[1]) @ inverse.T).reshape(slopes.shape)
            at += len(errors)
        return plain, moved, np.zeros((len(self._row), len(self._row)))

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
            for record, errors in zip(self.records, self._by_record(self._plain(row)), strict=True)
        )
