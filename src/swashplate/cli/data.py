"""`swash data`: public data sets by name."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import options

app = typer.Typer(help="List and download public data sets.", rich_markup_mode=None, no_args_is_help=True)


@app.command("list")
def list_(json: options.Json = False) -> None:
    """List the files of every known data set and where each is found on this machine."""
    import swashplate as sp
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table

    rows = sp.datasets()
    if json:
        typer.echo(as_json([{**vars(row), "found": row.found and str(row.found)} for row in rows]))
        return
    cells = [(row.name, row.file, str(row.found or "not here"), row.description) for row in rows]
    console().print(table(("data set", "file", "where", "what"), cells, left=4))
    missing = sorted({row.name for row in rows if row.found is None})
    if missing:
        typer.echo(f"\nGet what is not here with `swash data fetch {missing[0]}`.")


@app.command()
def fetch(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The data set, as in `swash data list`.")],
    quiet: options.Quiet = False,
) -> None:
    """Download the missing files of a data set from its public address into the user's cache, checked by hash."""
    import swashplate as sp
    from swashplate.cli.console import progress

    with progress(quiet=quiet) as line:
        line.say(f"fetching {name}")
        paths = sp.fetch_dataset(name)
    if not quiet:
        typer.echo("\n".join(map(str, paths)))
