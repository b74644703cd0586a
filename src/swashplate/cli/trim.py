"""`swash trim` and `swash linearize`: steady flight and the motions about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.simulation.linearize import LinearModel
    from swashplate.simulation.trim import Trim
    from swashplate.vehicles.vehicle import Vehicle


@given.flown
def trim(
    asked: given.Conditions,
    plot: given.Page = None,
    json: options.Json = False,
) -> None:
    """Find the steady flight of a vehicle: attitude and controls, at one speed or over a range."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table

    found = asked.trims()
    remarks = asked.doubts(found)
    if plot is not None:
        from swashplate.reporting.speed_page import speed_page

        speed_page(asked.vehicle, found, path=plot, remarks=remarks)
    if json:
        trims = [_document(asked.vehicle, at) for at in found]
        document = {"vehicle": asked.name, "trims": trims, "units": _units(asked.vehicle), "remarks": remarks}
        typer.echo(as_json(document))
        return
    if len(found) == 1:
        typer.echo(repr(found[0]).splitlines()[0])
        console().print(_one(asked.vehicle, found[0]))
    else:
        shown = (*asked.vehicle.input_names, *(n for n in ("phi", "theta", "a1", "b1") if n in found[0].state_names))
        head = ["speed [m/s]", *(f"{name} [{_unit(asked.vehicle, name)}]" for name in shown)]
        rows = [[f"{at.speed:g}", *(f"{_shown(asked.vehicle, name, at):.3f}" for name in shown)] for at in found]
        powers = [_power(asked.vehicle, at) for at in found]
        if any(power is not None for power in powers):
            head.append("power [W]")
            rows = [[*row, f"{power:.1f}"] for row, power in zip(rows, powers, strict=True)]
        console().print(table(head, rows, left=0))
    if plot is not None:
        typer.echo(f"Written: {plot}")


def _one(vehicle: Vehicle, at: Trim) -> Any:
    """Every input and state of a trim with its unit, angles also in degrees."""
    from swashplate.cli.tables import table

    values, rows = {**at.commands(), **at.states()}, []
    if (power := _power(vehicle, at)) is not None:
        rows.append(("shaft power", f"{power:.1f}", "W", ""))
    for name, unit in _units(vehicle).items():
        degrees = f"{round(math.degrees(values[name]), 3) + 0.0:.3f}" if unit == "rad" else ""
        rows.append((name, f"{round(values[name], 5) + 0.0:.5f}", unit, degrees))
    return table(("", "value", "unit", "in degrees"), rows, left=1)


def _units(vehicle: Vehicle) -> dict[str, str]:
    """The unit of every input and state."""
    inputs, states = (vehicle.input_names, vehicle.input_units), (vehicle.state_names, vehicle.state_units)
    return {name: unit for both in (inputs, states) for name, unit in zip(*both, strict=True)}


def _power(vehicle: Vehicle, at: Trim) -> float | None:
    """Shaft power [W] of a helicopter."""
    from swashplate.vehicles.helicopter_limits import shaft_power

    return shaft_power(vehicle, at.state, at.inputs, at.environment)


def _unit(vehicle: Vehicle, name: str) -> str:
    return "deg" if _units(vehicle)[name] == "rad" else _units(vehicle)[name]


def _shown(vehicle: Vehicle, name: str, at: Trim) -> float:
    value = {**at.states(), **at.commands()}[name]
    return math.degrees(value) if _unit(vehicle, name) == "deg" else value


def _document(vehicle: Vehicle, at: Trim) -> dict[str, Any]:
    power = _power(vehicle, at)
    return {
        "speed": at.speed,
        "climb": at.climb,
        "lateral": at.lateral,
        "turn": at.turn,
        "inputs": at.commands(),
        "states": at.states(),
        "residual": at.residual,
        **({} if power is None else {"power": power}),
    }


@given.flown
def linearize(
    asked: given.Conditions,
    form: Annotated[
        str,
        typer.Option(
            "--form",
            help="full; paper (8 states), printed (the paper's terms only), longitudinal, lateral (3 degrees of "
            "freedom); flapping (10 states), bar-and-gyro (13).",
        ),
    ] = "full",
    plot: given.Page = None,
    json: options.Json = False,
) -> None:
    """Linear models about steady flight: modes with their states, matrices with --json, root locus with --plot."""
    from swashplate.cli.console import as_json
    from swashplate.simulation.linearize import linearize as about
    from swashplate.simulation.reduction import FORMS, in_form

    if form not in FORMS:
        raise SwashError(f"is '{form}', expected one of {', '.join(FORMS)}.", channel="--form")
    if form != "full" and asked.vehicle.name != "conventional":
        raise SwashError("is for single-rotor helicopters.", where=asked.name, channel="--form")
    if form != "full" and plot is not None:
        raise SwashError("is of the full model.", where=plot, channel="--plot", hint="Leave out --form or --plot.")
    found = asked.trims()
    models = [in_form(about(asked.vehicle, at), form) for at in found]
    remarks = asked.doubts(found)
    if plot is not None:
        from swashplate.reporting.speed_page import speed_page

        speed_page(asked.vehicle, found, path=plot, remarks=remarks)
    if json:
        typer.echo(as_json({"vehicle": asked.name, "models": [_matrices(m) for m in models], "remarks": remarks}))
        return
    for at, model in zip(found, models, strict=True):
        typer.echo(f"At {at.speed:g} m/s\n{model!r}\n")
    if plot is not None:
        typer.echo(f"Written: {plot}")


def _matrices(model: LinearModel) -> dict[str, Any]:
    modes = [
        {"real": m.eigenvalue.real, "imag": m.eigenvalue.imag, "damping": m.damping, "states": dict(m.states)}
        for m in model.modes()
    ]
    return {
        "speed": model.trim.speed,
        "states": list(model.states),
        "inputs": list(model.inputs),
        "A": model.A,
        "B": model.B,
        "modes": modes,
    }
