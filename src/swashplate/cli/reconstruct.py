"""`swash reconstruct`: do a flight's own sensors agree, and the flight with their biases taken out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.cli.reading import asked


def reconstruct(
    flight: options.FlightName,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", help="The corrected flight as netCDF, which every verb reads."),
    ] = None,
    rate: options.Rate = 100.0,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare rates and accelerations with attitude and position: biases, scale factors, delays, lever arm, wind.

    Each estimate has its bound. Significant errors (three standard errors) are removed from the flight in --out.
    """
    from swashplate.cli.console import as_json
    from swashplate.cli.reading import conditioned
    from swashplate.flights.conditioning.reconstruction import reconstruct as rebuild

    how = asked(mapping, unit, drop_bad_stamps)
    (flown,) = conditioned([flight], rate=rate, cutoff=0.0, how=how)
    reconstruction = rebuild(flown)
    if out is not None:
        reconstruction.corrected(flown).save(out)
    if json:
        typer.echo(as_json(reconstruction.as_dict()))
    elif not quiet:
        typer.echo(str(reconstruction))
        if out is not None:
            typer.echo(f"Written: {out}")
