"""What the verbs that make a controller share: options, and how its results are written and shown."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.export.controller_c import ControllerCode


class Precision(StrEnum):
    DOUBLE = "double"
    FLOAT = "float"


class DesignMethod(StrEnum):
    LQG = "lqg"
    LQR = "lqr"


class Holding(StrEnum):
    PLACE = "place"
    SPEED = "speed"


class ObserverGain(StrEnum):
    FLYING = "flying"
    STEADY = "steady"


class AutopilotMode(StrEnum):
    MANUAL = "manual"
    SPEED = "speed"
    PLACE = "place"


class Mixing(StrEnum):
    ROTATION = "rotation"
    AS_PRINTED = "as_printed"


Out = Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE", help="Write the controller (.toml).")]
Rate = Annotated[float, typer.Option("--rate", help="Steps of the controller per second [Hz].", min=1.0)]
Code = Annotated[
    Path | None, typer.Option("--c", metavar="FILE", help="Write one step of it as C99 (needs the extra 'model').")
]
CPrecision = Annotated[Precision, typer.Option("--precision", help="Number type of the C code.")]


USUAL_SENSORS = "imu@100,mocap@100+10ms"
Sensors = Annotated[
    str,
    typer.Option(
        "--sensors",
        help="KIND@RATE+DELAYms, separated by commas: imu, gyro, mocap, sonar, pressure, flow (optical), compass.",
    ),
]
Model = Annotated[
    str, typer.Argument(metavar="MODEL", help="A vehicle's name or file, or a state-space file of `swash fit-ss`.")
]
Voltage = Annotated[float | None, typer.Option("--voltage", help="Battery voltage of the trims [V].")]


class Design(Protocol):
    """What a verb made."""

    def save(self, path: str | Path) -> Path: ...
    def code(self, *, precision: Any = "double") -> ControllerCode: ...
    def to_document(self) -> dict[str, Any]: ...


def check_suffixes(*files: tuple[Path | None, str, str]) -> None:
    """Refuse files of another kind before anything is computed; (file, suffix, option) each."""
    for path, suffix, option in files:
        if path is not None and path.suffix != suffix:
            raise SwashError(f"ends in '{path.suffix}', expected {suffix}.", where=path, channel=option)


def write(made: Design, *, out: Path | None, c_code: Path | None, precision: Precision) -> ControllerCode | None:
    """The controller's file and its C, where they are asked for."""
    code = None
    if c_code is not None:
        code = made.code(precision=precision.value)
        code.save(c_code)
    if out is not None:
        made.save(out)
    return code


def show(made: Any, *, written: tuple[Path | None, ...], json: bool, quiet: bool, code: str | None = None) -> None:
    """A result on the screen, as JSON or as it prints itself, and where its files are."""
    if json:
        from swashplate.json_text import as_json

        typer.echo(as_json(made.to_document()))
        return
    if quiet:
        return
    typer.echo(repr(made))
    if code is not None:
        typer.echo(f"\n{code}")
    files = ", ".join(str(path) for path in written if path is not None)
    if files:
        typer.echo(f"\nWritten: {files}")
