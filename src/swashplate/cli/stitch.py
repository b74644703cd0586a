"""`swash stitch`: linear models at several speeds become one that flies from hover to forward flight."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.errors import SwashError


class Gradients(StrEnum):
    DERIVATIVES = "derivatives"
    TRIMS = "trims"


def stitch(
    points: Annotated[list[str], typer.Argument(metavar="POINT...", help="Model files, one a speed, with trims.")],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE.toml", help="The model to write.")],
    trim: Annotated[
        list[str] | None,
        typer.Option("--trim", metavar="LOG", help="Flight whose means are a point's trim; one a point, in order."),
    ] = None,
    gradients: Annotated[
        Gradients | None,
        typer.Option(
            "--gradients",
            help="How trims change with speed: as the points' derivatives say, or by differences of the trims; the "
            "default for identified points.",
        ),
    ] = None,
    title: Annotated[str, typer.Option("--title", help="What the model is.")] = "",
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    quiet: options.Quiet = False,
) -> None:
    """Stitch linear models at several speeds into one that trims, flies, exports and links like every vehicle.

    Trims and derivatives are interpolated over the air speed ahead; gravity and kinematics are nonlinear. Points are
    files of `swash linearize --out` or identified models with [trim].
    """
    import swashplate as sp
    from swashplate.cli.reading import asked, read_all

    if out.suffix != ".toml":
        raise SwashError(f"ends in '{out.suffix}', expected .toml.", where=out, channel="--out")
    flights = read_all(trim, how=asked(mapping, unit, drop_bad_stamps))
    if flights and len(flights) != len(points):
        raise SwashError(f"{len(flights)} logs for {len(points)} points, expected one each.", channel="--trim")
    made = sp.stitch(points, trims=flights or None, gradients=gradients and gradients.value, title=title)
    made.save(out)
    if not quiet:
        typer.echo(repr(made))
        typer.echo(f"Written: {out}")
