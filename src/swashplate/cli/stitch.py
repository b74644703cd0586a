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
    points: Annotated[list[str], typer.Argument(metavar="POINT...", help="Model files, one a speed, or their folder.")],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE.toml", help="The model to write.")],
    trim: Annotated[
        list[str] | None,
        typer.Option(
            "--trim", metavar="LOG", help="Flight whose mean values are a point's trim; one for each point, in order."
        ),
    ] = None,
    gradients: Annotated[
        Gradients | None,
        typer.Option(
            "--gradients",
            help="How trims change with speed: from the points' derivatives, or from differences of the trims "
            "(default for identified points).",
        ),
    ] = None,
    title: Annotated[str, typer.Option("--title", help="Title of the model.")] = "",
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
    files = [file for point in points for file in _files(Path(point))]
    if flights and len(flights) != len(files):
        raise SwashError(f"{len(flights)} logs for {len(files)} points, expected one each.", channel="--trim")
    how = None if gradients is None else gradients.value
    made = sp.stitch(files, trims=flights or None, gradients=how, title=title)  # one of two
    made.save(out)
    if not quiet:
        typer.echo(repr(made))
        typer.echo(f"Written: {out}")


def _files(place: Path) -> list[Path]:
    """A point's file, or those of a folder."""
    if not place.is_dir():
        return [place]
    files = sorted(place.glob("*.toml"))
    if not files:
        raise SwashError("has no .toml file in it.", where=place, channel="POINT")
    return files
