"""Maximum likelihood by filter error: the default for flights, which fly in disturbed air under feedback.

The cost is the negative log-likelihood of the innovations of a constant-gain Kalman filter around the nonlinear
equations, with the process and measurement noise estimated beside the parameters (filter error method: Maine and
Iliff 1981; Jategaonkar 2015, ch. 5; Ljung 1999, ch. 7). Because every prediction uses only the past, a controller that
answers to the measured motion does not bias it as it biases output error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import DELAYS, Nuisance
from swashplate.identification.core import robust
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.core.records import Comparison, Record, logs
from swashplate.identification.time.beginning import FilterNumbers, seen_at_start
from swashplate.identification.time.innovations import Filtered, FilterPlan, RecordRun
from swashplate.identification.time.kinematics import PREDICTED, turned_rows
from swashplate.identification.time.noise_entries import estimated_noises, noise_entries, with_first_guesses
from swashplate.identification.time.record_filter import record_filter

SETTLING = 1.5
"""Seconds at the start of each record that the filter is given to forget its first guess; they are not counted."""

_NUISANCE = {
    # name: start, scale, prior sigma
    "delay_servo": (0.05, 0.05, 0.05),
    "delay_motor": (0.05, 0.05, 0.05),
    "trim_servo_roll": (0.0, 0.02, 0.05),
    "trim_servo_pitch": (0.0, 0.02, 0.05),
    "lever_x": (0.0, 0.05, 0.1),
    "lever_y": (0.0, 0.05, 0.1),
    "lever_z": (0.0, 0.05, 0.1),
    "level_psi": (0.0, 0.1, 0.1),
}


_Accumulated = tuple[Array, Array, list[Filtered], list[tuple[Array, Array]]]
"""Gradient, information, runs, and by record slopes and the information in the covariance."""

_KEPT = 2
"""Rows whose runs are kept: a search tries up to two, and goes on from one of them."""


def parameter_entries(table: Parameterization) -> list[Entry]:
    """Row entries of the free parameters with their bounds and priors."""
    low, high = table.bounds()
    return [
        Entry(
            name=free.name,
            group="parameter",
            start=start,
            scale=free.scale,
            lower=lower,
            upper=upper,
            mean=0.0 if free.mean is None else free.mean,
            sigma=np.inf if free.sigma is None else free.sigma,
        )
        for free, start, lower, upper in zip(table.free, table.starts(), low, high, strict=True)
    ]


class FilterError:
    """The innovations' likelihood of some records as a function of parameters, nuisances and noise.

    Args:
        table: free parameters and ties.
        pieces: the records, all at one rate.
        noise: first guesses of the noise; yaw and heave get numbers of their own where the table frees them.
        estimate_noise: False keeps the noise at `noise`.
        nuisance: centre of the priors on delays, trims and lever arms (None: the usual ones).
    """

    def __init__(
        self,
        table: Parameterization,
        pieces: Sequence[Record],
        *,
        noise: Noise | None = None,
        estimate_noise: bool = True,
        nuisance: Nuisance | None = None,
    ) -> None:
        self.table = table
        self.pieces = tuple(pieces)
        self.noise = with_first_guesses(noise or Noise(), table.noises, pieces[0].output_names)
        self.estimate_noise = estimate_noise
        self.model = stochastic_model(table.vehicle, pieces[0].output_names, pieces[0].dt, noise=self.noise)
        self.logs, self._log = logs(pieces)
        entries = parameter_entries(table)
        nuisances = {**_NUISANCE, **{free.name: _of_record(free) for free in table.of_records}}
        for number in range(len(self.logs)):
            for name, (usual, scale, sigma) in nuisances.items():
                start = usual if nuisance is None else float(getattr(nuisance, name))
                low = 0.0 if name in DELAYS else -np.inf
                kinked = name in DELAYS
                entries.append(
                    Entry(f"{name}[{number}]", "nuisance", start, scale, low, mean=start, sigma=sigma, kinked=kinked)
                )
        noises = estimated_noises(self.model, self.noise) if estimate_noise else ()
        entries += noise_entries(noises, self.noise)
        self.row = Row(tuple(entries), table.prior_correlations)
        seen = [seen_at_start(table.vehicle, piece) for piece in pieces]
        plan = FilterPlan(self.model, table.layout, len(self.logs), tuple(nuisances), noises)
        self._runs = tuple(
            RecordRun(plan, int(log), piece.outputs, piece.inputs, piece.voltage, first)
            for log, piece, first in zip(self._log, pieces, seen, strict=True)
        )
        self._kept: dict[bytes, list[Filtered]] = {}
        self._last: tuple[bytes, _Accumulated] | None = None
        settled = round(SETTLING / self.model.dt)
        self.counted = tuple(piece.counts & (np.arange(piece.time.size) >= settled) for piece in pieces)

    def widened(self, added: Sequence[str]) -> FilterError:
        """The same likelihood with more of the vehicle's numbers free, under a constant gain."""
        table = self.table.wider(added)
        return FilterError(table, self.pieces, noise=self.noise, estimate_noise=self.estimate_noise)

    @property
    def constant(self) -> FilterError:
        """The likelihood of the same row with a constant gain."""
        return self

    @property
    def compiled_by(self) -> str:
        """What runs along the records: "C" or "NumPy"."""
        return record_filter(self.model).compiled_by

    def numbers(self, row: Array) -> list[FilterNumbers]:
        """What the filter of each record depends on at a scaled row."""
        given = self.table.card_row, np.array(self.noise, dtype=np.float64), row * self.row.scale
        return [run.placed(*given)[1] for run in self._runs]

    def runs(self, row: Array) -> list[Filtered]:
        """The filter's run along every record; that of the last rows is kept, for what is asked of a row next."""
        asked = np.asarray(row, dtype=np.float64).tobytes()
        if asked not in self._kept:
            given = self.table.card_row, np.array(self.noise, dtype=np.float64), row * self.row.scale
            filtered = [run.filtered(*given) for run in self._runs]
            self._kept = dict([*self._kept.items(), (asked, filtered)][-_KEPT:])
        return self._kept[asked]

    def errors_ahead(self, row: Array, ahead: Ahead) -> list[Array]:
        """Per record, measured less predicted from the filter's states, (starts, horizons, outputs)."""
        runs = zip(self._runs, self.runs(row), ahead.starts, strict=True)
        return [mine.ahead(run, starts, ahead.steps) for mine, run, starts in runs]

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """The same, and the slopes by some entries of the row, (places, starts, horizons, outputs)."""
        given, count = (self.table.card_row, row * self.row.scale, self.row.scale), int(max(places)) + 1
        runs = zip(self._runs, self.runs(row), ahead.starts, strict=True)
        told = [mine.ahead_moved(run, starts, ahead.steps, given, count) for mine, run, starts in runs]
        return [errors for errors, _ in told], [slopes[places] for _, slopes in told]

    # ---- likelihood --------------------------------------------------------------------------------------------
    def cost(self, row: Array) -> float:
        """Negative log-likelihood of the counted innovations (without its constant)."""
        return self._cost(self.runs(row))

    def _cost(self, runs: Sequence[Filtered]) -> float:
        total = 0.0
        for run, counted in zip(runs, self.counted, strict=True):
            nu, S = run.innovations[counted], np.asarray(run.begin.gain.covariance)
            if not (np.isfinite(nu).all() and np.isfinite(S).all()):
                return np.inf
            try:
                L = np.linalg.cholesky(S)
            except np.linalg.LinAlgError:
                return np.inf
            total += robust.huber(np.asarray(np.linalg.solve(L, nu.T), dtype=np.float64)) + nu.shape[0] * float(
                np.log(np.diag(L)).sum()
            )
        return total

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        """Cost, gradient and Fisher information (the covariance's part included; Ljung 1999, sec. 9.4)."""
        gradient, information, runs, _ = self._accumulate(row)
        return self._cost(runs), gradient, information

    def _accumulate(self, row: Array) -> _Accumulated:
        """Slopes at a row; those of the last one are kept, which a search ends with and its judges ask for."""
        asked = np.asarray(row, dtype=np.float64).tobytes()
        if self._last is None or self._last[0] != asked:
            self._last = asked, self._accumulated(row)
        return self._last[1]

    def slope(self, row: Array) -> tuple[float, Array]:
        """Cost and gradient, and nothing kept: for samplers, from several threads too."""
        given = self.table.card_row, np.array(self.noise, dtype=np.float64), row * self.row.scale
        runs, gradient = [run.filtered(*given) for run in self._runs], np.zeros(len(self.row))
        cost = self._cost(runs)
        if np.isfinite(cost):
            for mine, run, counted in zip(self._runs, runs, self.counted, strict=True):
                gradient += self._gradient(run, counted, *self._moved(mine, run, row))
        return cost, gradient

    def _gradient(self, run: Filtered, counted: NDArray[np.bool_], d_nu: Array, dS: Array) -> Array:
        """A record's part, from the slopes of all its innovations and of their covariance."""
        Li = np.linalg.inv(np.linalg.cholesky(np.asarray(run.begin.gain.covariance)))
        white = run.innovations[counted] @ Li.T
        weighted = white * robust.weights(white)
        pull = np.zeros_like(run.innovations)
        pull[counted] = weighted @ Li
        dM = Li @ dS @ Li.T
        gradient = d_nu.reshape(len(d_nu), -1) @ pull.ravel()
        gradient += 0.5 * white.shape[0] * np.trace(dM, axis1=1, axis2=2)
        # d(L^-1) = -L^-1 Phi(dM), Phi: the lower triangle with half the diagonal.
        gradient -= np.einsum("pij,ij->p", np.tril(dM) * (1.0 - 0.5 * np.eye(len(Li))), weighted.T @ white)
        return np.asarray(gradient)

    def _accumulated(self, row: Array) -> _Accumulated:
        p, runs = len(self.row), self.runs(row)
        moved: list[tuple[Array, Array]] = []
        gradient, information = np.zeros(p), np.zeros((p, p))
        for mine, run, counted in zip(self._runs, runs, self.counted, strict=True):
            S = np.asarray(run.begin.gain.covariance)
            nu = run.innovations[counted]
            if not np.isfinite(nu).all():
                return gradient, information, runs, moved
            d_nu, dS = self._moved(mine, run, row)
            gradient += self._gradient(run, counted, d_nu, dS)
            Li = np.linalg.inv(np.linalg.cholesky(S))
            told, by_covariance = self._foreseen(d_nu[:, counted], nu, dS, S, mine.log)
            told = (told.reshape(-1, len(S)) @ Li.T).reshape(p, -1, len(S))
            moved.append((told, by_covariance))
            weighted = told.reshape(p, -1) * np.sqrt(robust.weights(nu @ Li.T)).ravel()
            information += weighted @ weighted.T + by_covariance
        return gradient, information, runs, moved

    def _moved(self, mine: RecordRun, run: Filtered, row: Array) -> tuple[Array, Array]:
        """Slopes of a record's innovations (p, n, outputs) and of their covariance (p, outputs, outputs)."""
        return mine.moved(run, self.table.card_row, row * self.row.scale, self.row.scale)

    def _foreseen(self, d_nu: Array, nu: Array, dS: Array, S: Array, log: int) -> tuple[Array, Array]:
        """Slopes of innovations and the information in their covariance (p, p), without what only turns both.

        Innovations stand in the axes of the predicted heading. An entry that moves it turns what was measured now too,
        and its covariance with it, which makes no flight more or less likely.
        """
        Li = np.linalg.inv(np.linalg.cholesky(S))
        flat = (Li @ dS @ Li.T).reshape(len(dS), -1)
        by_covariance = 0.5 * len(nu) * flat @ flat.T
        names = self.model.output_names
        if not {"x", "y", "psi"} <= set(names):
            return d_nu, by_covariance
        i, j, k = (names.index(name) for name in ("x", "y", "psi"))
        heading = -d_nu[:, :, k]
        if (level := f"level_psi[{log}]") in self.row.names:
            place = self.row.names.index(level)
            heading[place] -= self.row.scale[place]  # what is tracked moves, the nose does not
        turn = np.zeros_like(S)
        turn[i, j], turn[j, i] = 1.0, -1.0
        turned = (Li @ (turn @ S + S @ turn.T) @ Li.T).ravel()
        mixed = np.outer(flat @ turned, heading.sum(axis=1))
        by_covariance += 0.5 * (turned @ turned * (heading @ heading.T) - mixed - mixed.T)
        return d_nu - heading[:, :, None] * (nu @ turn.T), by_covariance

    def refresh(self, row: Array) -> None:
        """Nothing is held between iterations: the noise is part of the row."""

    def unturned(self, innovations: Array, piece: Record) -> Array:
        """Innovations of a record with their horizontal part back in local axes."""
        names = self.model.output_names
        return turned_rows(innovations, names, piece.outputs[:, names.index("psi")]) if "psi" in names else innovations

    # ---- what the accuracy analysis and the report need --------------------------------------------------------
    def noise_of(self, row: Array) -> Noise:
        """The noise at a row."""
        return Noise(*self.numbers(row)[0].noise.tolist())

    def nuisances_of(self, row: Array) -> Nuisance:
        """Constants at a row, one array entry per record."""
        return Nuisance(*np.array([numbers.nuisance for numbers in self.numbers(row)]).T)

    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        """Every record beside its one-step predictions."""
        kept = [self.table.vehicle.index(name) for name in PREDICTED]
        return tuple(
            Comparison(
                record=piece,
                counted=counted.astype(np.float64),
                model=piece.outputs - self.unturned(run.innovations, piece),
                sigma=np.sqrt(np.diag(run.begin.gain.covariance)),
                states=run.states.x[:, kept],
            )
            for piece, run, counted in zip(self.pieces, self.runs(row), self.counted, strict=True)
        )

    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record: whitened innovations (n, outputs) and their sensitivities (p, n, outputs).

        The last is the information (p, p) that lies in the innovations' covariance instead.
        """
        _, _, runs, moved = self._accumulate(row)
        white, sensitivities, rest = [], [], np.zeros((len(self.row), len(self.row)))
        for run, (d_white, by_covariance), counted in zip(runs, moved, self.counted, strict=True):
            white.append(run.innovations[counted] @ np.linalg.inv(np.linalg.cholesky(run.begin.gain.covariance)).T)
            sensitivities.append(d_white)
            rest += by_covariance
        return white, sensitivities, rest


def _of_record(free: Free) -> tuple[float, float, float]:
    """First guess, scale and standard deviation of a record's own number."""
    return free.mean or 0.0, free.scale, np.inf if free.sigma is None else free.sigma
