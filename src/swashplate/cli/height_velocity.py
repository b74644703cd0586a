"""`swash height-velocity`: from where an engine failure can be landed."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options


def height_velocity(
    vehicle: given.Name,
    delay: Annotated[float, typer.Option("--delay", help="Seconds before the pilot acts.")] = 1.0,
    sink: Annotated[
        float | None, typer.Option("--sink", help="Largest sink at touch-down [m/s]; else that of a drop from 8 in.")
    ] = None,
    run: Annotated[float | None, typer.Option("--run", help="Largest speed ahead at touch-down [m/s].")] = None,
    altitude: given.Altitude = None,
    mass: given.Mass = None,
    changed: given.Set = None,
    switched: given.Switch = None,
    out: given.OutPage = None,
    json: options.Json = False,
) -> None:
    """Heights and speeds from which a helicopter lands after its engine has failed, by simulated landings."""
    import swashplate as sp
    from swashplate.cli.console import as_json

    asked = given.conditions(vehicle, altitude=altitude, mass=mass, changed=changed, switched=switched)
    diagram = sp.height_velocity(asked.vehicle, delay=delay, sink=sink, run=run, environment=asked.environment)
    if out is not None:
        sp.report(diagram, path=out)
    typer.echo(as_json({"vehicle": vehicle, **diagram.as_dict()}) if json else repr(diagram))
    if out is not None and not json:
        typer.echo(f"Written: {out}")
