"""What a linear residual is, what speaks for it, its part of the accelerations, and how a fit goes on with it.

A physics that is fitted without its residual leans towards what is missing, and a residual that is fitted beside a
physics that is held finds only the rest. So the search goes on with everything free: the physics with its own priors,
and the coefficients about zero with the ridge that the blocks chose (a ridge is a normal prior).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.disturbances import DISTURBED, Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.parameters import Free, Parameterization, trim_of_record
from swashplate.identification.time.estimates import Solved
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.innovations import Filtered
from swashplate.models.residual import HEADING, ROWS, coefficients, counted_from, heading_counted, with_residual
from swashplate.models.vehicle import Vehicle

_FAR = 2.0
"""Standard deviations beyond which a parameter that moved is named."""


@dataclass(frozen=True)
class LinearResidual:
    """A vehicle with its residual, and what speaks for it.

    Attributes:
        vehicle: with the coefficients on its card; as it was where the blocks left out speak for none.
        strength: of the ridge; infinite for none.
        gain, error: log-likelihood that blocks left out gain, all together, and its standard error.
        noise: of the filter that goes with it: its drifts wander as errors ahead want it, else the fit's own.
        shares: of each acceleration's root mean square along the training flights, the residual's part [%], by state.
    """

    vehicle: Vehicle
    strength: float
    gain: float
    error: float
    shares: dict[str, float]
    noise: Noise
    units: Mapping[str, float] = field(default_factory=dict)
    along: tuple[Mapping[str, Array], Mapping[str, Array]] = field(default=({}, {}), repr=False, compare=False)
    shifts: Mapping[str, float] = field(default_factory=dict)

    @property
    def kept(self) -> bool:
        return bool(np.isfinite(self.strength))

    def at(self, vehicle: Vehicle, shifts: Mapping[str, float]) -> LinearResidual:
        """The same with what a search found for physics and residual together, and how far that moved the physics."""
        return replace(self, vehicle=vehicle, shifts=shifts, shares=shares(vehicle, *self.along))

    @property
    def settings_entry(self) -> dict[str, Any]:
        """For the settings of a result."""
        shares = {row: round(share, 1) for row, share in self.shares.items()}
        joint = {"sigmas by which the physics moved": dict(self.shifts)} if self.shifts else {}
        return {"ridge": self.strength if self.kept else "none", "gain on blocks left out": self.gain,
                "its standard error": self.error, "share of each acceleration [%]": shares, **joint}  # fmt: skip

    @property
    def summary_text(self) -> str:
        """For a reader, in a line or two."""
        gained = f"{self.gain:.0f} +- {self.error:.0f} of log-likelihood on blocks left out"
        if not self.kept:
            return f"residual: none, the best would gain {gained}"
        parts = ", ".join(f"{name} {share:.0f} %" for name, share in self.shares.items())
        far = ", ".join(f"{name} by {by:+.0f} sigma" for name, by in self.shifts.items() if abs(by) > _FAR)
        joint = f"; with it the physics moves: {far}" if far else ""
        return f"residual: gains {gained} (ridge {self.strength:.3g}); its part of each acceleration: {parts}{joint}"


def none_found(vehicle: Vehicle, noise: Noise, gain: float, error: float) -> LinearResidual:
    """None, where the best would have gained so much."""
    return LinearResidual(vehicle, np.inf, gain, error, dict.fromkeys(ROWS, 0.0), noise)


def units_of(names: Mapping[str, tuple[str, str]], columns: Mapping[str, Array], acting: Mapping[str, Array]) -> Array:
    """Of each coefficient, how often one makes an acceleration as large as the disturbance that the filter saw."""
    return np.array([np.sqrt(np.mean(columns[c] ** 2)) / np.std(acting[r]) for r, c in names.values()])


def with_coefficients(vehicle: Vehicle, values: Mapping[str, float], sigma: Array, source: str) -> Vehicle:
    """The vehicle with its residual's coefficients as found."""
    card = vehicle.card
    for (name, value), spread in zip(values.items(), sigma.tolist(), strict=True):
        card = card.with_values({name: float(value)}, status="identified", sigma=spread, source=source)
    return vehicle.with_card(card)


