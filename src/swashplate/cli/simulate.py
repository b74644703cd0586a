"""`swash simulate`: a maneuver flown by a vehicle, as a flight like any other."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Callable

    from swashplate.flights.flight import Flight
    from swashplate.simulation.closed_loop import Controller
    from swashplate.simulation.trim import Trim
    from swashplate.vehicles.vehicle import Vehicle

_HELD = 0.02  # share of a flight that an input may stand at a limit before that is said
_WIND = ("wind_north", "wind_east", "wind_down")


class SensorSet(StrEnum):
    NONE = "none"
    CLEAN = "clean"
    REAL = "real"


def simulate(
    vehicle: options.VehicleName,
    maneuver: Annotated[
        str, typer.Option("--maneuver", help='For example "sweep:pitch,0.5-8Hz,60s" or "doublet:roll,0.5s,0.2".')
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The flight: .nc (nothing lost) or .csv.")],
    sensors: Annotated[
        SensorSet,
        typer.Option("--sensors", help="The true states, motion capture with noise only, or with gaps and outliers."),
    ] = SensorSet.NONE,
    seed: Annotated[int, typer.Option("--seed", help="Of all that is random.", min=0)] = 0,
    voltage: Annotated[float | None, typer.Option("--voltage", help="Battery voltage at the start [V].")] = None,
    sag: Annotated[float, typer.Option("--sag", help="Fall of the voltage [V/s].")] = 0.0,
    wind: Annotated[
        str, typer.Option("--wind", metavar="N,E,D", help="Wind towards north, east and down [m/s].")
    ] = "0,0,0",
    speed: Annotated[float, typer.Option("--speed", help="Speed ahead that the maneuver begins at [m/s].")] = 0.0,
    switched: given.Switch = None,
    controller: Annotated[
        Path | None,
        typer.Option("--controller", metavar="FILE", help="A file of `swash decouple` or `swash control design`."),
    ] = None,
    pilot: Annotated[
        bool,
        typer.Option("--pilot", help="Roll and pitch are a pilot's commands to the controller."),
    ] = False,
    many: Annotated[
        int | None,
        typer.Option("--monte-carlo", help="So many flights with sensor noise; --out keeps the worst.", min=2),
    ] = None,
    fit: Annotated[
        Path | None, typer.Option("--fit", metavar="FILE", help="With --monte-carlo: models drawn from this fit.json.")
    ] = None,
    gusts: Annotated[
        str, typer.Option("--gusts", help="With --monte-carlo: none, indoor, or Dryden's at a mean wind [m/s].")
    ] = "none",
    battery: Annotated[
        str | None,
        typer.Option("--battery", metavar="FROM-TO", help="With --monte-carlo: voltage at start and end, 12.5-10.5."),
    ] = None,
    tolerances: Annotated[
        bool, typer.Option("--tolerances", help="With --monte-carlo: the card's numbers drawn from their sigmas.")
    ] = False,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary", metavar="NAME=SIGMA", help="With --monte-carlo: a number of the card, also NAME=5%; repeatable."
        ),
    ] = None,
    payload: Annotated[
        float, typer.Option("--payload", help="With --monte-carlo: up to so much mass more [kg].", min=0.0)
    ] = 0.0,
    delay: Annotated[
        float, typer.Option("--delay", help="With --monte-carlo: commands late by up to [s].", min=0.0, max=1.0)
    ] = 0.0,
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
    from swashplate.flights.maneuvers import parse

    suffix = out.suffix.lower()
    if suffix not in (".nc", ".csv"):
        raise SwashError(f"ends in '{out.suffix}', expected .nc or .csv.", where=out, channel="--out")
    if not out.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=out.parent, channel="--out", hint="Make it first.")
    blowing = dict(zip(_WIND, options.numbers(wind, option="--wind", count=3), strict=True))
    excitation, aircraft = parse(maneuver), given.vehicle_of(vehicle, None, switched)
    if pilot and controller is None:
        raise SwashError("is for a --controller; the hover hold takes no commands.", channel="--pilot")
    scatter = {
        "--fit": fit,
        "--gusts": gusts != "none",
        "--battery": battery,
        "--tolerances": tolerances,
        "--vary": vary,
        "--payload": payload,
        "--delay": delay,
    }
    alone = [name for name, wanted in scatter.items() if wanted] if many is None else []
    if alone:
        raise SwashError("is for --monte-carlo.", channel=", ".join(alone), hint="Add --monte-carlo 100.")
    if battery is not None and (voltage is not None or sag):
        raise SwashError("says what --voltage and --sag say.", channel="--battery", hint="Give one of them.")
    if many is not None:
        if pages := [name for name, wanted in {"--plot": plot, "--json": json}.items() if wanted]:
            raise SwashError("is for one flight.", channel=", ".join(pages), hint="Leave out --monte-carlo.")
        if controller is None:
            raise SwashError("needs a --controller.", channel="--monte-carlo", hint="`swash decouple` writes one.")
        from swashplate.cli import monte_carlo

        with progress(quiet=quiet) as line:
            line.say(f"simulating {many} flights (compiling takes longest the first time)")
            summary, worst = monte_carlo.fly(
                aircraft,
                excitation,
                controller,
                count=many,
                fit=fit,
                gusts=gusts,
                seed=seed,
                voltage=aircraft.card.values().get("voltage_nominal") if voltage is None else voltage,
                sag=sag,
                battery=battery,
                tolerances=tolerances,
                vary=vary,
                payload=payload,
                delay=delay,
                model=given.linear_model(vehicle),
            )
            paths = _save(worst, out)
        if not quiet:
            typer.echo(f"{summary!r}\n\nThe worst flight is written: {', '.join(map(str, paths))}")
        return
    with progress(quiet=quiet) as line:
        line.say("simulating (compiling takes longest the first time)")
        import swashplate as sp

        hold = sp.hover_hold if "motor_upper" in aircraft.input_names else sp.state_hold
        flight = sp.simulate_maneuver(
            aircraft,
            excitation,
            controller=hold if controller is None else from_file(controller, seed=seed),
            pilot=pilot,
            speed=speed,
            voltage=aircraft.card.values().get("voltage_nominal") if voltage is None else voltage,
            sag=sag,
            rate=rate,
            wind=blowing,
        )
        remarks = [f"{words}." for words in _doubts(aircraft, flight)] + _at_limits(aircraft, flight)
        truth = flight
        if sensors is not SensorSet.NONE:
            from swashplate.simulation.sensors import QUIET, Sensors

            chosen = QUIET if sensors is SensorSet.CLEAN else Sensors()
            flight = sp.observe(flight, aircraft, sensors=chosen, seed=seed)
        paths = _save(flight, out)
        if plot is not None:
            from swashplate.reporting.flight_page import flight_page

            paths += (flight_page(aircraft, truth, path=plot, remarks=remarks),)
    for words in remarks:
        typer.echo(f"Careful: {words}", err=True)
    if json:
        from swashplate.cli.console import as_json

        typer.echo(as_json(_document(vehicle, aircraft, maneuver, truth) | {"remarks": remarks, "written": paths}))
    elif not quiet:
        typer.echo(repr(flight))
        typer.echo(f"\nWritten: {', '.join(map(str, paths))}")


def _document(name: str, vehicle: Vehicle, maneuver: str, flight: Flight) -> dict[str, Any]:
    """A flight in numbers: every state and input at the start, at the end, and how far it went [SI units]."""
    channels = (*vehicle.state_names, *vehicle.input_names)
    units = (*vehicle.state_units, *vehicle.input_units)
    columns = {channel: flight.values(channel) for channel in channels}
    return {
        "vehicle": name,
        "maneuver": maneuver,
        "duration": flight.duration,
        "rate": round(flight.rate(channels[0]), 9),
        "channels": {
            channel: {
                "unit": unit,
                "start": columns[channel][0],
                "end": columns[channel][-1],
                "least": columns[channel].min(),
                "greatest": columns[channel].max(),
            }
            for channel, unit in zip(channels, units, strict=True)
        },
    }


def _doubts(vehicle: Vehicle, flight: Flight) -> tuple[str, ...]:
    """Where a simulated flight leaves what its equations hold for."""
    from swashplate.vehicles.helicopter_limits import doubts_along

    if vehicle.name != "conventional":
        return ()
    rows = (flight.array(names) for names in (vehicle.state_names, vehicle.input_names, _WIND))
    return doubts_along(vehicle, flight.time(vehicle.state_names[0]), *rows)


def from_file(path: Path, *, seed: int = 0) -> Callable[[Vehicle, Trim], Controller]:
    """What makes the controller of a file for a vehicle: the file's, if it is for that vehicle or a linear model of it.

    Args:
        path: the file.
        seed: of the noise that a controller with sensors of its own sees.
    """
    from dataclasses import replace

    from swashplate.control.controller_file import read_controller
    from swashplate.control.lqg import Lqg
    from swashplate.control.lqg_transfer import flown_on
    from swashplate.control.observed_autopilot import ObservedAutopilot
    from swashplate.errors import ControllerError
    from swashplate.vehicles.linear import NAME as LINEAR

    saved = read_controller(path)

    def make(vehicle: Vehicle, trim: Trim) -> Controller:
        if isinstance(saved, Lqg) and saved.vehicle.name == LINEAR and vehicle.name != LINEAR:
            return replace(flown_on(saved, vehicle, trim), seed=seed)
        of = saved.vehicle if isinstance(saved.vehicle, str) else saved.vehicle.name
        if of != vehicle.name:
            raise ControllerError(f"is for '{of}', not for '{vehicle.name}'.", where=path)
        return saved.starting_at(trim, seed=seed) if isinstance(saved, Lqg | ObservedAutopilot) else saved

    return make


def _at_limits(vehicle: Vehicle, flight: Flight) -> list[str]:
    """Inputs that stood at a limit: what they were told beyond it was not flown."""
    found = []
    for name, (low, high) in zip(vehicle.input_names, vehicle.input_limits, strict=True):
        if name in dict(vehicle.trim_held) or name not in flight:
            continue
        values = flight.values(name)
        share = float(((values <= low) | (values >= high)).mean())
        if share > _HELD:
            found.append(f"{name} stands at its limit for {100.0 * share:.0f} % of the time; fly a smaller amplitude.")
    return found


def _save(flight: Flight, out: Path) -> tuple[Path, ...]:
    if out.suffix.lower() == ".nc":
        return (flight.save(out),)
    from swashplate.flights.csv_export import write_csv

    return write_csv(flight, out)
