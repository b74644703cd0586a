"""A bench, and one of its records, as tables for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from swashplate.bench.record import COLUMNS, BenchRecord
from swashplate.text_table import TextTable
from swashplate.text_table import text_columns as table

if TYPE_CHECKING:
    from swashplate.bench.result import Bench


def bench_tables(bench: Bench) -> Iterator[TextTable]:
    """The measured parameters against the published ones, the tables of the procedures, and the findings."""
    published = bench.start.card.parameters
    measured = {name: bench.model.card.parameters[name] for name in bench.names}
    if measured:
        rows = [
            (name, f"{published[name].value:.5g}", f"{e.value:.5g}", f"{2.0 * (e.sigma or 0.0):.2g}", e.unit, e.source)
            for name, e in measured.items()
        ]
        measured_table = table(
            ("parameter", "published", "measured", "+- 2 sigma", "unit", "source"), rows, words=(4, 5)
        )
        yield measured_table
    for result in bench.details.results:
        for shown in result.tables:
            yield table(shown.columns, shown.rows, left=0, title=f"\n{shown.title}")
    findings = [f for result in bench.details.results for f in result.findings]
    if findings:
        cells = [
            (f.name, f"{f.value:.4g}", f"{2.0 * f.sigma:.2g}" if math.isfinite(f.sigma) else "-", f.unit)
            for f in findings
        ]
        head = ("found beside the card", "value", "+- 2 sigma", "unit")
        yield table(head, cells, words=(3,), title=" " if measured else None)


def record_as_dict(record: BenchRecord) -> dict[str, object]:
    """What is in a record, as plain types for JSON."""
    return {
        "record": record.name,
        "procedures": record.procedures,
        "rows": _rows(record),
        "averaged": record.averaged,
        "rate": None if _timeless(record) else 1.0 / record.dt,
        "header": dict(record.header),
        "columns": {
            name: {"unit": COLUMNS[name][0], "low": float(values.min()), "high": float(values.max())}
            for name, values in record.channels.items()
        },
    }


def record_table(record: BenchRecord) -> TextTable:
    """Every column of a record with its unit, range and meaning."""
    rows = [
        (name, COLUMNS[name][0], f"{values.min():.5g}", f"{np.mean(values):.5g}", f"{values.max():.5g}",
         COLUMNS[name][1])
        for name, values in record.channels.items()
    ]  # fmt: skip
    head = ("column", "unit", "lowest", "mean", "highest", "what")
    return table(head, rows, left=2, words=(5,), title=f"{_heading(record)}\n")


def _heading(record: BenchRecord) -> str:
    kind = "averaged points" if record.averaged else "samples"
    time = "without a time base" if _timeless(record) else f"over {record['time'][-1] - record['time'][0]:.1f} s"
    notes = "; ".join(f"{key}: {value}" for key, value in record.header.items() if key != "averaged")
    head = f"{record.name}: bench record for {', '.join(record.procedures)}; {_rows(record)} {kind} {time}"
    return head + (f"\n{notes}" if notes else "")


def _timeless(record: BenchRecord) -> bool:
    return record.averaged or "time" not in record.channels


def _rows(record: BenchRecord) -> int:
    return int(next(iter(record.channels.values())).size) if record.channels else 0
