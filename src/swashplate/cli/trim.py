"""`swash trim` and `swash linearize`: steady flight and the motions about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options

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
        typer.echo(as_json({"vehicle": asked.name, "trims": [_document(at) for at in found], "remarks": remarks}))
        return
    if len(found) == 1:
        typer.echo(repr(found[0]))
    else:
        units = dict(zip(asked.vehicle.state_names, asked.vehicle.state_units, strict=True))
        angles = [name for name in ("phi", "theta", "a1", "b1") if name in units]
        controls = asked.vehicle.input_names
        head = ("speed [m/s]", *(f"{name} [{_unit(asked.vehicle, name)}]" for name in (*controls, *angles)))
        rows = [
            (f"{at.speed:g}", *(f"{_shown(asked.vehicle, name, at):.3f}" for name in (*controls, *angles)))
            for at in found
        ]
        console().print(table(head, rows, left=0))
    if plot is not None:
        typer.echo(f"Written: {plot}")


def _unit(vehicle: Vehicle, name: str) -> str:
    units = dict(zip(vehicle.input_names, vehicle.input_units, strict=True))
    return "1" if units.get(name) == "1" else "deg"


def _shown(vehicle: Vehicle, name: str, at: Trim) -> float:
    value = {**at.states(), **at.commands()}[name]
    return math.degrees(value) if _unit(vehicle, name) == "deg" else value


def _document(at: Trim) -> dict[str, Any]:
    return {
        "speed": at.speed,
        "climb": at.climb,
        "lateral": at.lateral,
        "turn": at.turn,
        "inputs": at.commands(),
        "states": at.states(),
        "residual": at.residual,
    }


@given.flown
def linearize(
    asked: given.Conditions,
    plot: given.Page = None,
    json: options.Json = False,
) -> None:
    """Linear models about steady flight: modes with their states, matrices with --json, root locus with --plot."""
    from swashplate.cli.console import as_json
    from swashplate.simulation.linearize import linearize as about

    found = asked.trims()
    remarks = asked.doubts(found)
    models = [about(asked.vehicle, at) for at in found]
    if plot is not None:
        from swashplate.reporting.speed_page import speed_page

        speed_page(asked.vehicle, found, path=plot, remarks=remarks)
    if json:
        typer.echo(as_json({"vehicle": asked.name, "models": [_matrices(model) for model in models]}))
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
