"""`swash control decouple`: the axes of any linear model by a matrix and by a filter, and what that reaches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import controller_options as shared
from swashplate.cli import options
from swashplate.errors import SwashError


def decouple(
    model: Annotated[
        str,
        typer.Argument(metavar="MODEL", help="A vehicle's name, its file, or a state-space file of `swash fit-ss`."),
    ],
    pair: Annotated[
        list[str] | None,
        typer.Option("--pair", metavar="INPUT=OUTPUT", help="The input that moves an output, for example lateral=p."),
    ] = None,
    frequency: Annotated[
        float, typer.Option("--frequency", help="Frequency at which the matrix decouples best [rad/s].", min=1e-3)
    ] = 3.0,
    bandwidth: Annotated[
        float, typer.Option("--bandwidth", help="Bandwidth of the filter's axes [rad/s].", min=1e-3)
    ] = 10.0,
    keep: Annotated[
        str | None,
        typer.Option("--keep", metavar="STATE,...", help="States of the filter's copy; the fast ones by default."),
    ] = None,
    at: Annotated[str, typer.Option("--at", metavar="W,...", help="Frequencies of the table [rad/s].")] = "1,3,10,20",
    speed: Annotated[float, typer.Option("--speed", help="Speed of a vehicle's steady flight [m/s].")] = 0.0,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE", help="Matrix and filter (.json).")] = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="FILE", help="The coupling and steps as HTML.")
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Decouple the axes of a linear model: by a constant matrix, and by a filter that copies its fast states.

    The table has the ratio of off-axis to on-axis response over frequency: without, with the matrix, and with the
    filter. Exit code 2 if the filter would be unstable; the matrix is still printed and written.
    """
    shared.check_suffixes((out, ".json", "--out"), (report, ".html", "--report"))
    frequencies = options.numbers(at, option="--at")
    if min(frequencies) <= 0.0:
        raise SwashError(f"'{at}' is not all positive.", channel="--at")
    import swashplate as sp
    from swashplate.cli.console import doing
    from swashplate.cli.flying import end_with

    with doing("designing the decoupling", quiet=quiet or json):
        made = sp.decouple_axes(
            sp.vehicle(model),
            pairs=options.assignments(pair, option="--pair"),
            frequency=frequency,
            bandwidth=bandwidth,
            keep=[part.strip() for part in keep.split(",")] if keep else None,
            frequencies=frequencies,
            speed=speed,
            name=model,
        )
    if out is not None:
        made.save(out)
    if report is not None:
        sp.report(made, path=report)
    shared.show(made, written=(out, report), json=json, quiet=quiet)
    end_with([] if made.problem is None else [f"No filter: {made.problem}"])
