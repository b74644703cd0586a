"""`swash structures`: what linear models can be made of, and the equations of one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.cli.usual_verb import usual
from swashplate.errors import SwashError

app = typer.Typer(
    cls=usual("show"),
    help="Structures of linear models: ready ones, and parts to compose others of.",
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def main(ctx: typer.Context, json: options.Json = False) -> None:
    """List the structures, or show one."""
    if ctx.invoked_subcommand is None:
        list_(json=json)


@app.command("list")
def list_(json: options.Json = False) -> None:
    """List the ready structures, and the parts that `compose:` takes."""
    import swashplate as sp
    from swashplate.cli.console import as_json

    ready = sp.structures()
    typer.echo(as_json(ready.as_dict()) if json else repr(ready))


@app.command()
def show(
    structure: Annotated[
        str, typer.Argument(metavar="STRUCTURE", help="A ready structure, compose:body+flap+..., or a model file.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="Also write it as a model file.")
    ] = None,
    json: options.Json = False,
) -> None:
    """Show equations and free parameters, with units, start values and where these come from."""
    import swashplate as sp
    from swashplate.cli.console import as_json

    shown = sp.show_structure(structure)
    if out is not None:
        if out.exists():
            raise SwashError("exists already; it is not overwritten.", where=out, hint="Choose another name.")
        sp.structure(structure).save(out)
    typer.echo(as_json(shown.as_dict()) if json else repr(shown))
    if out is not None and not json:
        typer.echo(f"\nWritten: {out}. Fit it: swash fit-ss {out} RESPONSES")
