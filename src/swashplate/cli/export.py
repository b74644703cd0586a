"""`swash export`: a model as C, an FMU, an S-function, or matrices; a controller as C."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.export.formats import Export, Model
    from swashplate.simulation.trim import Trim


class CodePrecision(StrEnum):
    DOUBLE = "double"
    SINGLE = "single"


def export(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="A vehicle's name, a card or model file, a linear model's file (also .json or .mat of an export), "
            "or a controller's file.",
        ),
    ],
    form: Annotated[
        str,
        typer.Option(
            "--format",
            help="c: C99 step, rates, Jacobians. fmu: FMI 2.0 co-simulation. simulink: S-function. control: JSON for "
            "python-control. matlab: .mat. web: one HTML file in which the model flies, for any browser. "
            "Or another package's.",
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", "-o", metavar="DIR|FILE", help="Folder, made if missing; or one file's name."),
    ] = Path("."),
    speed: Annotated[
        str | None,
        typer.Option(
            "--speed", metavar="V", help="Speed ahead [m/s] of the flight that it starts from; hover if not given."
        ),
    ] = None,
    precision: Annotated[CodePrecision, typer.Option("--precision", help="Number type in C.")] = CodePrecision.DOUBLE,
    name: Annotated[
        str | None,
        typer.Option("--name", help="Prefix of files and C functions; by default the model's name."),
    ] = None,
    delays: Annotated[
        bool | None,
        typer.Option("--delays/--no-delays", help="Include the model's identified input delays, or leave them out."),
    ] = None,
    mass: given.Mass = None,
    changed: given.Set = None,
    switched: given.Switch = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a model, published or identified, in the format of another program, with the equations that fly here.

    A controller's file (`swash decouple --out`) is written as C. Formats c, fmu, simulink and web need the extra
    'model', web the extra 'compiler' too; fmu has compiled code where there is a C compiler. Examples:

    swash export coax --format c --out firmware

    swash export fit/model.toml --format fmu

    swash export raptor50 --format matlab --speed 10

    swash export fit/model.toml --format web --out model.html
    """
    import swashplate as sp
    from swashplate.cli.console import as_json
    from swashplate.documents import kind_of
    from swashplate.export.formats import FORMATS

    if form not in FORMATS:
        raise SwashError(f"'{form}' is no format.", channel="--format", hint=f"There are {', '.join(FORMATS)}.")
    one_file = out.suffix in _ENDINGS and not out.is_dir()
    name = out.stem if one_file and name is None else name
    only_vehicles = {"--speed": speed, "--mass": mass, "--set": changed, "--option": switched, "--delays": delays}
    refused = [option for option, value in only_vehicles.items() if value is not None]
    if kind_of(model) == "controller":
        if form != "c":
            raise SwashError("is a controller: --format c writes its step.", where=model, channel=f"--format {form}")
        if refused:
            raise SwashError("is for vehicles, and this is a controller.", where=model, channel=", ".join(refused))
        made = sp.export_controller(model, name=name, precision=precision.value)
    else:
        exported, trim = _model(model, speed, mass, changed, switched)
        made = sp.export_model(
            exported, form, name=name or Path(model).stem, trim=trim, precision=precision.value, delays=delays
        )
    written = [str(file) for file in (_as_file(made, out).save(out.parent) if one_file else made.save(out))]
    if json:
        typer.echo(as_json({"files": written, "notes": list(made.notes)}))
        return
    for note in made.notes:
        typer.echo(f"Note: {note}", err=True)
    if not quiet:
        typer.echo(f"Written: {', '.join(written)}")


_ENDINGS = (".c", ".fmu", ".html", ".json", ".mat")


def _as_file(made: Export, out: Path) -> Export:
    """The files with the name that one of them was given."""
    alike = [file for file in made.files if Path(file).suffix == out.suffix]
    if not alike:
        raise SwashError(
            f"ends in '{out.suffix}', and the format writes {', '.join(made.files)}.",
            where=out,
            channel="--out",
            hint="Give a folder, or a name that ends so.",
        )
    if out.name in made.files:
        return made
    return replace(made, files={out.name if file == alike[0] else file: text for file, text in made.files.items()})


def _model(
    model: str, speed: str | None, mass: float | None, changed: list[str] | None, switched: list[str] | None
) -> tuple[Model, Trim | None]:
    """What is exported, and the trim where it starts (None: a linear model has no other)."""
    if Path(model).suffix.lower() in (".json", ".mat") or given.linear_model(model) is not None:
        from swashplate.api.export import opened

        if speed is not None or mass is not None or changed or switched:
            raise SwashError(
                "is a linear model: it has no speed, card or options to change.",
                where=model,
                hint="Export it as it is.",
            )
        return opened(model), None
    asked = given.conditions(model, speed=speed or "0", mass=mass, changed=changed, switched=switched)
    if len(asked.speeds) != 1:
        raise SwashError("takes one speed.", channel="--speed", hint="Give a single number.")
    return asked.vehicle, asked.trims()[0]
