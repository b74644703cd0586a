"""The measurement plan: which records, how long, and how many repeats for a wanted accuracy.

The accuracy that one pass gives is what the procedures promise on the virtual bench; repeats divide the bound by the
square root of their number, as long as the sensor's calibration is better than what is asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.bench.evaluate import PROCEDURES, evaluate, hover_commands, schedules
from swashplate.bench.refusals import refuse_other_inputs
from swashplate.bench.virtual_bench import RecordSchedule, Setup, virtual_bench
from swashplate.errors import BenchError
from swashplate.models.vehicle import Vehicle
from swashplate.shown import Saved

MOST_REPEATS = 200
"""More passes than this are not a plan: the sensor or the input has to become better."""


@dataclass(frozen=True)
class Aim:
    """What is to be expected of one parameter.

    Attributes:
        name, unit: as on the card.
        value: the card's.
        sigma: standard deviation after one pass.
        repeats: passes for the wanted accuracy, None where they would be too many.
        procedures: that measure it.
    """

    name: str
    unit: str
    value: float
    sigma: float
    repeats: int | None
    procedures: tuple[str, ...]


@dataclass(frozen=True)
class MeasurementPlan(Saved):
    """The whole plan: records in the order in which to take them, and what they give."""

    records: tuple[RecordSchedule, ...]
    aims: tuple[Aim, ...]
    accuracy: float

    @property
    def duration(self) -> float:
        """Seconds of one pass."""
        return sum(record.duration for record in self.records)

    def to_document(self) -> dict[str, object]:
        """Records and aims as JSON types."""
        records = [
            {"record": r.name, "procedures": r.procedures, "seconds": r.duration, "points": r.about}
            for r in self.records
        ]
        return {"records": records, "parameters": [vars(aim) for aim in self.aims]}

    def __repr__(self) -> str:
        lines = [f"MeasurementPlan: {len(self.records)} records, {self.duration / 60.0:.0f} min a pass"]
        lines += [f"  {r.name}: {', '.join(r.procedures)}, {r.duration:.0f} s, {r.about}" for r in self.records]
        passes = ((a, "too many" if a.repeats is None else str(a.repeats)) for a in self.aims)
        lines += [f"  {a.name:22s} {a.value:12.5g} +- {a.sigma:8.2g} {a.unit}, passes: {n}" for a, n in passes]
        return "\n".join(lines)


def planned(vehicle: Vehicle, only: Sequence[str] = ()) -> list[RecordSchedule]:
    """The records of the whole bench, or of some procedures.

    Raises:
        BenchError: for a procedure that is not known, or that is only for records that exist, or another vehicle.
    """
    unknown = [name for name in only if name not in PROCEDURES]
    if unknown:
        raise BenchError(
            "there is no such procedure.", channel=", ".join(unknown), hint=f"Known are {', '.join(PROCEDURES)}."
        )
    refuse_other_inputs(vehicle)
    records = schedules(hover_commands(vehicle.card.values()))
    unplanned = set(only) - {name for record in records for name in record.procedures}
    if unplanned:
        raise BenchError(
            "is for records that exist; it has no plan.",
            channel=", ".join(sorted(unplanned)),
            hint="Evaluate them with `swash bench RECORDS`.",
        )
    return [record for record in records if not only or set(only) & set(record.procedures)]


def plan(
    vehicle: Vehicle, *, only: Sequence[str] = (), accuracy: float = 0.01, setup: Setup | None = None, seed: int = 0
) -> MeasurementPlan:
    """The plan for a vehicle.

    Args:
        only: procedures; all where empty.
        accuracy: wanted standard deviation over value.
        setup: what the bench is made of.
        seed: of the virtual bench.
    """
    records = planned(vehicle, only)
    bench = evaluate(virtual_bench(vehicle, records, setup=setup, seed=seed), vehicle)
    aims = []
    for name in bench.names:
        entry = vehicle.card.parameters[name]
        sigma = float(bench.model.card.parameters[name].sigma or 0.0)
        # An offset near zero is wanted as well as what it is an offset of.
        size = abs(vehicle.card.values()[name.replace("o_drive", "k_drive")])
        repeats = max(1, int(np.ceil((sigma / (accuracy * size)) ** 2)))
        by = tuple(result.procedure for result in bench.details.results if name in result.names)
        aims.append(Aim(name, entry.unit, entry.value, sigma, repeats if repeats <= MOST_REPEATS else None, by))
    return MeasurementPlan(tuple(records), tuple(aims), accuracy)
