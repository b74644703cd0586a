"""`swash control gains`: the gains of a whole autopilot from a vehicle's model, judged, flown and written."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import controller_options as shared
from swashplate.cli import options
from swashplate.cli.lateness import Delay, delays_from


class AutopilotChoice(StrEnum):
    ARDUPILOT = "ardupilot"
    PX4 = "px4"
    ROTORFLIGHT = "rotorflight"


def gains(
    model: shared.Model,
    autopilot: Annotated[
        AutopilotChoice, typer.Option("--autopilot", help="Autopilot whose law and parameter names are used.")
    ] = AutopilotChoice.ARDUPILOT,
    servos: Annotated[
        str | None,
        typer.Option("--servos", metavar="NAME|FILE", help="Servo mapping; by default the one of the vehicle's name."),
    ] = None,
    delay: Delay = None,
    notch: Annotated[
        str | None,
        typer.Option(
            "--notch",
            metavar="HZ,WIDTH",
            help="Notch filter of the gyros, and of twice its frequency [Hz] (ArduPilot).",
        ),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate", help="Rate of the loops [Hz]; 400 by default, 250 for PX4, 1000 for Rotorflight.", min=50.0
        ),
    ] = None,
    parameters: Annotated[
        Path | None,
        typer.Option("--parameters", metavar="FILE", help="Judge the gains of this .parm file instead (ArduPilot)."),
    ] = None,
    voltage: shared.Voltage = None,
    changed: given.Set = None,
    switched: given.Switch = None,
    fly: Annotated[bool, typer.Option("--fly/--no-fly", help="Also fly the modes on the nonlinear model.")] = True,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help="Write the parameters (.parm; PX4: .params; Rotorflight: .txt)."
        ),
    ] = None,
    controller: Annotated[
        Path | None,
        typer.Option("--controller", metavar="FILE", help="Write the law as a controller that `swash` flies (.toml)."),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Gains of rate, attitude, height and place loops for a vehicle under ArduPilot, PX4 or Rotorflight.

    Every loop keeps 6 dB, 45 degrees and a sensitivity below two with all others closed, with rotors, bar, delays
    and filters. Then a copy of the autopilot's law flies STABILIZE, ALT_HOLD and LOITER on the nonlinear model;
    Rotorflight's flies ANGLE, and a hover with a simulated pilot.
    Exit code 2 if no gains keep the margins, or if those of --parameters do not.
    """
    suffix = {"ardupilot": ".parm", "px4": ".params"}.get(autopilot.value, ".txt")
    shared.check_suffixes((out, suffix, "--out"), (controller, ".toml", "--controller"))
    room = options.numbers(notch, option="--notch", count=2) if notch else None
    import swashplate as sp
    from swashplate.cli.console import doing
    from swashplate.cli.flying import end_with

    with doing("searching gains", quiet=quiet or json):
        made = sp.autopilot_gains(
            given.vehicle_of(model, changed, switched),
            autopilot=autopilot.value,
            name=model,
            servos=servos,
            delays=delays_from(delay),
            notch=(room[0], room[1]) if room else None,
            rate=rate,
            parameters=parameters,
            voltage=voltage,
            fly=fly,
        )
    for file in (out, controller):
        if file is not None:
            made.save(file)
    shared.show(made, written=(out, controller), json=json, quiet=quiet)
    end_with(list(made.problems))
