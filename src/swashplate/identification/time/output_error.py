"""Maximum likelihood by output errors over many short shots: right where no gust disturbs and no loop is closed.

Each record is cut into windows that start from their own free initial state (multiple shooting), so that neither an
unstable mode nor a long record lets the simulation run away. The cost is 1/2 sum v' R^-1 v + N/2 ln |R| with R from the
residuals (Jategaonkar 2015, ch. 4; Bock 1983 for the shooting).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import DELAYS, Nuisance
from swashplate.identification.core import robust
from swashplate.identification.core.likelihood import Errors, Likelihood, MovedErrors
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Comparison, Record, logs
from swashplate.identification.time.beginning import FirstMotion
from swashplate.identification.time.filter_error import parameter_entries
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.record_filter import record_filter
from swashplate.identification.time.shooting import FlownWindow, Shooting, ShootingPlan, Window
from swashplate.identification.time.start_states import slopes

WINDOW = 4.0
"""Seconds of one shot: some periods of the fast modes, and short against the growth of unstable ones and of yaw."""

_NUISANCE = {
    # name: scale, prior sigma
    "delay_servo": (0.05, 0.05),
    "delay_motor": (0.05, 0.05),
    "trim_motor_lower": (0.02, 0.05),
    "trim_motor_upper": (0.02, 0.05),
    "trim_servo_roll": (0.02, 0.1),
    "trim_servo_pitch": (0.02, 0.1),
    "lever_x": (0.05, 0.1),
    "lever_y": (0.05, 0.1),
    "lever_z": (0.05, 0.1),
    "level_phi": (0.02, 0.1),
    "level_theta": (0.02, 0.1),
}

_INITIAL = {
    # state: scale, prior sigma of its correction; pose and velocities are free, hidden states stay near their guess
    **dict.fromkeys(("x", "y", "z", "phi", "theta", "psi"), (0.01, 1.0)),
    **dict.fromkeys(("u", "v", "w", "p", "q", "r"), (0.1, 10.0)),
}
_INNER = {"flapping": (0.02, 0.2), "bar": (0.02, 0.5), "rotor speed": (2.0, 10.0)}
_HIDDEN = (0.02, 0.1)
"""The same for inner states by their role, and for others."""

_DRIFTING = {"trim_motor_lower": (0.002, 0.002), "trim_motor_upper": (0.002, 0.002)}
"""Scale and prior sigma of what moves slowly between windows: with the battery, by the error of its voltage.

