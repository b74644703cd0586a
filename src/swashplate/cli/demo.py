"""`swash demo`: the main job on the real flights where they are found, otherwise on simulated ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import options

if TYPE_CHECKING:
    from swashplate.flights.flight import Flight
    from swashplate.models.vehicle import Vehicle

FITTED = "flight_2011-08-01_vertical.mat"
HELD_OUT = "flight_2011-07-25_hover_crash.mat"

_MANEUVERS = ("multisine:roll+pitch+yaw+heave,0.2-6Hz,40s,1", "multisine:roll+pitch+yaw+heave,0.2-6Hz,20s,1")
_AMPLITUDES = {"roll": 0.1, "pitch": 0.1, "yaw": 0.004, "heave": 0.01}
_LEAD = 3.0  # s of hover before and after
_TRUTH = {"tau_f_upper": 1.3, "linkage_lower": 0.11, "hub_stiffness_upper": 0.09}
"""What the simulated aircraft has instead of the card's numbers, for the identification to find."""


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")] = Path("demo"),
    simulated: Annotated[bool, typer.Option("--simulated", help="Simulated flights even where real ones are.")] = False,
    seed: Annotated[int, typer.Option("--seed", help="Of the simulated flights' noise.", min=0)] = 1,
    quiet: options.Quiet = False,
) -> None:
    """Run the main job: identify the CoaX from one flight and predict another, with a report.

    On the real flights of the data set coax56 where they are found on this machine, otherwise on simulated flights
    with sensor noise, gaps and outliers (the report's first line says so).
    """
    from swashplate.cli import identify
    from swashplate.cli.console import progress
    from swashplate.cli.reading import conditioned
    from swashplate.flights import datasets
    from swashplate.models.catalogue import vehicle as find

    coax = find("coax")
    found = [] if simulated else [path for f in (FITTED, HELD_OUT) if (path := datasets.find("coax56", f))]
    with progress(quiet=quiet) as line:
        if len(found) == 2:
            line.say("reading the real flights")
            fitted, held_out = conditioned(map(str, found), rate=100.0, cutoff=0.0)
        else:
            line.say("simulating two flights")
            fitted, held_out = (
                simulated_log(coax, maneuver, seed=seed + i).condition(rate=100.0, cutoff=0.0)
                for i, maneuver in enumerate(_MANEUVERS)
            )
        fit, validation = identify.run(coax, [fitted], [held_out], identify.AskedIdentification(), out=out, line=line)
    if len(found) < 2 and not quiet:
        typer.echo("On simulated flights; `swash data fetch coax56` gets the real ones.\n")
    identify.show(fit, validation, out=out, json=False, quiet=quiet)
    if fit.failed:
        raise typer.Exit(1)  # the input was ours


def simulated_log(vehicle: Vehicle, maneuver: str, *, seed: int, rate: float = 100.0) -> Flight:
    """What motion capture and an on-board computer log of a simulated flight: noise, gaps, outliers, battery.

    Args:
        vehicle: whose card the simulated aircraft departs from.
        maneuver: of unit amplitude; every axis gets its own.
        seed: of the noise.
        rate: of the simulation [Hz].
    """
    import numpy as np

    import swashplate as sp
    from swashplate.flights.maneuvers.series import AXES

    aircraft = vehicle.with_values(_TRUTH, status="assumed", source="the demo's simulated aircraft")
    excitation = sp.maneuver(maneuver)
    duration = excitation.duration + 2 * _LEAD
    time = np.arange(round(duration * rate) + 1) / rate
    added = {name: np.zeros_like(time) for name in aircraft.input_names}
    for axis, signal in excitation.signals(time - _LEAD).items():
        for name, share in AXES[axis][0].items():
            added[name] += share * _AMPLITUDES[axis] * signal
    start = sp.trim(aircraft, voltage=aircraft.card.values()["voltage_nominal"] + 0.3)
    flight = sp.simulate_closed_loop(
        aircraft,
        sp.hover_hold(aircraft, start),
        duration=duration,
        excitation=added,
        voltage=float(start.environment.voltage) - 0.01 * time,
        start=start,
        rate=rate,
    )
    return sp.observe(flight, aircraft, seed=seed)
