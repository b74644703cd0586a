"""The test bench as verbs: what to measure, records of the virtual bench, and a card from records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from swashplate.bench.evaluate import evaluate
from swashplate.bench.plan import planned
from swashplate.bench.record import BenchRecord
from swashplate.bench.record_files import read_records
from swashplate.bench.result import Bench
from swashplate.bench.virtual_bench import repeated, virtual_bench
from swashplate.models.vehicle import Vehicle


def evaluate_bench(*records: str | Path | BenchRecord, vehicle: Vehicle) -> Bench:
    """What bench records say of a vehicle's card.

    Args:
        records: files, folders with one file a record, data sets' names (coax56), or records themselves.
        vehicle: whose published card holds what the bench does not measure.

    Returns:
        The card with what was measured, its standard deviations, correlations, sources and procedures.

    Raises:
        BenchError: for a record that cannot be read, that no procedure knows, or that contradicts what it measures.
    """
    every: list[BenchRecord] = []
    for each in records:
        every += [each] if isinstance(each, BenchRecord) else read_records(str(each))
    return evaluate(every, vehicle)


def simulate_bench(
    vehicle: Vehicle, *, only: Sequence[str] = (), repeats: int = 1, seed: int = 0
) -> tuple[BenchRecord, ...]:
    """The records of the virtual bench: the vehicle held still, by the equations of flight.

    Args:
        vehicle: its card is the truth.
        only: procedures; all where empty.
        repeats: passes through the points of each record.
        seed: of noise, bias, drift and vibration.

    Raises:
        BenchError: for a procedure that is not known, or that is only for records that exist.
    """
    wanted = [repeated(record, repeats) for record in planned(vehicle, tuple(only))]
    return tuple(virtual_bench(vehicle, wanted, seed=seed))


def doubts(bench: Bench) -> tuple[str, ...]:
    """What the checks of a bench object to, each thing once."""
    words = [check.words for result in bench.details.results for check in result.checks if not check.good]
    words += [check.words for check in bench.details.disagreements if not check.good]
    return tuple(dict.fromkeys(words))


def document(bench: Bench) -> dict[str, Any]:
    """Numbers and words of a bench as JSON types."""
    return {
        "parameters": {name: vars(bench.model.card.parameters[name]) for name in bench.names},
        "kept": bench.details.kept,
        "doubts": list(doubts(bench)),
        "left_out": [words for result in bench.details.results for words in result.left_out],
        "findings": [
            {"name": f.name, "value": f.value, "sigma": f.sigma, "unit": f.unit}
            for result in bench.details.results
            for f in result.findings
        ],
        "tables": [vars(rows) for result in bench.details.results for rows in result.tables],
    }