A part in a thousand of one rotor's command turns the nose by 1.6 rad in 4 s.
"""


class OutputError(Likelihood):
    """The residuals' likelihood of windows simulated from their own initial states.

    Args:
        table: free parameters and ties.
        pieces: the records, all at one rate.
        window: length of one shot [s].
        nuisances: which of the records' own numbers to estimate (names of `Nuisance`).
    """

    def __init__(
        self,
        table: Parameterization,
        pieces: Sequence[Record],
        *,
        window: float = WINDOW,
        nuisances: Sequence[str] = tuple(_NUISANCE),
    ) -> None:
        self.table = table
        self.records = tuple(pieces)
        self.model = stochastic_model(table.vehicle, pieces[0].output_names, pieces[0].dt)
        self.nuisances = tuple(nuisances)
        self.length = round(window / self.model.dt)
        self._places = [
            (number, first)
            for number, piece in enumerate(pieces)
            for first in range(0, piece.time.size - self.length, self.length)
        ]
        if not self._places:
            longest = max(piece.time.size for piece in pieces) * self.model.dt
            raise IdentificationError(
                f"the longest record has {longest:.1f} s, expected more than one window of {window:g} s.",
                hint="Choose a shorter window.",
            )
        absent = {name for name in _NUISANCE if name.startswith("trim_")}
        absent -= {f"trim_{name}" for name in table.vehicle.input_names}
        self.nuisances = tuple(name for name in self.nuisances if name not in absent)
        drifting = tuple(name for name in _DRIFTING if name in self.nuisances)
        vehicle, states = table.vehicle, {}
        for name, role in zip(vehicle.state_names, vehicle.roles, strict=True):
            states[name] = _INITIAL.get(name) or _INNER.get(role, _HIDDEN)
        self._own = states | {name: _DRIFTING[name] for name in drifting}
        self.logs, self._log = logs(pieces)
        entries = parameter_entries(table)
        for number in range(len(self.logs)):
            for name in self.nuisances:
                scale, sigma = _NUISANCE[name]
                low = -0.02 if name in DELAYS else -np.inf
                kinked = name in DELAYS
                entries.append(Entry(f"{name}[{number}]", "nuisance", 0.0, scale, low, sigma=sigma, kinked=kinked))
        self._shared = len(entries)
        for place in range(len(self._places)):
            for name, (scale, sigma) in self._own.items():
                entries.append(Entry(f"{name} at window {place}", "initial", 0.0, scale, sigma=sigma))
        self.row = Row(tuple(entries), table.prior_correlations)
        self._plan = ShootingPlan(self.model, table.layout, self.nuisances, drifting, self.length, self._shared)
        self._outputs = np.stack([pieces[r].outputs[first : first + self.length] for r, first in self._places])
        self._shooting = self._windows()
        self._L = np.eye(len(pieces[0].output_names))

    def _windows(self) -> Shooting:
        windows = []
        for number, first in self._places:
            piece, here = self.records[number], slice(first, first + self.length)
            value, rate = (part[0] for part in slopes(piece, np.array([first])))
            voltage = piece.voltage[here]
            motion = FirstMotion(value, rate, np.zeros(3), np.array([voltage[0]]), float(piece.time[first]))
            windows.append(Window(int(self._log[number]), first, piece.inputs, voltage, motion))
        return Shooting(
            self._plan,
            tuple(windows),
            card=np.asarray(self.table.card_row),
            scale=self.row.scale[: self._shared],
            own_scale=np.array([scale for scale, _ in self._own.values()]),
        )

    @property
    def compiled_by(self) -> str:
        """What simulates the windows: "C" or "NumPy"."""
        return record_filter(self.model).compiled_by

    def residuals(self, row: Array) -> tuple[Array, Array]:
        """Residuals (windows, n, outputs) and states (windows, n, states)."""
        return self._beside(self._shooting.simulate_windows(row))

    def _beside(self, runs: list[FlownWindow]) -> tuple[Array, Array]:
        """Residuals and states of simulated windows."""
        return self._outputs - np.stack([run.outputs for run in runs]), np.stack([run.run.states.x for run in runs])

    def _with_slopes(self, row: Array) -> tuple[Array, Array]:
        """Residuals, and their slopes by the shared entries and by each window's own (windows, entries, n, outputs)."""
        windows = self._shooting.simulate_windows(row)
        return self._beside(windows)[0], -self._shooting.output_slopes(row, windows)

    # ---- likelihood --------------------------------------------------------------------------------------------
    def errors_of(self, row: Array) -> list[Errors]:
        return [Errors(place, part, self._L) for place, part in enumerate(self.residuals(row)[0])]

    def moved_errors(self, row: Array) -> Iterator[MovedErrors]:
        """Windows share only the first entries (an arrow-shaped matrix)."""
        residual, slopes = self._with_slopes(row)
        s, n = self._shared, len(self._own)
        for place, (errors, by_entry) in enumerate(zip(residual, slopes, strict=True)):
            entries = np.concatenate([np.arange(s), s + place * n + np.arange(n)])
            yield MovedErrors(place, errors, self._L, entries, by_entry)

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """It has no filter to predict from."""
        raise IdentificationError("output error has no errors ahead.", channel="horizon")

    def refresh(self, row: Array) -> None:
        """Covariance of the residuals at an accepted row, outliers weighed down."""
        flat = np.asarray(self.residuals(row)[0]).reshape(-1, self._L.shape[0])
        if not np.isfinite(flat).all():
            return
        scale = 1.4826 * np.median(np.abs(flat), axis=0) + 1e-12
        weight = np.minimum(robust.weights(flat / scale).min(axis=1), 1.0)[:, None]
        R = (flat * weight).T @ flat / weight.sum()
        floor = np.diag(np.full(R.shape[0], 1e-14))
        self._L = np.linalg.cholesky(0.5 * (R + R.T) + floor)

    # ---- what the report needs -------------------------------------------------------------------------------------
    @property
    def constant(self) -> OutputError:
        """Itself: it has no gain."""
        return self

    def noise_of(self, row: Array) -> Noise | None:
        """It knows of no process noise."""
        return None

    def nuisances_of(self, row: Array) -> Nuisance:
        """Constants at a row, one array entry per record."""
        k, n, m = len(self.table.layout.free), len(self.logs), len(self.nuisances)
        constants = (row[: self._shared] * self.row.scale[: self._shared])[k : k + n * m].reshape(n, m)[self._log]
        still = Nuisance(*np.zeros((len(Nuisance._fields), len(constants))))
        return still._replace(**dict(zip(self.nuisances, constants.T, strict=True)))

    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        """Every record beside its simulated windows."""
        residual, simulated = (np.asarray(item) for item in self.residuals(row))
        kept = [self.table.vehicle.index(name) for name in PREDICTED]
        sigma, comparisons = np.sqrt(np.diag(self.covariance)), []
        for number, piece in enumerate(self.records):
            model, counted = np.full_like(piece.outputs, np.nan), np.zeros(piece.time.size, dtype=bool)
            body = np.full((piece.time.size, len(PREDICTED)), np.nan)
            for place, (owner, first) in enumerate(self._places):
                if owner == number:
                    here = slice(first, first + self.length)
                    model[here] = piece.outputs[here] - residual[place]
                    body[here] = simulated[place][:, kept]
                    counted[here] = True
            comparisons.append(Comparison(record=piece, counted=counted, model=model, sigma=sigma, states=body))
        return tuple(comparisons)

    @property
    def covariance(self) -> Array:
        """Covariance of the output errors at the last accepted row."""
        return np.asarray(self._L @ self._L.T)

    def places(self) -> list[tuple[int, int]]:
        """Record number and first sample of each window."""
        return list(self._places)
