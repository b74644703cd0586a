"""`swash inspect`: what is in a log and what is wrong with it."""

from __future__ import annotations

import typer

from swashplate.cli import options
from swashplate.cli.reading import Reading


def inspect(
    flight: options.FlightName,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Show a log's channels, units, rates and gaps, and the problems found in it; nothing is changed."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.reading import read
    from swashplate.flights.inspect import inspect as look

    found = look(read(flight, how=Reading(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps)))
    if json:
        typer.echo(as_json(found.as_dict()))
    elif not quiet:
        console().print(found)
