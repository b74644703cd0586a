"""The linear residual of a fit: what its errors still tell, shrunk as far as flights left out demand.

Physics, noise, filtered states and the records' constants stay where the fit has them; only the residual's coefficients
move, by Gauss-Newton from zero on what the fit itself made small: its innovations, or its errors some time ahead. Each
is held towards zero (ridge: Hoerl and Kennard 1970), in units in which one makes an acceleration as large as the
disturbance that the filter saw. How hard, says cross-validation over blocks of the training flights, and no residual is
kept where its gain on blocks left out may be chance (Student's t, 97.5 %). Nothing else is looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import DISTURBED, Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.multi_step import Horizon
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.time.innovations import Filtered
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.identification.time.record_filter import ahead_of
from swashplate.models.residual import ROWS, coefficients, with_residual
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.simulation.compilation import lengthened

BLOCK = 6.0
"""Seconds of a block that is left out, at least."""

FEWEST = 4
"""Blocks below which nothing can be left out to choose by."""

STRENGTHS = np.geomspace(1e5, 1e-1, 25)
"""Of the ridge, from strong to weak."""

_SURE = 0.975
"""Quantile of Student's t that the gain on blocks left out must exceed, in standard errors: a few blocks tell these
badly."""

_FASTER = (1.0, 3.0, 10.0, 30.0)
"""By what the drifts' wandering is multiplied to make errors ahead small."""

_ROUNDS, _BETWEEN = 8, 1.0
"""Gauss-Newton steps towards small errors ahead, and the ridge that they are taken with."""

_ASIDE = 1e-3
"""How far a coefficient is moved for a slope of errors ahead, in its scaled unit."""


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

    @property
    def told(self) -> dict[str, Any]:
        """For the settings of a result."""
        shares = {row: round(share, 1) for row, share in self.shares.items()}
        return {"ridge": self.strength if np.isfinite(self.strength) else "none", "gain on blocks left out": self.gain,
                "its standard error": self.error, "share of each acceleration [%]": shares}  # fmt: skip

    @property
    def words(self) -> str:
        """For a reader, in a line or two."""
        gained = f"{self.gain:.0f} +- {self.error:.0f} of log-likelihood on blocks left out"
        if not np.isfinite(self.strength):
            return f"residual: none, the best would gain {gained}"
        parts = ", ".join(f"{name} {share:.0f} %" for name, share in self.shares.items())
        return f"residual: gains {gained} (ridge {self.strength:.3g}); its part of each acceleration: {parts}"


@dataclass(frozen=True)
class LeftOutBlock:
    """A block's cost by the scaled coefficients, to second order about some.

    Attributes:
        start: cost without a residual.
        at: the coefficients (k,). cost, gradient, information: there.
    """

    start: float
    at: Array
    cost: float
    gradient: Array
    information: Array

    def gain(self, coefficients: Array) -> float:
        """Log-likelihood that coefficients gain."""
        away = coefficients - self.at
        return self.start - self.cost - float(self.gradient @ away + 0.5 * away @ self.information @ away)


def fit_residual(
    vehicle: Vehicle,
    pieces: Sequence[Record],
    nuisances: Sequence[Nuisance],
    noise: Noise,
    *,
    horizon: Horizon | None = None,
) -> LinearResidual:
    """The residual of an identified vehicle.

    Args:
        vehicle: with the numbers that the fit found.
        pieces: its records. nuisances: constants of each. noise: of the filter.
        horizon: that of the fit; None: innovations.

    Raises:
        IdentificationError: where the records make fewer than `FEWEST` blocks.
        CardError: for a vehicle that cannot have one.
    """
    cut = [(block, nuisance) for piece, nuisance in zip(pieces, nuisances, strict=True) for block in _blocks(piece)]
    if len(cut) < FEWEST:
        raise IdentificationError(
            f"the flights make {len(cut)} blocks of {BLOCK:g} s, a residual needs {FEWEST}: without blocks to leave "
            "out, nothing says how much of it is chance.",
            where=pieces[0].name,
            channel="residual",
            hint="Give longer flights, or leave --residual away.",
        )
    means = np.concatenate([piece.inputs for piece in pieces]).mean(axis=0)
    about = dict(zip(vehicle.input_names, means.tolist(), strict=True))
    wider = with_residual(vehicle, about, ahead=0.0 if horizon is None else horizon.last)
    names = coefficients(vehicle)
    table = Parameterization(wider, tuple(Free(name, 1.0) for name in names))
    likelihoods = [
        PredictionError(table, [block], noise=noise, estimate_noise=False, nuisance=nuisance) for block, nuisance in cut
    ]
    columns, seen = _seen(likelihoods)
    size = np.array([np.sqrt(np.mean(columns[c] ** 2)) / np.std(seen[r]) for r, c in names.values()])
    told = _one_step(likelihoods, size) if horizon is None else _ahead(likelihoods, size, horizon)
    strength, gain, error = chosen_strength(told)
    nothing = LinearResidual(vehicle, np.inf, gain, error, dict.fromkeys(ROWS, 0.0), noise)
    if not np.isfinite(strength):
        return nothing
    scaled, covariance = shrunk(told, strength)
    found, sigma = scaled / size, np.sqrt(np.diag(covariance)) / size
    checked = [_AheadErrors(each, horizon).cost(found) if horizon else _cost(each, found) for each in likelihoods]
    if not sum(checked) < sum(block.start for block in told):
        return nothing  # to second order it gained, and in fact it does not
    card = wider.card
    for name, value, spread in zip(names, found.tolist(), sigma.tolist(), strict=True):
        source = f"residual by {len(told)} blocks, ridge {strength:.3g}"
        card = card.with_values({name: value}, status="identified", sigma=spread, source=source)
    made = dict.fromkeys(ROWS, np.zeros(1))
    for value, (row, column) in zip(found, names.values(), strict=True):
        made[row] = made[row] + value * columns[column]
    total = _accelerations(likelihoods)
    shares = {row: 100.0 * float(np.std(part) / np.std(total[row])) for row, part in made.items()}
    made_of = wider.with_card(card)
    noise = noise if horizon is None else _wandering(made_of, cut, likelihoods, noise, horizon)
    return LinearResidual(made_of, strength, gain, error, shares, noise)


