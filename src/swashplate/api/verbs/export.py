"""`swash export`: a model as C, an FMU, an S-function, or matrices; a controller as C; a log as a page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.api.asking import OfVehicle
from swashplate.api.languages import Aircraft, Drawn, Log, Names, Pilot, Words
from swashplate.api.question import argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.export.formats import Export as Exported

_ENDINGS = (".c", ".fmu", ".html", ".json", ".mat")


class ExportModel(OfVehicle["Exported"]):
    """Write a model, published or identified, in the format of another program, with the equations that fly here.

    A log becomes a page too (--format web): what `swash open` shows of it, with its fit, gains and their sliders, in
    one file to send to others. Place, serial numbers and names are left out unless `keep` asks for them.
    A controller's file (`swash control decouple --out`) is written as C. Formats c, fmu, simulink and web need the
    extra 'model', web of other equations than a ready vehicle's the extra 'compiler' too; fmu has compiled code where
    there is a C compiler. Examples:

    swash export coax --format c --out firmware

    swash export fit/model.toml --format fmu

    swash export fit/model.toml --format web --out model.html

    swash export raptor50 --format matlab --speed 10

    swash export flight.bin --format web --out flight.html

    Raises:
        ExportError: where the format cannot hold the model, CasADi is missing, or the compiler refuses the sources.
        TrimError: where a vehicle has no hover.
    """

    model: Aircraft = argument(
        metavar="MODEL",
        help="A vehicle's name, a card or model file, a linear model's file (also .json or .mat of an export), a "
        "controller's file; a log.",
        complete="vehicle",
    )
    form: str = option(
        flag="--format",
        metavar="NAME",
        help="c: C99 step, rates, Jacobians. fmu: FMI 2.0 co-simulation. simulink: S-function. control: JSON for "
        "python-control. matlab: .mat. web: one HTML file in which the model flies, or a log with its "
        "fit, for any browser. Or another package's.",
        kw_only=False,
    )
    out: Path | None = option(
        default=None,
        metavar="DIR|FILE",
        help="Folder, made if missing, or one file's name; this folder if not given (in Python: not written).",
    )
    speed: float | None = option(
        default=None, help="Speed ahead of the flight that it starts from; hover if not given.", unit="m/s"
    )
    precision: str = option(default="double", help="Number type of C.", choices=("double", "float"))
    name: str | None = option(default=None, help="Prefix of files and C functions; by default the model's name.")
    delays: bool | None = setting(default=None, help="whether the model's identified input delays are included")
    controller: Pilot | None = setting(default=None, help="with web: a controller's file, which flies the model")
    posterior: Aircraft | None = setting(
        default=None, metavar="FILE", help="with web: a fit.json of this model: models drawn from it fly beside it"
    )
    draws: Drawn = setting(
        default=5, help="with posterior: how many; in Python also the models themselves", least=2, most=20
    )
    flight: Log | None = setting(
        default=None,
        help="with web: the flight that the model was learnt from, which replays beside it",
    )
    keep: Names = setting(
        default=(),
        metavar="KIND,...",
        help="with a log: what stays of place, serials, names, messages, date, others (channels of unknown meaning)",
    )
    mapping: Path | None = setting(
        default=None, help="with a log: TOML file that says which columns are which channels"
    )
    units: Words | None = setting(default=None, help="with a log: units of its channels or fields")
    drop_bad_stamps: bool = setting(
        default=False, help="with a log: leave out samples whose time repeats or goes backwards"
    )

    @property
    def one_file(self) -> bool:
        """Whether a file is named, and not a folder."""
        return self.out is not None and self.out.suffix in _ENDINGS and not self.out.is_dir()

    def answer(self, say: Say = silent) -> Exported:
        from swashplate.api.export import export_asked

        made = export_asked(self, say)
        if self.out is not None:
            self.finish(made)
        return made

    def logged(self) -> Any:
        """The flight to replay beside the model, as logged."""
        from swashplate.flights.readers.read import read

        if not isinstance(self.flight, str | Path):
            return self.flight
        stamps = "drop" if self.drop_bad_stamps else "error"
        return read(self.flight, mapping=self.mapping, units=self.units, bad_stamps=stamps)

    def finish(self, answer: Exported) -> None:
        if "_written" in vars(self):
            return
        out = self.out or Path()
        files = _as_file(answer, out).save(out.parent) if self.one_file else answer.save(out)
        object.__setattr__(self, "_written", list(map(str, files)))

    def document(self, answer: Exported) -> Any:
        return {"files": self._written, "notes": list(answer.notes)}

    def text(self, answer: Exported, width: int) -> list[Any]:
        return [f"Written: {', '.join(self._written)}"]

    def remarks(self, answer: Exported) -> list[str]:
        return [f"Note: {note}" for note in answer.notes]


def _as_file(made: Exported, out: Path) -> Exported:
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


export_model = verb("export_model", ExportModel)
