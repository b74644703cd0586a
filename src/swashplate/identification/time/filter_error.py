"""Maximum likelihood by filter error: the default for flights, which fly in disturbed air under feedback.

The cost is the negative log-likelihood of the innovations of a constant-gain Kalman filter around the nonlinear
equations, with the process and measurement noise estimated beside the parameters (filter error method: Maine and
Iliff 1981; Jategaonkar 2015, ch. 5; Ljung 1999, ch. 7). Because every prediction uses only the past, a controller that
answers to the measured motion does not bias it as it biases output error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.disturbances import GYROSCOPE, SEPARATE, Noise
from swashplate.filtering.disturbed_model import StochasticModel, stochastic_model
from swashplate.filtering.nuisance import DELAYS, Nuisance
from swashplate.flights.schema import RATES
from swashplate.identification.core.likelihood import Errors, Likelihood, MovedErrors, factor_of
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.core.records import Comparison, Record, logs
from swashplate.identification.time.beginning import FilterNumbers, seen_at_start
from swashplate.identification.time.innovations import Filtered, FilterPlan, RecordRun
from swashplate.identification.time.kinematics import PREDICTED, turned_rows
from swashplate.identification.time.record_filter import record_filter
from swashplate.identification.time.start_states import slopes

_SPREAD = {
    "tau_gust_moment": 0.5,
    "tau_gust_force": 0.5,
    "drift_moment": 0.5,
    "drift_force": 0.5,
    **{name: spread for name, (_, _, spread) in SEPARATE.items()},
}
"""Width of the prior on the logarithm of each noise number; the others get 2 (a factor of 7)."""

_WIND = ("wind", "tau_wind")

_ADDED = ("white", "gust", "wind", "sensor")
"""How the noise numbers begin whose squares add to the innovations' variance; drifts and times act by ratios."""


def in_wind(pieces: Sequence[Record]) -> Noise:
    """First guesses of the noise for flights in horizontal wind, with the speed that the records were flown at."""
    return Noise(wind=0.1, speed=_typical_speed(pieces))


def _typical_speed(pieces: Sequence[Record]) -> float:
    """Root mean square of each horizontal velocity [m/s]; zero where no positions were measured."""
    if not {"x", "y"} <= set(pieces[0].output_names):
        return 0.0
    columns = [pieces[0].output_names.index(name) for name in ("x", "y")]
    velocities = [slopes(piece, np.arange(0.0, piece.time.size, 10.0))[1][:, columns] for piece in pieces]
    return float(np.sqrt(np.mean(np.concatenate(velocities) ** 2)))


def with_first_guesses(noise: Noise, separate: Sequence[str], outputs: Sequence[str]) -> Noise:
    """The noise with first guesses of what yaw or heave are to have for themselves, and that of a gyroscope in use."""
    if set(RATES) & set(outputs) and not noise.sensor_rate > 0.0:
        noise = noise._replace(sensor_rate=GYROSCOPE)
    return noise._replace(**{name: SEPARATE[name][1] for name in separate if not getattr(noise, name) > 0.0})


def estimated_noises(model: StochasticModel, guess: Noise) -> tuple[str, ...]:
    """The noise numbers that are estimated: the speed and a gyroscope's noise are given, the wind's and the separate
    ones only where wanted.

    Tracked angles err for tenths of a second on end. To the likelihood such errors look like motion, and it would call
    the gyroscope wrong that does not show them (found on flights of a Crazyflie: 0.17 rad/s instead of 0.04, and delays
    and inertias to go with it).
    """
    left = {"speed", "sensor_rate", *(() if model.windy else _WIND)}
    left |= {name for name in SEPARATE if not getattr(guess, name) > 0.0}
    return tuple(name for name in Noise._fields if name not in left)


def noise_entries(names: Sequence[str], guess: Noise) -> list[Entry]:
    """Row entries of estimated noise numbers: logarithms about their first guesses."""
    return [
        Entry(name, "noise", log, 1.0, log - 9.0, log + 9.0, log, _SPREAD.get(name, 2.0), True, name.startswith(_ADDED))
        for name, log in ((name, float(np.log(getattr(guess, name)))) for name in names)
    ]


SHIFTS = 19
"""Other places of the commands: unrelated ones are the best of twenty by chance in one of twenty cases."""


