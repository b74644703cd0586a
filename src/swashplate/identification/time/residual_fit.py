"""The linear residual of a fit: what its errors still tell, shrunk as far as flights left out demand.

Noise, filtered states and the records' constants stay where the fit has them; the residual's coefficients move, by
Gauss-Newton from zero on what the fit itself made small: its innovations, or its errors some time ahead. Of innovations
the physics moves too: while it stood alone, it took over what the residual is for. Each coefficient is held towards
zero, in units in which one makes an acceleration as large as the disturbance that the filter saw; how hard, blocks left
out say (`residual_strength`). A block begins without the accelerations that its flight has of its own (`push_*`): its
drifts find them (docs/decisions/0143).

Blocks tell chance from what is always there, not what causes it. Of innovations, only accelerations of axes that a
flight moves by itself have coefficients: elsewhere a steady error of a log looks like an effect of what the controller
answers with. From what was found here, the search of a fit goes on with everything free (`residual_joint`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
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
from swashplate.identification.time.feedback import by_itself
from swashplate.identification.time.flight_details import AxisExcitation
from swashplate.identification.time.innovations import Filtered
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.identification.time.record_filter import ahead_of
from swashplate.identification.time.residual_strength import ALONE, LeftOutBlock, Physics, chosen_strength, shrunk
from swashplate.models.residual import ROWS, coefficients, with_residual
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.simulation.compilation import lengthened

BLOCK = 6.0
"""Seconds of a block that is left out, at least."""

FEWEST = 4
"""Blocks below which nothing can be left out to choose by."""

_AXIS = {"u": "pitch", "v": "roll", "w": "heave", "p": "roll", "q": "pitch", "r": "yaw"}
"""The axis whose commands move each acceleration."""

_FASTER = (1.0, 3.0, 10.0, 30.0)
"""By what the drifts' wandering is multiplied to make errors ahead small."""

_FAR = 2.0
"""Standard deviations beyond which a parameter that moved is named."""

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
    units: Mapping[str, float] = field(default_factory=dict)
    along: tuple[Mapping[str, Array], Mapping[str, Array]] = field(default=({}, {}), repr=False, compare=False)
    moved: Mapping[str, float] = field(default_factory=dict)

    @property
    def kept(self) -> bool:
        return bool(np.isfinite(self.strength))

    def at(self, vehicle: Vehicle, moved: Mapping[str, float]) -> LinearResidual:
        """The same with what a search found for physics and residual together, and how far that moved the physics."""
        return replace(self, vehicle=vehicle, moved=moved, shares=_shares(vehicle, *self.along))

    @property
    def told(self) -> dict[str, Any]:
        """For the settings of a result."""
        shares = {row: round(share, 1) for row, share in self.shares.items()}
        joint = {"sigmas by which the physics moved": dict(self.moved)} if self.moved else {}
        return {"ridge": self.strength if self.kept else "none", "gain on blocks left out": self.gain,
                "its standard error": self.error, "share of each acceleration [%]": shares, **joint}  # fmt: skip

    @property
    def words(self) -> str:
        """For a reader, in a line or two."""
        gained = f"{self.gain:.0f} +- {self.error:.0f} of log-likelihood on blocks left out"
        if not self.kept:
            return f"residual: none, the best would gain {gained}"
        parts = ", ".join(f"{name} {share:.0f} %" for name, share in self.shares.items())
        far = ", ".join(f"{name} by {by:+.0f} sigma" for name, by in self.moved.items() if abs(by) > _FAR)
        joint = f"; with it the physics moves: {far}" if far else ""
        return f"residual: gains {gained} (ridge {self.strength:.3g}); its part of each acceleration: {parts}{joint}"


