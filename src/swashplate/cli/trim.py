"""`swash trim` and `swash linearize`: steady flight and the motions about it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.simulation.linearize import LinearModel
    from swashplate.simulation.trim_curve import TrimCurve


@given.flown
def trim(
    asked: given.Conditions,
    plot: given.OutPage = None,
    json: options.Json = False,
) -> None:
    """Find the steady flight of a vehicle: attitude and controls, at one speed or over a range."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table

    curve = asked.curve()
    asked.tell(curve)
    if plot is not None:
        import swashplate as sp

        sp.report(curve, path=plot)
    if json:
        typer.echo(as_json({"vehicle": asked.name, **curve.as_dict()}))
        return
    if len(curve.trims) == 1:
        typer.echo(repr(curve.trims[0]).splitlines()[0])
        console().print(_one(curve))
    else:
        columns = {"speed [m/s]": [f"{at.speed:g}" for at in curve.trims]}
        columns |= {head: [f"{v:.3f}" for v in values] for head, values in list(curve.columns().items())[1:]}
        if "power [W]" in columns:
            columns["power [W]"] = [f"{v:.1f}" for v in curve.columns()["power [W]"]]
        console().print(table(list(columns), list(zip(*columns.values(), strict=True)), left=0))
    if plot is not None:
        typer.echo(f"Written: {plot}")


def _one(curve: TrimCurve) -> Any:
    """Every input and state of a trim with its unit, angles also in degrees."""
    from swashplate.cli.tables import table

    at = curve.trims[0]
    values, rows = {**at.commands(), **at.states()}, []
    if (power := curve.power(at)) is not None:
        rows.append(("shaft power", f"{power:.1f}", "W", ""))
    for name, unit in curve.units().items():
        degrees = f"{round(math.degrees(values[name]), 3) + 0.0:.3f}" if unit == "rad" else ""
        rows.append((name, f"{round(values[name], 5) + 0.0:.5f}", unit, degrees))
    return table(("", "value", "unit", "in degrees"), rows, left=1)


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
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="A model file for every speed, with its trim."),
    ] = None,
    json: options.Json = False,
) -> None:
    """Linear models about steady flight: modes with their states, matrices with --json, root locus with --plot."""
    import swashplate as sp
    from swashplate.cli.console import as_json

    if form != "full" and plot is not None:
        raise SwashError("is of the full model.", where=plot, channel="--plot", hint="Leave out --form or --plot.")
    curve = asked.curve()
    models = [sp.in_form(sp.linearize(asked.vehicle, at), form) for at in curve.trims]
    remarks = asked.tell(curve)
    if plot is not None:
        sp.report(curve, path=plot)
    if out is not None:
        _save(models, out)
    if json:
        typer.echo(as_json({"vehicle": asked.name, "models": [_matrices(m) for m in models], "remarks": remarks}))
        return
    for at, model in zip(curve.trims, models, strict=True):
        typer.echo(f"At {at.speed:g} m/s\n{model!r}\n")
    for written in (plot, out):
        if written is not None:
            typer.echo(f"Written: {written}")


def _save(models: Sequence[LinearModel], folder: Path) -> None:
    """at-SPEED.toml for every model; those of an earlier run with other speeds do not stay beside them."""
    from swashplate import atomic

    old = [file.name for file in folder.glob("at-*.toml")]
    with atomic.folder_when_complete(folder, ours=old) as place:
        for model in models:
            model.save(place / f"at-{model.trim.speed:g}.toml")


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
