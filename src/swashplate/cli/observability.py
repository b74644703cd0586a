"""`swash control observability`: what a sensor suite can see of a vehicle, and what it cannot."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import controller_options as shared
from swashplate.cli import options


def observability(
    model: shared.Model,
    sensors: shared.Sensors = shared.USUAL_SENSORS,
    speed: given.Speed = "0",
    seconds: Annotated[float, typer.Option("--seconds", help="Length of the observation [s].", min=0.1)] = 10.0,
    rate: Annotated[float, typer.Option("--rate", help="Samples per second of the model [Hz].", min=1.0)] = 100.0,
    voltage: shared.Voltage = None,
    switched: given.Switch = None,
    json: options.Json = False,
) -> None:
    """Show which directions of a vehicle's states a sensor suite cannot observe, and how well the others are known."""
    import swashplate as sp
    from swashplate.cli.console import doing

    with doing("watching the observer", quiet=json):
        study = sp.observability(
            given.vehicle_of(model, None, switched),
            sensors,
            speeds=given.speeds(speed),
            seconds=seconds,
            rate=rate,
            voltage=voltage,
        )
    shared.show(study, written=(), json=json, quiet=False)