def unrelated(cost: Callable[[Sequence[Array]], float], pieces: Sequence[Record]) -> str:
    """Why the commands are not those of the motion, in words; "" where they explain it better than moved ones.

    A permutation test (Good 2005): the commands of every record are moved around in a circle, and nothing is fitted
    anew, so that what they say of the motion is all that changes.

    Args:
        cost: negative log-likelihood of the records under commands, at the numbers that were found.
        pieces: the records.
    """
    here = cost([piece.inputs for piece in pieces])
    shares = np.arange(1, SHIFTS + 1) / (SHIFTS + 1)
    better = [share for share in shares if cost([_later(piece.inputs, share) for piece in pieces]) <= here]
    if not better:
        return ""
    longest = max(float(piece.time[-1] - piece.time[0]) for piece in pieces)
    return (
        f"the motion does not follow the commands: the same commands {better[0] * longest:.3g} s later explain it as "
        "well. Are they of another flight, another clock or other channels?"
    )


def _later(commands: Array, share: float) -> Array:
    """Commands later by a share of their length, the last ones first."""
    return np.roll(commands, round(share * len(commands)), axis=0)


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


class FilterError(Likelihood):
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
        self.records = tuple(pieces)
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
        motions = [seen_at_start(table.vehicle, piece) for piece in pieces]
        plan = FilterPlan(self.model, table.layout, len(self.logs), tuple(nuisances), noises)
        self._runs = tuple(
            RecordRun(plan, int(log), piece.outputs, piece.inputs, piece.voltage, first)
            for log, piece, first in zip(self._log, pieces, motions, strict=True)
        )
        self._kept: dict[bytes, list[Filtered]] = {}
        self._last: tuple[bytes, list[MovedErrors]] | None = None
        settled = round(SETTLING / self.model.dt)
        self.counted = tuple(piece.counts & (np.arange(piece.time.size) >= settled) for piece in pieces)

    def widened(self, added: Sequence[str]) -> FilterError:
        """The same likelihood with more of the vehicle's numbers free, under a constant gain."""
        return self.of(self.table.wider(added), self.records)

    def of(self, table: Parameterization, pieces: Sequence[Record]) -> FilterError:
        """The likelihood of other parameters or records, under a constant gain."""
        return FilterError(table, pieces, noise=self.noise, estimate_noise=self.estimate_noise)

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
            near = next(reversed(self._kept.values()), [None] * len(self._runs))
            filtered = [run.filtered(*given, other) for run, other in zip(self._runs, near, strict=True)]
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
        pairs = [mine.ahead_moved(run, starts, ahead.steps, given, count) for mine, run, starts in runs]
        return [errors for errors, _ in pairs], [slopes[places] for _, slopes in pairs]

    # ---- likelihood --------------------------------------------------------------------------------------------
    def errors_of(self, row: Array) -> list[Errors]:
        return self._parts(self.runs(row))

    def cost_under(self, commands: Sequence[Array], row: Array) -> float:
        """The cost of the records under other commands, per record (n, inputs)."""
        given = self.table.card_row, np.array(self.noise, dtype=np.float64), row * self.row.scale
        every = zip(self._runs, commands, self.runs(row), strict=True)
        return self.cost_of(self._parts([replace(run, inputs=u).filtered(*given, near) for run, u, near in every]))

    def moved_errors(self, row: Array) -> Iterator[MovedErrors]:
        given = self.table.card_row, np.array(self.noise, dtype=np.float64), row * self.row.scale
        return self._along(row, [run.filtered(*given) for run in self._runs])

    def _parts(self, runs: Sequence[Filtered]) -> list[Errors]:
        return [
            Errors(number, run.innovations[counted], factor_of(np.asarray(run.begin.gain.covariance)))
            for number, (run, counted) in enumerate(zip(runs, self.counted, strict=True))
        ]

    def _along(self, row: Array, runs: Sequence[Filtered]) -> Iterator[MovedErrors]:
        places = np.arange(len(self.row))
        for mine, run, counted, part in zip(self._runs, runs, self.counted, self._parts(runs), strict=True):
            slopes, dS = mine.innovation_slopes(run, self.table.card_row, row * self.row.scale, self.row.scale)
            Li = np.linalg.inv(part.factor)
            S = np.asarray(run.begin.gain.covariance)
            telling = self._foreseen(slopes[:, counted], part.errors, dS, S, mine.log)
            turned = Li @ dS @ Li.T
            yield MovedErrors(part.number, part.errors, part.factor, places, slopes[:, counted], turned, telling)

    def _moved_here(self, row: Array) -> Iterator[MovedErrors]:
        """Those of the last row are kept, which a search ends with and its judges ask for."""
        asked = np.asarray(row, dtype=np.float64).tobytes()
        if self._last is None or self._last[0] != asked:
            self._last = asked, list(self._along(row, self.runs(row)))
        return iter(self._last[1])

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
            for piece, run, counted in zip(self.records, self.runs(row), self.counted, strict=True)
        )


def _of_record(free: Free) -> tuple[float, float, float]:
    """First guess, scale and standard deviation of a record's own number."""
    return free.mean or 0.0, free.scale, np.inf if free.sigma is None else free.sigma
