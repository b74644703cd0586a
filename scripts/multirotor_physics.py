"""Errors ahead on training flights of predictors with a residual that stand on different physics: which one to take.

    python scripts/multirotor_physics.py FIT.json FIT.json --fit FLIGHT ...

FIT.json is what `swash identify ... --horizon FIRST,LAST --residual --out FOLDER` wrote, FLIGHT what it was given. The
rule is the one by which such a fit chooses how fast its drifts wander (`identification.time.residual_fit`): half the
sum of squared errors ahead over all blocks of the training flights. So that two physics can be compared, the errors of
all are divided by those of the first one without its residual. Beside it: the same on blocks and on flights that are
left out, so that the residual was not learnt from them (by the fit's own drifts, to second order). No other flight is
looked at.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

import swashplate as sp
from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.readers.read import read
from swashplate.identification.core.multi_step import Horizon
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.result import Result
from swashplate.identification.time import residual_fit
from swashplate.identification.time.identify import SHORTEST
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.identification.time.residual_strength import chosen_strength, shrunk
from swashplate.models.residual import coefficients
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.compilation import enable_compilation_cache
from swashplate.simulation.dynamics import enable_double_precision


def blocks_of(fit: Result[Vehicle, object], names: Sequence[str]) -> list[tuple[Record, Nuisance]]:
    """The training flights in blocks, each with its flight's constants."""
    made: list[tuple[Record, Nuisance]] = []
    for flight in (read(name).condition(rate=100.0, cutoff=0.0) for name in names):
        for piece in records((flight,), fit.model, outputs=fit.settings["outputs"]):
            if piece.time[-1] - piece.time[0] >= SHORTEST:
                own = {one.name: one.value for one in fit.constants if one.record == piece.log}
                nuisance = fit.nuisance._replace(**own)
                made += [(block, nuisance) for block in residual_fit._blocks(piece)]
    return made


def left_out(fit: Result[Vehicle, object], blocks: Sequence[tuple[Record, Nuisance]], horizon: Horizon,
             sizes: Sequence[Array]) -> tuple[Array, Array]:  # fmt: skip
    """Cost of each block by residuals that were learnt from the other blocks, and from the other flights."""
    names = coefficients(fit.model)
    values = fit.model.card.values()
    table = Parameterization(fit.model.with_values(dict.fromkeys(names, 0.0)), tuple(Free(name, 1.0) for name in names))
    likelihoods = [
        PredictionError(table, [block], noise=fit.noise, estimate_noise=False, nuisance=nuisance)
        for block, nuisance in blocks
    ]
    columns, seen = residual_fit._seen(likelihoods)
    unit = np.array([np.sqrt(np.mean(columns[c] ** 2)) / np.std(seen[r]) for r, c in names.values()])
    at = np.array([values[name] for name in names]) * unit
    told = []
    for likelihood, size in zip(likelihoods, sizes, strict=True):
        ahead = residual_fit._AheadErrors(likelihood, horizon, size=size)
        told.append(ahead.block(at, unit, ahead.cost(np.zeros(unit.size))))
    strength = chosen_strength(told)[0]
    logs = [block.log for block, _ in blocks]

    def cost(i: int, others: Sequence[int]) -> float:
        return told[i].start - told[i].gain(shrunk([told[j] for j in others], strength)[0])

    every = range(len(told))
    one = [cost(i, [j for j in every if j != i]) for i in every]
    return np.array(one), np.array([cost(i, [j for j in every if logs[j] != logs[i]]) for i in every])


def errors(vehicle: Vehicle, noise: Noise, blocks: Sequence[tuple[Record, Nuisance]], horizon: Horizon) -> list[Array]:
    """Errors ahead of each block (starts, horizons, outputs)."""
    table = Parameterization(vehicle, ())
    made = []
    for block, nuisance in blocks:
        likelihood = PredictionError(table, [block], noise=noise, estimate_noise=False, nuisance=nuisance)
        made.append(residual_fit._AheadErrors(likelihood, horizon, size=np.ones(1)).errors(np.zeros(0)))
    return made


def main(fits: Sequence[str], flights: Sequence[str]) -> None:
    enable_double_precision()
    enable_compilation_cache()
    sizes: list[Array] = []
    first: dict[str, Array] = {}
    for name in fits:
        fit = sp.load(name)
        horizon, blocks = Horizon.of(fit.settings["horizon"]), blocks_of(fit, flights)
        bare = fit.model.with_values(dict.fromkeys(coefficients(fit.model), 0.0))
        alone, told = (
            errors(vehicle, noise, blocks, horizon)
            for vehicle, noise in ((bare, fit.noise), (fit.model, Noise(**fit.model.card.observer["noise"])))
        )
        sizes = sizes or [np.sqrt(np.mean(each**2, axis=0)) * each.shape[1] for each in alone]
        costs = {
            label: np.array([0.5 * np.sum((each / size) ** 2) for each, size in zip(made, sizes, strict=True)])
            for label, made in (("without its residual", alone), ("with it", told))
        }
        costs["blocks left out"], costs["flights left out"] = left_out(fit, blocks, horizon, sizes)
        first = first or costs
        print(f"{name}, {len(blocks)} blocks")
        for label, cost in costs.items():
            off = cost - first[label]
            error = np.std(off, ddof=1) * np.sqrt(off.size)
            print(f"  {label}: {cost.sum():.1f} (less the first: {off.sum():.1f} +- {error:.1f})")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fits", nargs="+", metavar="FIT.json")
    parser.add_argument("--fit", nargs="+", required=True, metavar="FLIGHT")
    given = parser.parse_args()
    main(given.fits, given.fit)