def fit_residual(
    vehicle: Vehicle,
    pieces: Sequence[Record],
    nuisances: Sequence[Nuisance],
    noise: Noise,
    *,
    horizon: Horizon | None = None,
    axes: Sequence[AxisExcitation] = (),
    physics: Parameterization | None = None,
) -> LinearResidual:
    """The residual of an identified vehicle.

    Args:
        vehicle: with the numbers that the fit found.
        pieces: its records. nuisances: constants of each. noise: of the filter.
        horizon: that of the fit; None: innovations.
        axes: what each record moves; accelerations of axes that none moves by itself get none (with a horizon all do:
            such a residual is the controller's answers on purpose). Empty: not judged.
        physics: what of the vehicle moves with it (not with a horizon); None: nothing.

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
    still = set() if horizon else {row for row, axis in _AXIS.items() if not _moved(axis, axes)}
    names = {name: pair for name, pair in coefficients(vehicle).items() if pair[0] not in still}
    if not names:
        return LinearResidual(vehicle, np.inf, 0.0, 0.0, dict.fromkeys(ROWS, 0.0), noise)
    beside = () if physics is None or horizon else tuple(replace(free, start=None) for free in physics.free)
    table = Parameterization(
        wider,
        (*beside, *(Free(name, 1.0) for name in names)),
        physics.ties if physics and beside else (),
        prior_card=physics.prior_card if physics and beside else None,
    )
    likelihoods = [
        PredictionError(table, [block], noise=noise, estimate_noise=False, nuisance=nuisance) for block, nuisance in cut
    ]
    columns, seen = _seen(likelihoods)
    size = np.array([np.sqrt(np.mean(columns[c] ** 2)) / np.std(seen[r]) for r, c in names.values()])
    told, others = (_one_step(likelihoods, size), _priors(likelihoods[0], len(beside))) if horizon is None else (
        _ahead(likelihoods, size, horizon), ALONE)  # fmt: skip
    strength, gain, error = chosen_strength(told, others)
    nothing = LinearResidual(vehicle, np.inf, gain, error, dict.fromkeys(ROWS, 0.0), noise)
    if not np.isfinite(strength):
        return nothing
    away, covariance = shrunk(told, strength, others)
    k = len(beside)
    factors, sigma = away[k:] / size, np.sqrt(np.diag(covariance))[k:] / size
    checked = [
        _AheadErrors(each, horizon).cost(factors) if horizon else _cost(each, np.concatenate([away[:k], factors]))
        for each in likelihoods
    ]
    if not sum(checked) < sum(block.start for block in told):
        return nothing  # to second order it gained, and in fact it does not
    row = likelihoods[0].row
    low, high = row.bounds()
    at = np.clip(row.starts()[:k] + away[:k], low[:k], high[:k]) * row.scale[:k]
    told_by = table.identified(np.concatenate([at, factors]))
    card = wider.card.with_values({name: value for name, value in told_by.items() if name not in names})
    for name, value, spread in zip(names, factors.tolist(), sigma.tolist(), strict=True):
        source = f"residual by {len(told)} blocks, ridge {strength:.3g}"
        card = card.with_values({name: value}, status="identified", sigma=spread, source=source)
    made_of, along = wider.with_card(card), (columns, _accelerations(likelihoods))
    noise = noise if horizon is None else _wandering(made_of, cut, likelihoods, noise, horizon)
    units = dict(zip(names, (1.0 / size).tolist(), strict=True))
    return LinearResidual(made_of, strength, gain, error, _shares(made_of, *along), noise, units, along)


def _moved(axis: str, judged: Sequence[AxisExcitation]) -> bool:
    """Whether a record moves an axis by itself, or none was judged."""
    mine = [one for one in judged if one.axis == axis]
    return not mine or any(by_itself(one) for one in mine)


def _shares(vehicle: Vehicle, columns: Mapping[str, Array], total: Mapping[str, Array]) -> dict[str, float]:
    """Of each acceleration's root mean square, the residual's part [%]."""
    card, made = vehicle.card.values(), dict.fromkeys(ROWS, np.zeros(1))
    for name, (row, column) in coefficients(vehicle).items():
        made[row] = made[row] + card[name] * columns[column]
    return {row: 100.0 * float(np.std(part) / np.std(total[row])) for row, part in made.items()}


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
    """Innovations, linear in accelerations as small as these, and in the physics."""
    made = []
    for likelihood in likelihoods:
        cost, gradient, information = likelihood.scores(likelihood.row.starts())
        places = likelihood.row.places("parameter")
        scale = np.concatenate([np.ones(places.size - size.size), 1.0 / size])
        hessian = information[np.ix_(places, places)] * np.outer(scale, scale)
        made.append(LeftOutBlock(cost, np.zeros(places.size), cost, gradient[places] * scale, hessian))
    return made


def _priors(likelihood: PredictionError, k: int) -> Physics:
    """Of the first k parameters of a row, where they stand."""
    _, pull, information = likelihood.row.prior(likelihood.row.starts())
    return Physics(pull[:k], information[:k, :k])


def _cost(likelihood: PredictionError, away: Array) -> float:
    """Cost of the innovations with physics moved, and at coefficients, whose scale in the row is one."""
    row = likelihood.row.starts()
    row[likelihood.row.places("parameter")] += away
    low, high = likelihood.row.bounds()
    return likelihood.cost(np.clip(row, low, high))


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

    def errors(self, factors: Array) -> Array:
        """(starts, horizons, outputs)."""
        model, piece, ahead = self._likelihood.model, self._likelihood.pieces[0], int(self._steps[-1])
        parameters = np.array(self._likelihood.table.layout.values(self._likelihood.table.card_row, factors))
        numbers = self._run.numbers._replace(parameters=parameters)
        n = piece.time.size + ahead
        told = lengthened(self._run.commands, n), lengthened(piece.voltage, n)
        states = ahead_of(model, self._run.states, numbers, *told, self._starts, ahead)[:, self._steps - 1]
        predicted = model.measure(np.moveaxis(states, -1, 0), Nuisance(*numbers.nuisance), ArrayBackend())
        measured = piece.outputs[self._starts[:, None] + self._steps]
        return np.asarray((measured - np.moveaxis(predicted, 0, -1)) / self.size)

    def cost(self, factors: Array) -> float:
        return 0.5 * float(np.sum(self.errors(factors) ** 2))

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
