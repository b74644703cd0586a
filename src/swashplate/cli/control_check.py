"""`swash control check`: margins, handling qualities and steps of a controller on a model, as a report and as JSON."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import controller_options as shared
from swashplate.cli import options
from swashplate.cli.lateness import Delay, delays_from
from swashplate.errors import SwashError

OURS = ("report.html", "check.json")


class HandlingTask(StrEnum):
    OTHER = "other"
    TRACKING = "tracking"


class Response(StrEnum):
    AUTO = "auto"
    RATE = "rate"
    ATTITUDE = "attitude"


def check(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A model file, or a vehicle's name.")],
    controller: Annotated[Path, typer.Option("--controller", metavar="FILE", help="The controller's file.")],
    out: options.OutFolder = None,
    task: Annotated[
        HandlingTask, typer.Option("--task", help="Which boundaries of ADS-33E: target tracking, or all other tasks.")
    ] = HandlingTask.OTHER,
    response: Annotated[
        Response,
        typer.Option(
            "--response", help="Type of the response to a steady command; it determines which bandwidth counts."
        ),
    ] = Response.AUTO,
    scale: Annotated[
        float | None,
        typer.Option("--scale", help="Ratio of the size of a full-size helicopter to the vehicle's; 1 for no scaling."),
    ] = None,
    speed: Annotated[float, typer.Option("--speed", help="Speed ahead of the steady flight [m/s].")] = 0.0,
    voltage: Annotated[float | None, typer.Option("--voltage", help="Battery voltage [V].")] = None,
    delay: Delay = None,
    computation: Annotated[
        float | None,
        typer.Option("--computation", metavar="MS", help="Time from a reading to its command [ms].", min=0.0),
    ] = None,
    delay_margin: Annotated[
        float | None,
        typer.Option(
            "--delay-margin",
            metavar="MS",
            help="Additional delay that the loops must tolerate [ms]; by default a sample and the computation.",
            min=0.0,
        ),
    ] = None,
    duration: Annotated[
        float, typer.Option("--duration", help="Duration of each step [s].", min=5.0, max=300.0)
    ] = 20.0,
    gusts: Annotated[
        str,
        typer.Option(
            "--gusts",
            help="Turbulence: none, indoor, indoor=SIGMA, or a mean wind outdoors [m/s].",
        ),
    ] = "indoor",
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Judge a controller on a model: margins, disturbance rejection, handling qualities, steps, coupling, gusts.

    Exit code 2 if the loop is unstable; everything that could be computed is written and marked.
    """
    if scale is not None and not scale > 0.0:
        raise SwashError(f"is {scale:g}, expected a positive number.", channel="--scale", hint="Full size is 1.")
    import swashplate as sp
    from swashplate.cli.console import doing
    from swashplate.cli.flying import end_with
    from swashplate.cli.gusts import turbulence
    from swashplate.cli.outputs import folder_when_complete, place_of

    with folder_when_complete(out, ours=OURS) as folder:
        with doing("checking the controller", quiet=quiet or json):
            checked = sp.check_controller(
                given.vehicle_of(model, None, None),
                controller,
                speed=speed,
                voltage=voltage,
                task=task.value,
                command=response.value,
                scale=scale,
                duration=duration,
                gusts=turbulence(gusts),
                delays=delays_from(delay),
                computation=None if computation is None else computation / 1e3,
                required_delay=None if delay_margin is None else delay_margin / 1e3,
            )
        if folder is not None:
            sp.report(checked, path=folder / "report.html")
            checked.save(folder / "check.json")
    written = () if out is None else tuple(dict.fromkeys(place_of(out, name, OURS) for name in OURS))
    shared.show(checked, written=written, json=json, quiet=quiet)
    end_with(checked.problems)
