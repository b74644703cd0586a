"""`swash derivatives --published`: a card's derivatives beside a report's, and what the report may assume."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from swashplate.cli import conditions as given
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.simulation.published import PublishedComparison
    from swashplate.simulation.trim import Trim


def compare(asked: given.Conditions, at: Trim, path: Path, *, primed: bool, json: bool) -> None:
    """Reads the file, compares, and prints tables or JSON.

    Raises:
        SwashError: for a file that cannot be read, or a flight that turns.
    """
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table as tabulate
    from swashplate.models.published import read_published
    from swashplate.simulation.published import hold_against

    if at.turn:
        raise SwashError("takes straight flight.", channel="--published", hint="Leave out --turn.")
    sense = getattr(asked.vehicle.options, "sense", 1.0)
    flight = {name: at.states().get(name, 0.0) for name in ("u", "v", "w")}
    found = hold_against(asked.vehicle, at, read_published(path, sense=sense, flight=flight), primed=primed)
    if json:
        typer.echo(as_json({"vehicle": asked.name, "speed": at.speed, "published": str(path), **_document(found)}))
        return
    head, rows = _rows(found)
    typer.echo(f"At {at.speed:g} m/s, published in {path} (small: below 2 % of the largest of its kind)")
    console().print(tabulate(head, rows, left=2))
    steps = [(s.words or "the card", f"{100 * s.mean:.1f} %", f"{s.near} of {len(rows)}") for s in found.steps]
    typer.echo("\nMean difference (each at most 100 %), and derivatives within 10 %:")
    console().print(tabulate(("with, one after another", "mean", "within 10 %"), steps))


def _rows(found: PublishedComparison) -> tuple[list[str], list[list[str]]]:
    from swashplate.models.conventional.derivative_table import split_name, unit

    first, last = found.steps[0].table, found.steps[-1].table
    before, after = found.differences(first), found.differences(last)
    more = len(found.steps) > 1
    head = ["derivative", "unit", "published", "card", "off", *(["nearest", "off"] if more else []), *last.parts]
    rows = []
    for name, value in found.published.items():
        row, column = split_name(name)
        small = abs(value) < found.scale[name]
        cells = [name, unit(name), f"{value:.4g}", f"{first[name]:.4g}", _off(before[name], small)]
        if more:
            cells += [f"{last[name]:.4g}", _off(after[name], small)]
        rows.append(
            [*cells, *(f"{part[row, column]:.3g}" if part[row, column] else "-" for part in last.parts.values())]
        )
    return [heading.replace("_", " ") for heading in head], rows


def _off(difference: float, small: bool) -> str:
    return "small" if small else f"{100 * difference:+.0f} %"


def _document(found: PublishedComparison) -> dict[str, Any]:
    from swashplate.models.conventional.derivative_table import unit

    steps = [{"with": s.words, "mean": s.mean, "within 10 %": s.near} for s in found.steps]
    off = [found.differences(step.table) for step in found.steps]
    values = {
        name: {
            "published": value,
            "unit": unit(name),
            "small": abs(value) < found.scale[name],
            "values": [step.table[name] for step in found.steps],
            "off": [each[name] for each in off],
        }
        for name, value in found.published.items()
    }
    return {"steps": steps, "derivatives": values}
