"""`swash vehicles`: what can fly here, and every number of it."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import options
from swashplate.cli.usual_verb import usual
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.simulation.trim import Trim

app = typer.Typer(cls=usual("show"), help="The vehicles that come with swashplate, and cards.", rich_markup_mode=None)


class Rotation(StrEnum):
    CW = "cw"
    CCW = "ccw"


class ClassName(StrEnum):
    FULL_SIZE = "full-size"
    RMAX = "rmax"
    SIX_HUNDRED = "600"
    NINETY = "90"
    MICRO = "micro"


@app.callback(invoke_without_command=True)
def main(ctx: typer.Context, json: options.Json = False) -> None:
    """List the vehicles, or show one."""
    if ctx.invoked_subcommand is None:
        list_(json=json)


@app.command("list")
def list_(json: options.Json = False) -> None:
    """List the vehicles by name."""
    import swashplate as sp
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table

    cards, faults = sp.vehicles()
    for fault in faults:
        typer.echo(f"Careful: {fault}", err=True)
    if json:
        typer.echo(as_json({name: {"title": card.title, "trust": card.trust} for name, card in cards.items()}))
        return
    console().print(table(("name", "what it is"), [(name, card.title) for name, card in cards.items()], left=2))


@app.command()
def new(
    out: Annotated[Path, typer.Argument(metavar="FILE", help="The card to write, e.g. mine.toml.")],
    mass: Annotated[float, typer.Option("--mass", help="Mass with fuel or battery [kg].")],
    radius: Annotated[float, typer.Option("--radius", help="Radius of the main rotor [m].")],
    title: Annotated[str, typer.Option("--title", help="Title of the card.")] = "My helicopter",
    rotation: Annotated[
        Rotation, typer.Option("--rotation", help="Direction of the main rotor, seen from above.")
    ] = Rotation.CW,
    size_class: Annotated[
        ClassName | None,
        typer.Option("--class", help="Class whose statistics are used; by default from mass and radius."),
    ] = None,
    like: Annotated[
        str | None, typer.Option("--like", help="Scale a packaged helicopter instead of using a class.")
    ] = None,
) -> None:
    """Write a commented card for your own single-rotor helicopter: statistics of its class, to be measured."""
    from swashplate.atomic import write_text
    from swashplate.models.catalogue import from_card
    from swashplate.models.conventional.new_card import commented, new_card
    from swashplate.models.conventional.size_classes import default_class

    if out.exists():
        raise SwashError("exists already; it is not overwritten.", where=out, hint="Choose another name.")
    named = None if size_class is None else size_class.value
    card = new_card(title, mass=mass, radius=radius, rotation=rotation.value, like=like, size_class=named)
    from_card(card)
    write_text(out, commented(card))
    if like is None:
        usual = default_class(mass, radius)
        typer.echo(f"Numbers of {usual.why}." if named is None else f"Numbers of class {named}, as asked.")
        if named not in (None, usual.name):
            typer.echo(f"Careful: mass and radius ask for {usual.why}.", err=True)
    typer.echo(f"Written: {out}. Replace the guesses by measurements, then try: swash trim {out}")


@app.command()
def show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A vehicle's name, or a card or model file.")],
    trim: Annotated[bool, typer.Option("--trim", help="Also the hover: its inputs, states and modes.")] = False,
    json: options.Json = False,
) -> None:
    """Describe a vehicle, the range of its card, and every number with unit, status and source."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import parameter_table
    from swashplate.models.catalogue import vehicle as find

    vehicle = find(name)
    card = vehicle.card
    hover: Trim | None = None
    if trim:
        import swashplate as sp

        hover = sp.trim(vehicle)
    if json:
        document: dict[str, Any] = {
            "vehicle": card.vehicle,
            "title": card.title,
            "trust": card.trust,
            "options": card.options,
            "states": dict(zip(vehicle.state_names, vehicle.state_units, strict=True)),
            "inputs": {
                name: list(limits) for name, limits in zip(vehicle.input_names, vehicle.input_limits, strict=True)
            },
            "parameters": {name: vars(parameter) for name, parameter in card.parameters.items()},
        }
        if hover is not None:
            document["trim"] = {"inputs": hover.commands(), "states": hover.states()}
        typer.echo(as_json(document))
        return
    screen = console()
    screen.print(card.title, style="bold", highlight=False, markup=False)
    screen.print(f"Trust: {card.trust}", highlight=False, markup=False)
    screen.print(
        f"States: {', '.join(vehicle.state_names)}\nInputs: {', '.join(vehicle.input_names)}\n", highlight=False
    )
    screen.print(parameter_table(vehicle))
    if hover is not None:
        typer.echo(f"\n{hover!r}\n\n{sp.linearize(vehicle, hover)!r}")
