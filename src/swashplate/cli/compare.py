"""`swash compare`: responses, models or fits side by side, or models along a flight."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.errors import SwashError


def compare(
    cases: Annotated[
        list[str],
        typer.Argument(metavar="CASE...", help="responses.nc, fit.json, models' files or names, or folders."),
    ],
    flight: Annotated[
        list[str] | None,
        typer.Option("--flight", metavar="LOG", help="Fly the models along this flight instead. May be repeated."),
    ] = None,
    outputs: Annotated[
        str | None,
        typer.Option("--outputs", metavar="NAME,NAME", help="Channels of the flight to compare; all by default."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE.html", help="A page with figures.")] = None,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Put cases side by side, each against the first: frequency responses, fits (parameters, modes) or models (modes).

    With --flight the models are simulated with the recorded inputs, and the fit of every output is printed.
    """
    import swashplate as sp
    from swashplate.cli.console import as_json
    from swashplate.cli.reading import asked, conditioned

    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise SwashError(f"ends in '{out.suffix}', expected .html.", where=out, channel="--out")
    how = asked(mapping, unit, drop_bad_stamps)
    flown = conditioned(flight, rate=rate, cutoff=cutoff, how=how) if flight else None
    names = [name.strip() for name in outputs.split(",")] if outputs else None
    comparison = sp.compare(cases, flown, outputs=names)
    if out is not None:
        sp.report(comparison, path=out)
    if json:
        typer.echo(as_json(comparison.to_document()))
    elif not quiet:
        typer.echo(repr(comparison))
        if out is not None:
            typer.echo(f"Written: {out}")
