"""`swash maneuver`: an excitation to fly, as a table and as ArduPilot's parameters, with its design rules checked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.errors import SwashError


def maneuver(
    spec: Annotated[
        str,
        typer.Argument(metavar="SPEC", help='For example "sweep:pitch,0.5-8Hz,60s,0.1" or "doublet:roll,0.5s,0.2".'),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="The series as .csv; without it the rules are checked only."),
    ] = None,
    rate: Annotated[
        float, typer.Option("--rate", help="Of the series and of the log [Hz].", min=1.0, max=10000.0)
    ] = 100.0,
    noise: Annotated[
        float | None, typer.Option("--noise", help="Standard deviation of the output's noise, in its unit.", min=0.0)
    ] = None,
    gain: Annotated[
        float | None, typer.Option("--gain", help="Output over input where it is weakest in the band.", min=0.0)
    ] = None,
    coherence: Annotated[float, typer.Option("--coherence", help="Wanted everywhere in the band.")] = 0.8,
    bandwidth: Annotated[
        float | None, typer.Option("--bandwidth", help="Of the response, or of the mode of interest [Hz].")
    ] = None,
    f180: Annotated[
        float | None, typer.Option("--f180", help="Frequency at which the response's phase is -180 deg [Hz].")
    ] = None,
    ardupilot: Annotated[
        bool, typer.Option("--ardupilot", help="A sweep on ArduPilot's schedule, and FILE.param with SID_ parameters.")
    ] = False,
    sid_axis: Annotated[
        int | None,
        typer.Option("--sid-axis", help="ArduPilot's SID_AXIS; without it the mixer, behind the rate controller."),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design an excitation: check the rules, and write the series for an autopilot to fly."""
    import swashplate as sp
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table

    if out is not None and out.suffix.lower() != ".csv":
        raise SwashError(f"ends in '{out.suffix}', expected .csv.", where=out, channel="--out")
    if sid_axis is not None and not ardupilot:
        raise SwashError("is given without --ardupilot.", channel="--sid-axis", hint="Add --ardupilot.")
    planned = sp.plan_maneuver(
        spec,
        rate=rate,
        noise=noise,
        gain=gain,
        coherence=coherence,
        bandwidth=bandwidth,
        f180=f180,
        ardupilot=ardupilot,
        sid_axis=sid_axis,
    )
    written = () if out is None else planned.save(out)
    if json:
        typer.echo(as_json(planned.to_document() | {"written": [str(path) for path in written]}))
    elif not quiet:
        console().print(table(*planned.rows(), left=4))
        if planned.chirp is not None:
            typer.echo("\n" + planned.chirp.parameter_file().rstrip())
        if written:
            typer.echo(f"\nWritten: {', '.join(map(str, written))}")
