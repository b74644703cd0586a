"""`swash link accept`: a SITL binary of ArduPilot started, flown and judged with a vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import flying, options

Binary = Annotated[
    Path, typer.Argument(metavar="BINARY", help="ArduCopter for SITL, e.g. build/sitl/bin/arducopter-heli.")
]


def accept(
    binary: Binary,
    vehicle: options.VehicleName,
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", metavar="FOLDER", help="New folder for the report, the log and the binary's output."
        ),
    ],
    servos: Annotated[
        str | None,
        typer.Option("--servos", metavar="NAME|FILE", help="Servo mapping; by default the one of the vehicle's name."),
    ] = None,
    truth: Annotated[
        str | None, typer.Option("--truth", metavar="MODEL", help="Compare the estimates with another vehicle or card.")
    ] = None,
    axes: Annotated[
        str, typer.Option("--axes", metavar="NAME,NAME", help="Axes that are swept: roll, pitch, yaw, heave.")
    ] = "roll,pitch,yaw,heave",
    band: Annotated[str, typer.Option("--band", metavar="LOW-HIGH", help="Band of the sweeps [Hz].")] = "0.4-8",
    seconds: Annotated[float, typer.Option("--seconds", help="Seconds of each sweep.", min=10.0, max=255.0)] = 40.0,
    hover: Annotated[float, typer.Option("--hover", help="Seconds in each mode.", min=1.0, max=600.0)] = 10.0,
    height: Annotated[float, typer.Option("--height", help="Height of the hover [m].", min=1.0, max=50.0)] = 5.0,
    ekf: Annotated[
        float,
        typer.Option("--ekf", help="Simulated seconds within which it must be ready to arm.", min=1.0, max=3600.0),
    ] = 120.0,
    defaults: Annotated[
        list[Path] | None,
        typer.Option("--defaults", metavar="FILE", help="An additional parameter file, read last. May be repeated."),
    ] = None,
    instance: Annotated[
        int,
        typer.Option(
            "--instance", "-I", help="Instance of SITL: adds 10 times this number to every port.", min=0, max=99
        ),
    ] = 0,
    speedup: Annotated[
        float, typer.Option("--speedup", help="Largest number of simulated seconds per second.", min=0.1, max=100.0)
    ] = 10.0,
    timeout: Annotated[
        float, typer.Option("--timeout", help="Seconds until the binary answers.", min=0.5, max=600.0)
    ] = 15.0,
    wind: given.Wind = "0,0,0",
    altitude: given.Altitude = 0.0,
    changed: given.Set = None,
    switched: given.Switch = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Start a SITL binary with a vehicle's files, fly it from a cold start, and compare its log with the truth.

    First the binary is started once and asked for its version, so that a wrong one is refused within seconds. Then it
    waits for the EKF, arms, hovers in STABILIZE, ALT_HOLD and LOITER, sweeps each axis in System ID mode, lands, and
    takes the log through respond, fit-tf and fit-ss. Every line has a verdict; the exit code is 2 if one fails. Needs
    the extra `link`. The binary is ended in every case.
    """
    import swashplate as sp
    from swashplate.cli.console import as_json, progress

    where = given.conditions(vehicle, speed="0", wind=wind, altitude=altitude, changed=changed, switched=switched)
    limits = flying.band(band)
    assert limits is not None
    with progress(quiet=quiet or json) as line:
        acceptance = sp.accept_autopilot(
            where.vehicle,
            binary,
            out=out,
            name=vehicle,
            servos=servos,
            truth=None if truth is None else sp.vehicle(truth),
            axes=flying.names(axes),
            band=limits,
            seconds=seconds,
            hover=hover,
            height=height,
            ekf=ekf,
            defaults=defaults or (),
            environment=where.environment,
            instance=instance,
            speedup=speedup,
            timeout=timeout,
            say=line.say,
        )
        line.say("writing the report")
        acceptance.save(out)
    if json:
        typer.echo(as_json(acceptance.to_document()))
    elif not quiet:
        typer.echo(repr(acceptance))
        typer.echo(f"\nReport: {out / 'report.html'}")
    flying.end_with(acceptance.problems)
