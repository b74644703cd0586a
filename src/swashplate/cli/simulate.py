"""`swash simulate`: a maneuver flown by a vehicle, as a flight like any other."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.cli.merged import merged
from swashplate.cli.monte_carlo import Many, many
from swashplate.errors import SwashError

_WIND = ("wind_north", "wind_east", "wind_down")


class SensorSet(StrEnum):
    NONE = "none"
    CLEAN = "clean"
    REAL = "real"


@merged(many)
def simulate(
    vehicle: options.VehicleName,
    maneuver: Annotated[
        str, typer.Option("--maneuver", help='For example "sweep:pitch,0.5-8Hz,60s" or "doublet:roll,0.5s,0.2".')
    ],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="The flight: .nc (complete) or .csv.")],
    sensors: Annotated[
        SensorSet,
        typer.Option("--sensors", help="The true states, motion capture with noise only, or with gaps and outliers."),
    ] = SensorSet.NONE,
    seed: Annotated[int, typer.Option("--seed", help="Seed of all random numbers.", min=0)] = 0,
    voltage: Annotated[float | None, typer.Option("--voltage", help="Battery voltage at the start [V].")] = None,
    sag: Annotated[float, typer.Option("--sag", help="Fall of the voltage [V/s].")] = 0.0,
    wind: Annotated[
        str, typer.Option("--wind", metavar="N,E,D", help="Wind towards north, east and down [m/s].")
    ] = "0,0,0",
    speed: Annotated[float, typer.Option("--speed", help="Forward speed at the start of the maneuver [m/s].")] = 0.0,
    switched: given.Switch = None,
    controller: Annotated[
        Path | None,
        typer.Option("--controller", metavar="FILE", help="A file of `swash decouple` or `swash control design`."),
    ] = None,
    pilot: Annotated[
        bool,
        typer.Option("--pilot", help="Roll and pitch of the maneuver are a pilot's commands to the controller."),
    ] = False,
    many: Many = Many(None, {}, ()),  # noqa: B008
    rate: options.Rate = 100.0,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="FILE.html",
            help="Also a page of plots over time.",
            callback=given.checked_page,
        ),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Fly a maneuver from hover or steady flight under a controller, and save the flight."""
    from swashplate.cli.console import progress
    from swashplate.flights.maneuvers.series import parse

    if out.suffix.lower() not in (".nc", ".csv"):
        raise SwashError(f"ends in '{out.suffix}', expected .nc or .csv.", where=out, channel="--out")
    if not out.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=out.parent, channel="--out", hint="Make it first.")
    blowing = dict(zip(_WIND, options.numbers(wind, option="--wind", count=3), strict=True))
    parse(maneuver)  # says what is wrong with it before anything else is looked at
    aircraft = given.vehicle_of(vehicle, None, switched)
    if "--battery" in many.given and (voltage is not None or sag):
        raise SwashError("says what --voltage and --sag say.", channel="--battery", hint="Give one of them.")
    if many.count is not None:
        if plot is not None:
            raise SwashError("is for one flight.", channel="--plot", hint="--report is for many.")
        if controller is None:
            raise SwashError("needs a --controller.", channel="--monte-carlo", hint="`swash decouple` writes one.")
    import swashplate as sp

    flown: Any
    common: dict[str, Any] = {"voltage": voltage, "sag": sag, "seed": seed}
    with progress(quiet=quiet) as line:
        flights = "" if many.count is None else f"{many.count} flights "
        line.say(f"simulating {flights}(compiling takes longest the first time)")
        if many.count is not None and controller is not None:
            page = many.page
            flown = sp.monte_carlo(aircraft, controller, maneuver=maneuver, count=many.count, **common, **many.options)
            shown, late = flown.spread, f"late: {flown.late}"
        else:
            page, how = plot, dict[str, Any](speed=speed, rate=rate, wind=blowing, sensors=sensors.value)
            flown = sp.fly_maneuver(aircraft, maneuver, controller=controller, pilot=pilot, **common, **how)
            shown, late = flown, ""
        paths = flown.save(out)
        if page is not None:
            paths += (sp.report(flown, path=page),)
    if late:
        typer.echo(late, err=True)
    for words in flown.remarks:
        typer.echo(f"Careful: {words}", err=True)
    if json:
        from swashplate.json_text import as_json

        typer.echo(as_json(flown.to_document() | {"vehicle": vehicle, "written": paths}))
    elif not quiet:
        typer.echo(f"{shown!r}\n\nWritten: {', '.join(map(str, paths))}")
