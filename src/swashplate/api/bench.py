"""The test bench as verbs: what to measure, records of the virtual bench, and a card from records."""

from __future__ import annotations

from typing import Any

from swashplate.bench.result import Bench


def doubts(bench: Bench) -> tuple[str, ...]:
    """What the checks of a bench object to, each thing once."""
    words = [check.text for result in bench.details.results for check in result.checks if not check.good]
    words += [check.text for check in bench.details.disagreements if not check.good]
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