def _blocks(piece: Record) -> list[Record]:
    """A record cut into blocks of `BLOCK` seconds or a little more."""
    n = int((piece.time[-1] - piece.time[0]) // BLOCK)
    edges = np.linspace(0, piece.time.size, n + 1).astype(int) if n else np.zeros(1, dtype=int)
    return [
        replace(
            piece,
            name=f"{piece.name}, block {i + 1}",
            time=piece.time[a:b],
            inputs=piece.inputs[a:b],
            outputs=piece.outputs[a:b],
            voltage=piece.voltage[a:b],
        )
        for i, (a, b) in enumerate(pairwise(edges))
    ]


def _ran(likelihood: PredictionError) -> Filtered:
    """The filter along a block, without a residual."""
    return likelihood.runs(likelihood.row.starts())[0]


def _seen(likelihoods: Sequence[PredictionError]) -> tuple[dict[str, Array], dict[str, Array]]:
    """By name: what the coefficients multiply, and the disturbances that the filter saw, along all blocks."""
    columns: list[dict[str, Array]] = []
    seen: list[Array] = []
    for likelihood in likelihoods:
        run, counted, vehicle = _ran(likelihood), likelihood.counted[0], likelihood.table.vehicle
        about = [vehicle.card.values()[f"residual_at_{name}"] for name in vehicle.input_names]
        states = {name: np.asarray(run.states.x)[counted, vehicle.index(name)] for name in vehicle.state_names}
        columns.append(states | dict(zip(vehicle.input_names, (run.commands - about)[counted].T, strict=True)))
        acting = np.asarray(run.states.gust)[counted, :N_DISTURBANCES] + np.asarray(run.states.drift)[counted]
        seen.append(acting - acting.mean(axis=0))
    joined = {name: np.concatenate([each[name] for each in columns]) for name in columns[0]}
    return joined, dict(zip(DISTURBED, np.concatenate(seen).T, strict=True))


def _accelerations(likelihoods: Sequence[PredictionError]) -> dict[str, Array]:
    """Rates of the disturbed states along the filtered motion, by name."""
    made = []
    for likelihood in likelihoods:
        vehicle = likelihood.table.vehicle
        states = np.asarray(_ran(likelihood).states.x)[:, [vehicle.index(name) for name in DISTURBED]]
        made.append(np.gradient(states, likelihood.model.dt, axis=0)[likelihood.counted[0]])
    return dict(zip(DISTURBED, np.concatenate(made).T, strict=True))


# ---- one step --------------------------------------------------------------------------------------------------------
def _one_step(likelihoods: Sequence[PredictionError], size: Array) -> list[LeftOutBlock]:
    """Innovations, linear in accelerations as small as these."""
    made = []
    for likelihood in likelihoods:
        cost, gradient, information = likelihood.scores(likelihood.row.starts())
        places, scale = likelihood.row.places("parameter"), 1.0 / size
        hessian = information[np.ix_(places, places)] * np.outer(scale, scale)
        made.append(LeftOutBlock(cost, np.zeros(size.size), cost, gradient[places] * scale, hessian))
    return made


def _cost(likelihood: PredictionError, found: Array) -> float:
    """Cost of the innovations at coefficients, whose scale in the row is one."""
    row = likelihood.row.starts()
    row[likelihood.row.places("parameter")] = found
    return likelihood.cost(row)


# ---- some time ahead -------------------------------------------------------------------------------------------------
class _AheadErrors:
    """Errors ahead of a block's filtered states, over their size without a residual, by the coefficients.

    Weighed so that predictions which do not overlap count as one each.
    """

    def __init__(self, likelihood: PredictionError, horizon: Horizon, *, size: Array | None = None) -> None:
        self._likelihood, self._run = likelihood, _ran(likelihood)
        self._steps = np.array(horizon.samples(likelihood.model.dt))
        first = int(np.argmax(likelihood.counted[0]))
        n = likelihood.pieces[0].time.size
        self._starts = np.arange(first, n - self._steps[-1] - 1, self._steps[0])
        self.size = np.ones(1) if size is None else size
        if size is None:
            errors = self.errors(np.zeros(len(likelihood.table.free)))
            self.size = np.sqrt(np.mean(errors**2, axis=0)) * self._steps.size

    def errors(self, found: Array) -> Array:
        """(starts, horizons, outputs)."""
        model, piece, ahead = self._likelihood.model, self._likelihood.pieces[0], int(self._steps[-1])
        parameters = np.array(self._likelihood.table.layout.values(self._likelihood.table.card_row, found))
        numbers = self._run.numbers._replace(parameters=parameters)
        n = piece.time.size + ahead
        told = lengthened(self._run.commands, n), lengthened(piece.voltage, n)
        states = ahead_of(model, self._run.states, numbers, *told, self._starts, ahead)[:, self._steps - 1]
        predicted = model.measure(np.moveaxis(states, -1, 0), Nuisance(*numbers.nuisance), ArrayBackend())
        measured = piece.outputs[self._starts[:, None] + self._steps]
        return np.asarray((measured - np.moveaxis(predicted, 0, -1)) / self.size)

    def cost(self, found: Array) -> float:
        return 0.5 * float(np.sum(self.errors(found) ** 2))

    def block(self, scaled: Array, size: Array, start: float) -> LeftOutBlock:
        here = self.errors(scaled / size)
        moves = _ASIDE * np.eye(size.size)
        slopes = np.stack([(self.errors((scaled + move) / size) - here).ravel() / _ASIDE for move in moves])
        return LeftOutBlock(start, scaled, 0.5 * float(np.sum(here**2)), slopes @ here.ravel(), slopes @ slopes.T)


def _ahead(likelihoods: Sequence[PredictionError], size: Array, horizon: Horizon) -> list[LeftOutBlock]:
    """Errors ahead near their minimum under a weak ridge: over half a second no effect is linear any more."""
    errors = [_AheadErrors(likelihood, horizon) for likelihood in likelihoods]
    at = np.zeros(size.size)
    starts = [each.cost(at) for each in errors]
    lowest, held = sum(starts), _BETWEEN
    told = [each.block(at, size, start) for each, start in zip(errors, starts, strict=True)]
    for _ in range(_ROUNDS):
        tried, _ = shrunk(told, held)
        cost = sum(each.cost(tried / size) for each in errors) + 0.5 * _BETWEEN * float(tried @ tried)
        if not cost < lowest:
            held *= 10.0
            continue
        done, lowest, at = lowest - cost < 0.5, cost, tried
        told = [each.block(at, size, start) for each, start in zip(errors, starts, strict=True)]
        if done:
            break
    return told


def _wandering(
    vehicle: Vehicle,
    cut: Sequence[tuple[Record, Nuisance]],
    before: Sequence[PredictionError],
    noise: Noise,
    horizon: Horizon,
) -> Noise:
    """The noise whose drifts wander as fast as makes the errors ahead smallest: one step says little of that."""
    table = Parameterization(vehicle, ())
    sizes = [_AheadErrors(likelihood, horizon).size for likelihood in before]
    drifts = [name for name in noise._fields if name.startswith("drift")]

    def cost(faster: float) -> tuple[float, Noise]:
        tried = noise._replace(**{name: faster * getattr(noise, name) for name in drifts})
        total = 0.0
        for (block, nuisance), size in zip(cut, sizes, strict=True):
            likelihood = PredictionError(table, [block], noise=tried, estimate_noise=False, nuisance=nuisance)
            total += _AheadErrors(likelihood, horizon, size=size).cost(np.zeros(0))
        return total, tried

    return min((cost(faster) for faster in _FASTER), key=lambda one: one[0])[1]


# ---- how much of it --------------------------------------------------------------------------------------------------
def shrunk(told: Sequence[LeftOutBlock], strength: float) -> tuple[Array, Array]:
    """Scaled coefficients (k,) and their covariance (k, k) from some blocks."""
    information = sum((block.information for block in told), start=np.zeros_like(told[0].information))
    covariance: Array = np.asarray(np.linalg.inv(information + strength * np.eye(len(information))), dtype=np.float64)
    slope = sum((block.gradient - block.information @ block.at for block in told), start=np.zeros(len(information)))
    return -covariance @ slope, covariance


def chosen_strength(told: Sequence[LeftOutBlock]) -> tuple[float, float, float]:
    """Strength by blocks left out, what they gain, and its standard error; infinite where that is nothing."""
    from scipy.stats import t as student

    gains = np.array(
        [
            [block.gain(shrunk([*told[:i], *told[i + 1 :]], strength)[0]) for i, block in enumerate(told)]
            for strength in STRENGTHS
        ]
    )
    total, error = gains.sum(axis=1), np.std(gains, axis=1, ddof=1) * np.sqrt(len(told))
    best = int(np.argmax(total))
    if total[best] <= student.ppf(_SURE, len(told) - 1) * error[best]:
        return np.inf, float(total[best]), float(error[best])
    return float(STRENGTHS[best]), float(total[best]), float(error[best])
