"""`swash export`: a model as C, an FMU, an S-function, or matrices for other programs; a controller as C."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.export.formats import Export


class Format(StrEnum):
    C = "c"
    FMU = "fmu"
    ARDUPILOT = "ardupilot-statespace"
    CONTROL = "control"
    MATLAB = "matlab"
    SIMULINK = "simulink"


class Precision(StrEnum):
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
        Format,
        typer.Option(
            "--format",
            help="c: C99 step, rates, Jacobians. fmu: FMI 2.0 co-simulation. simulink: S-function. control: JSON for "
            "python-control. matlab: .mat. ardupilot-statespace: JSON for SITL.",
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the files; it is made if missing.")
    ] = Path("."),
    speed: Annotated[
        str | None,
        typer.Option(
            "--speed", metavar="V", help="Speed ahead [m/s] of the flight that it starts from; hover if not given."
        ),
    ] = None,
    precision: Annotated[Precision, typer.Option("--precision", help="Of the numbers in C.")] = Precision.DOUBLE,
    name: Annotated[
        str | None,
        typer.Option("--name", help="What files and C functions begin with; the model's own name if not given."),
    ] = None,
    delays: Annotated[
        bool, typer.Option("--delays", help="Take along by how much an identified model's motion lagged its inputs.")
    ] = False,
    mass: given.Mass = None,
    changed: given.Set = None,
    switched: given.Switch = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a model, published or identified, in the format of another program, with the equations that fly here.

    A controller's file (`swash decouple --out`) is written as C. Formats c, fmu and simulink need the extra 'export';
    only fmu needs a C compiler, and does without where there is none. Examples:

    swash export coax --format c --out firmware

    swash export fit/model.toml --format fmu

    swash export raptor50 --format matlab --speed 10
    """
    from swashplate.cli.console import as_json
    from swashplate.cli.outputs import folder_when_complete

    called = name or Path(model).stem
    if _kind(model) == "controller":
        only_vehicles = {"--speed": speed, "--mass": mass, "--set": changed, "--option": switched}
        only_vehicles |= {"--delays": delays or None}
        made = _controller(model, form, called, precision, [k for k, v in only_vehicles.items() if v is not None])
    else:
        made = _model(model, form, called, precision, speed, mass, changed, switched, delays)
    with folder_when_complete(out, ours=()) as folder:
        assert folder is not None
        made.save(folder)
    written = [str(out / file) for file in made.files]
    if json:
        typer.echo(as_json({"files": written, "notes": list(made.notes)}))
        return
    for note in made.notes:
        typer.echo(f"Note: {note}", err=True)
    if not quiet:
        typer.echo(f"Written: {', '.join(written)}")


def _kind(model: str) -> str:
    """What a file says that it is; "" for a name, or where it says nothing."""
    import tomllib

    try:
        return str(tomllib.loads(Path(model).read_text(encoding="utf-8")).get("kind", ""))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return ""  # whoever reads it says what is wrong


def _controller(model: str, form: Format, name: str, precision: Precision, refused: list[str]) -> Export:
    from swashplate.control.controller_file import read_controller
    from swashplate.control.observed_autopilot import ObservedAutopilot
    from swashplate.export.c_text import identifier
    from swashplate.export.controller_c import controller_code
    from swashplate.export.formats import Export

    if form is not Format.C:
        raise SwashError("is a controller: --format c writes its step.", where=model, channel=f"--format {form.value}")
    if refused:
        raise SwashError("is for vehicles, and this is a controller.", where=model, channel=", ".join(refused))
    read = read_controller(model)
    if isinstance(read, ObservedAutopilot):
        raise SwashError(
            "flies on estimates, and its C is not written yet.",
            where=model,
            hint="Export the law alone (`swash decouple` without --sensors) or an LQG (`swash control design`).",
        )
    code = controller_code(read, precision="float" if precision is Precision.SINGLE else "double")
    told = f"One step: {code.operations} operations, {code.work_bytes} bytes of temporaries."
    return Export({f"{identifier(name)}.c": code.source.encode()}, (told,))


def _model(
    model: str,
    form: Format,
    name: str,
    precision: Precision,
    speed: str | None,
    mass: float | None,
    changed: list[str] | None,
    switched: list[str] | None,
    delays: bool,
) -> Export:
    import swashplate as sp
    from swashplate.export.control_json import read_linear
    from swashplate.export.formats import export_model
    from swashplate.export.matlab import read_matlab

    ending = Path(model).suffix.lower()
    if ending in (".json", ".mat") or given.linear_model(model) is not None:
        if speed is not None or mass is not None or changed or switched:
            raise SwashError(
                "is a linear model: it has no speed, card or options to change.",
                where=model,
                hint="Export it as it is.",
            )
        linear = {".json": read_linear, ".mat": read_matlab}.get(ending, sp.structure)(model)
        return export_model(linear, form.value, name=name, precision=precision.value, delays=delays)
    asked = given.conditions(model, speed=speed or "0", mass=mass, changed=changed, switched=switched)
    if len(asked.speeds) != 1:
        raise SwashError("takes one speed.", channel="--speed", hint="Give a single number.")
    trim = asked.trims()[0]
    return export_model(asked.vehicle, form.value, name=name, trim=trim, precision=precision.value, delays=delays)
