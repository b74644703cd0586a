"""`swash demo`: the main job on the real flights where they are found, otherwise on simulated ones."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options


def demo(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder for the results.")] = Path("demo"),
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Use simulated flights even if real ones are available.")
    ] = False,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the simulated flights' noise.", min=0)] = 1,
    quiet: options.Quiet = False,
) -> None:
    """Run the main job: identify the CoaX from one flight and predict another, with a report.

    On the real flights of the data set coax56 where they are found on this machine, otherwise on simulated flights
    with sensor noise, gaps and outliers (the report's first line says so).
    """
    import swashplate as sp
    from swashplate.cli import identify

    made = identify.carried_out(lambda say: sp.demo(simulated=simulated, seed=seed, say=say), out=out, quiet=quiet)
    if any(source.simulated for source in made.fit.data) and not quiet:
        typer.echo("On simulated flights; `swash data fetch coax56` gets the real ones.\n")
    identify.show(made, out=out, json=False, quiet=quiet)
    if made.fit.beside_truth and not quiet:
        typer.echo(f"Truth:      {made.fit.beside_truth}")
    if made.fit.failed:
        raise typer.Exit(1)  # the input was ours
