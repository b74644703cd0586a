"""Choice of what a fit frees and how far ahead it looks, by blocked cross-validation inside one flight: a table.

    python research/choose_by_blocks.py august|july [CHOICE ...]

Each third of the flight's longest record is predicted by what the other two taught, with their delays, trims and noise;
no other flight is looked at. Some minutes of processor time. The table is in real-flights.md.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from flights import CHANNELS, FLIGHTS

import swashplate as sp
from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance, mean_nuisance
from swashplate.identification.core.multi_step import Horizon
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.scoring import minimise_over_valleys
from swashplate.identification.estimators import Question
from swashplate.identification.time.estimates import solved_ahead, solved_at
from swashplate.identification.time.feedback import AxisExcitation, excitation, hold_unexcited
from swashplate.identification.time.filter_error import SETTLING
from swashplate.identification.time.identify import FILTER_ERROR, FlightProblem
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.vehicle import Vehicle
from swashplate.validation.prediction import ObservedRecord


class Choice(NamedTuple):
    """What is freed, horizons after the likelihood, and what else the fit is asked."""

    free: str
    horizons: tuple[tuple[float, float], ...] = ()
    asked: Question = Question()


CHOICES: dict[str, Choice] = {
    "full": Choice("full"),
    "balanced": Choice("balanced", ((0.25, 1.0), (0.25, 2.0))),
    "asymmetric": Choice("asymmetric", ((0.25, 2.0),)),
    "wind": Choice("balanced", ((0.25, 1.0),), Question(wind=True)),
}
HELD = ("full",)
"""Of these, what only an axis could tell that the flight does not move by itself is held, as by default."""
BLOCKS, AHEAD, EVERY = 3, 1.0, 0.05
JUDGED = ("phi", "theta", "p", "q")
"""Their mean decides."""

Learnt = tuple[str, Vehicle, Noise, Nuisance]


def block(record: Record, number: int) -> Record:
    """One of the equal parts of a record."""
    edges = np.linspace(0, record.time.size, BLOCKS + 1).astype(int)
    rows = slice(edges[number], edges[number + 1])
    parts = {name: getattr(record, name)[rows] for name in ("time", "inputs", "outputs", "voltage")}
    return replace(record, name=f"{record.name}, part {number + 1}", **parts)


def learnt(
    coax: Vehicle,
    choice: Choice,
    pieces: list[Record],
    axes: Sequence[AxisExcitation],
) -> Iterator[Learnt]:
    """What the likelihood finds in the pieces, and what each horizon makes of it."""
    table = parameterize(coax, choice.free)
    if choice.free in HELD:
        table, _ = hold_unexcited(table, axes)
    problem = FlightProblem("filter-error", coax, (), table, pieces, choice.asked, axes, ())
    likelihood = problem.likelihood_of(table)
    solver = FILTER_ERROR.kind.solver
    first = solved_at(likelihood, minimise_over_valleys(likelihood, solver))
    solutions = {"likelihood": first}
    for ahead in choice.horizons:
        name = f"{ahead[0]:g} to {ahead[1]:g} s ahead, beside the likelihood"
        solutions[name] = solved_ahead(first, Horizon(*ahead), solver, settling=SETTLING)
    for name, solved in solutions.items():
        vehicle, row = coax.with_values(solved.identified(table)), solved.full_row
        yield name, vehicle, likelihood.noise_of(row), mean_nuisance(likelihood.nuisances_of(row))


def errors(vehicle: Vehicle, record: Record, noise: Noise, nuisance: Nuisance) -> tuple[Array, Array]:
    """Squared errors and squared movements (starts, 12)."""
    paths = ObservedRecord(vehicle, record, noise=noise, nuisance=nuisance).predict(
        horizon=AHEAD, every=EVERY, settling=SETTLING
    )
    truth, ahead = measured_states(record, nuisance), round(AHEAD / record.dt)
    counted = paths.starts + ahead < record.time.size - 10  # rates at the end are one-sided
    first = paths.starts[counted]
    return (paths.states[counted, ahead - 1] - truth[first + ahead]) ** 2, (truth[first + ahead] - truth[first]) ** 2


def main(flight: str, *names: str) -> int:
    coax = sp.vehicle("coax")
    pieces = records(sp.read(FLIGHTS[flight]).condition(rate=100.0, cutoff=0.0), coax)
    whole = max(pieces, key=lambda piece: piece.time.size)
    axes = excitation(coax, whole, measured_states(whole, Nuisance()))
    print(f"| in {flight.capitalize()} | criterion | {' | '.join(CHANNELS)} | mean of {', '.join(JUDGED)} |")
    print("|" + " --- |" * (3 + len(CHANNELS)))
    for choice in names or CHOICES:
        made: dict[str, list[tuple[Array, Array]]] = {}
        for left in range(BLOCKS):
            others = [block(whole, i) for i in range(BLOCKS) if i != left]
            for name, *model in learnt(coax, CHOICES[choice], others, axes):
                made.setdefault(name, []).append(errors(model[0], block(whole, left), *model[1:]))
        for name, parts in made.items():
            wrong, moved = (np.concatenate(part).mean(axis=0) for part in zip(*parts, strict=True))
            fit = dict(zip(PREDICTED, 100.0 * (1.0 - np.sqrt(wrong / moved)), strict=True))
            mean = float(np.mean([fit[c] for c in JUDGED]))
            print(f"| `{choice}` | {name} | {' | '.join(f'{fit[c]:.0f}' for c in CHANNELS)} | {mean:.1f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