def shares(vehicle: Vehicle, columns: Mapping[str, Array], total: Mapping[str, Array]) -> dict[str, float]:
    """Of each acceleration's root mean square, the residual's part [%]."""
    card, parts = vehicle.card.values(), dict.fromkeys(ROWS, np.zeros(1))
    for name, (row, column) in coefficients(vehicle).items():
        parts[row] = parts[row] + card[name] * columns[column]
    return {row: 100.0 * float(np.std(part) / np.std(total[row])) for row, part in parts.items()}


def kept(nuisance: Nuisance) -> tuple[Free, ...]:
    """Trims and accelerations that a flight has of its own, as constants that a likelihood of it keeps."""
    return tuple(
        trim_of_record(name)
        for name, value in nuisance._asdict().items()
        if name.startswith(("trim_motor", "push")) and float(value)
    )


def ran(likelihood: FilterError) -> Filtered:
    """The filter along a block, without a residual."""
    return likelihood.runs(likelihood.row.starts())[0]


def seen_along(likelihoods: Sequence[FilterError]) -> tuple[dict[str, Array], dict[str, Array]]:
    """By name: what the coefficients multiply, and the disturbances that the filter saw, along all blocks."""
    columns: list[dict[str, Array]] = []
    disturbances: list[Array] = []
    for likelihood in likelihoods:
        run, counted, vehicle = ran(likelihood), likelihood.counted[0], likelihood.table.vehicle
        about = list(counted_from(vehicle).values())
        states = {name: np.asarray(run.states.x)[counted, vehicle.index(name)] for name in vehicle.state_names}
        states[HEADING] = states[HEADING] - heading_counted(vehicle)
        columns.append(states | dict(zip(vehicle.input_names, (run.commands - about)[counted].T, strict=True)))
        acting = np.asarray(run.states.gust)[counted, :N_DISTURBANCES] + np.asarray(run.states.drift)[counted]
        disturbances.append(acting - acting.mean(axis=0))
    joined = {name: np.concatenate([each[name] for each in columns]) for name in columns[0]}
    return joined, dict(zip(DISTURBED, np.concatenate(disturbances).T, strict=True))


def accelerations_along(likelihoods: Sequence[FilterError]) -> dict[str, Array]:
    """Rates of the disturbed states along the filtered motion, by name."""
    rates = []
    for likelihood in likelihoods:
        vehicle = likelihood.table.vehicle
        states = np.asarray(ran(likelihood).states.x)[:, [vehicle.index(name) for name in DISTURBED]]
        rates.append(np.gradient(states, likelihood.model.dt, axis=0)[likelihood.counted[0]])
    return dict(zip(DISTURBED, np.concatenate(rates).T, strict=True))


def beside_physics(table: Parameterization, residual: LinearResidual) -> Parameterization:
    """What a fit has free, then the coefficients of its residual with the ridge as their priors."""
    spread = residual.strength**-0.5
    free = tuple(
        Free(name, unit, 0.0, spread * unit, source="ridge of the residual") for name, unit in residual.units.items()
    )
    return replace(table, vehicle=begun(table.vehicle, residual), free=(*table.free, *free))


def begun(vehicle: Vehicle, residual: LinearResidual) -> Vehicle:
    """A vehicle with coefficients that are still zero, counted from where those of a residual are."""
    return with_residual(vehicle, counted_from(residual.vehicle))


def begun_where_it_ended(row: Row, alone: Row, reached: Array, residual: LinearResidual) -> Array:
    """The scaled row with everything free: records and noise as found alone, physics and residual as found together."""
    known = dict(zip(alone.names, (reached * alone.scale).tolist(), strict=True))
    known |= {name: entry.value for name, entry in residual.vehicle.card.parameters.items() if name in row.names}
    return np.array([known[name] for name in row.names]) / row.scale


def physics_shifts(alone: Solved, together: Solved) -> dict[str, float]:
    """How far the physics moved, in standard deviations of what is free with the residual."""
    sigma = np.sqrt(np.maximum(np.diag(together.scaled(together.corrected)), 1e-300))
    names = [alone.row.names[i] for i in alone.places]
    return {name: (together.numbers[name] - alone.numbers[name]) / float(sigma[i]) for i, name in enumerate(names)}
