"""`swash inspect`: what is in a log and what is wrong with it."""

from __future__ import annotations

import typer

from swashplate.cli import options
from swashplate.errors import FlightError


def inspect(
    flight: options.FlightName,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Show a log's channels, units, rates, gaps and frequency sweeps, and the problems in it; nothing is changed.

    For a record of the test bench it shows the columns and the procedures.

    A log that is itself damaged (cut off, bytes lost, its clock set back) is shown as far as it could be read, and ends
    with an error.
    """
    from swashplate.bench.record_files import is_bench, read_bench
    from swashplate.cli.console import as_json, console
    from swashplate.cli.reading import asked, read
    from swashplate.flights.datasets import locate
    from swashplate.flights.inspect import inspect as look

    if is_bench(place := locate(flight)):
        from swashplate.cli.bench_tables import record_as_dict, record_table

        record = read_bench(place)
        if json:
            typer.echo(as_json(record_as_dict(record)))
        elif not quiet:
            console().print(record_table(record))
            typer.echo(f"\nEvaluate it with `swash bench {flight}`.")
        return
    inspection = look(read(flight, how=asked(mapping, unit, drop_bad_stamps)))
    if json:
        typer.echo(as_json(inspection.as_dict()))
    elif not quiet:
        console().print(inspection)
    if inspection.damage:
        raise FlightError(
            f"{'; '.join(inspection.damage)}.",
            where=flight,
            hint="Everything else was read" + (", and is shown." if not quiet else "."),
        )
