"""Errors ahead on training flights of predictors with a residual that stand on different physics: which one to take.

    python scripts/multirotor_physics.py FIT.json FIT.json --fit FLIGHT ...

FIT.json is what `swash identify ... --horizon FIRST,LAST --residual --out FOLDER` wrote, FLIGHT what it was given. The
rule is the one by which such a fit chooses how fast its drifts wander (`identification.time.residual_ahead`): half the
sum of squared errors ahead over all blocks of the training flights, each met as a new flight. So that two physics can
be compared, the errors of all are divided by those of the first one without its residual. Beside it: the same on blocks
and on flights that are left out, so that the residual was not learnt from them (to second order). No other flight is
looked at.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

import swashplate as sp
from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.flights.readers.read import read
from swashplate.identification.core.multi_step import Horizon
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.result import Result
from swashplate.identification.time.identify import SHORTEST
from swashplate.identification.time.linear_residual import seen_along, units_of
from swashplate.identification.time.residual_ahead import FlightAhead
from swashplate.identification.time.residual_strength import chosen_strength, shrunk
from swashplate.models.residual import coefficients
from swashplate.models.vehicle import Vehicle

Sizes = list[list[Array]]


def pieces_of(fit: Result[Vehicle, object], names: Sequence[str]) -> list[Record]:
    """The training flights as the fit had them."""
    flights = [read(name).condition(rate=100.0, cutoff=0.0) for name in names]
    found = records(flights, fit.model, outputs=fit.settings["outputs"])
    return [piece for piece in found if piece.time[-1] - piece.time[0] >= SHORTEST]


def met(fit: Result[Vehicle, object], vehicle: Vehicle, noise: Noise, pieces: Sequence[Record], sizes: Sizes | None
        ) -> list[FlightAhead]:  # fmt: skip
    """The training flights as a vehicle meets a new flight."""
    horizon, trims = Horizon.of(fit.settings["horizon"]), fit.model.card.observer["trims"]
    each = sizes or [None] * len(pieces)
    return [
        FlightAhead(vehicle, piece, noise, fit.nuisance, trims=trims, horizon=horizon, sizes=size)
        for piece, size in zip(pieces, each, strict=True)
    ]


def costs(flights: Sequence[FlightAhead], factors: Array) -> Array:
    """By block."""
    return np.array([cost for flight in flights for cost in flight.costs(factors)])


def left_out(flights: Sequence[FlightAhead], factors: Array, size: Array) -> tuple[Array, Array]:
    """Cost of each block by residuals that were learnt from the other blocks, and from the other flights."""
    told = [(i, block) for i, flight in enumerate(flights) for block in flight.blocks(factors * size, size)]
    strength = chosen_strength([block for _, block in told])[0]

    def cost(i: int, others: Sequence[int]) -> float:
        block = told[i][1]
        return block.start - block.gain(shrunk([told[j][1] for j in others], strength)[0])

    every = range(len(told))
    one = [cost(i, [j for j in every if j != i]) for i in every]
    return np.array(one), np.array([cost(i, [j for j in every if told[j][0] != told[i][0]]) for i in every])


def main(fits: Sequence[str], flights: Sequence[str]) -> None:
    sizes: Sizes | None = None
    first: dict[str, Array] = {}
    for name in fits:
        fit = sp.load(name)
        pieces, names = pieces_of(fit, flights), coefficients(fit.model)
        factors = np.array([fit.model.card.values()[coefficient] for coefficient in names])
        bare = fit.model.with_values(dict.fromkeys(names, 0.0))
        alone = met(fit, bare, fit.noise, pieces, sizes)
        sizes = sizes or [flight.sizes for flight in alone]
        with_it = met(fit, fit.model, Noise(**fit.model.card.observer["noise"]), pieces, sizes)
        size = units_of(names, *seen_along([flight.likelihood for flight in alone]))
        none = np.zeros(len(names))
        by_label = {"without its residual": costs(alone, none), "with it": costs(with_it, factors)}
        by_label["blocks left out"], by_label["flights left out"] = left_out(with_it, factors, size)
        first = first or by_label
        print(f"{name}, {len(by_label['with it'])} blocks")
        for label, cost in by_label.items():
            off = cost - first[label]
            error = np.std(off, ddof=1) * np.sqrt(off.size)
            print(f"  {label}: {cost.sum():.1f} (less the first: {off.sum():.1f} +- {error:.1f})")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fits", nargs="+", metavar="FIT.json")
    parser.add_argument("--fit", nargs="+", required=True, metavar="FLIGHT")
    given = parser.parse_args()
    main(given.fits, given.fit)
