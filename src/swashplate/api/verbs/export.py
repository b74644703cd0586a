"""`swash export`: a model as C, an FMU, an S-function, or matrices; a controller as C; a log as a page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.api.asking import OfVehicle, drawn, linear_model
from swashplate.api.languages import Aircraft, Names, Words
from swashplate.api.question import argument, option, setting
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
    extra 'model', web the extra 'compiler' too; fmu has compiled code where there is a C compiler. Examples:

    swash export coax --format c --out firmware

    swash export fit/model.toml --format fmu

    swash export fit/model.toml --format web --out model.html

    swash export raptor50 --format matlab --speed 10

    swash export flight.bin --format web --out flight.html
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
    out: Path = option(default=Path("."), metavar="DIR|FILE", help="Folder, made if missing; or one file's name.")
    speed: float | None = option(
        default=None, help="Speed ahead of the flight that it starts from; hover if not given.", unit="m/s"
    )
    precision: str = option(default="double", help="Number type of C.", choices=("double", "float"))
    name: str | None = option(default=None, help="Prefix of files and C functions; by default the model's name.")
    delays: bool | None = setting(default=None, help="whether the model's identified input delays are included")
    controller: Path | None = setting(default=None, help="with web: a controller's file, which flies the model")
    posterior: Aircraft | None = setting(
        default=None, metavar="FILE", help="with web: a fit.json of this model: models drawn from it fly beside it"
    )
    draws: int = setting(default=5, help="with posterior: how many", least=2, most=20)
    flight: Path | None = setting(
        default=None, metavar="LOG", help="with web: the flight that the model was learnt from, which replays beside it"
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

    def answer(self, say: Say = silent) -> Exported:
        made = self.made(say)
        object.__setattr__(self, "_written", self._save(made))
        return made

    def made(self, say: Say = silent) -> Exported:
        """What is exported, before it is written."""
        from swashplate.api.export import export_controller, export_model
        from swashplate.documents import kind_of
        from swashplate.export.formats import FORMATS
        from swashplate.flights.readers.options import is_log

        if self.form not in FORMATS:
            hint = f"There are {', '.join(FORMATS)}."
            raise SwashError(f"'{self.form}' is no format.", channel="--format", hint=hint)
        one_file = self.out.suffix in _ENDINGS and not self.out.is_dir()
        name = self.out.stem if one_file and self.name is None else self.name
        if is_log(self.model, matrices=self.form != "web"):
            return self._page(name, say)
        only_vehicles = {"--speed": self.speed, "--set": self.changes, "delays": self.delays}
        refused = [option for option, value in only_vehicles.items() if value is not None]
        if isinstance(self.model, str | Path) and kind_of(self.model) == "controller":
            where = str(self.model)
            if self.form != "c":
                raise SwashError(
                    "is a controller: --format c writes its step.", where=where, channel=f"--format {self.form}"
                )
            if refused:
                raise SwashError("is for vehicles, and this is a controller.", where=where, channel=", ".join(refused))
            return export_controller(self.model, name=name, precision=self._precision())
        exported, trim = self._model()
        stem = Path(self.model).stem if isinstance(self.model, str | Path) else None
        return export_model(
            exported,
            self.form,
            name=name or stem,
            trim=trim,
            precision=self._precision(),
            delays=self.delays,
            controller=self.controller,
            draws=() if self.posterior is None else drawn(exported, self.posterior, count=self.draws),
            flight=None if self.flight is None else self._logged(self.flight),
        )

    def _logged(self, log: Path) -> Any:
        from swashplate.flights.readers.read import read

        stamps = "drop" if self.drop_bad_stamps else "error"
        return read(log, mapping=self.mapping, units=self.units, bad_stamps=stamps)

    def _page(self, name: str | None, say: Say) -> Exported:
        """The page of a log."""
        from swashplate.api.web_log import export_log

        where, form = str(self.model), f"--format {self.form}"
        if self.form != "web":
            raise SwashError("is a log: --format web writes its page.", where=where, channel=form)
        given = {
            "--speed": self.speed,
            "--set": self.changes,
            "delays": self.delays,
            "controller": self.controller,
            "flight": self.flight,
        }
        refused = [one for one, value in {**given, "posterior": self.posterior}.items() if value is not None]
        if refused:
            raise SwashError("is for vehicles, and this is a log.", where=where, channel=", ".join(refused))
        stamps = "drop" if self.drop_bad_stamps else "error"
        keep = (self.keep,) if isinstance(self.keep, str) else self.keep
        return export_log(
            where, name=name, keep=keep, units=self.units, mapping=self.mapping, bad_stamps=stamps, say=say
        )

    def _precision(self) -> Any:
        return "single" if self.precision == "float" else "double"

    def _save(self, made: Exported) -> list[str]:
        one_file = self.out.suffix in _ENDINGS and not self.out.is_dir()
        return [
            str(file) for file in (_as_file(made, self.out).save(self.out.parent) if one_file else made.save(self.out))
        ]

    def _model(self) -> tuple[Any, Any]:
        """What is exported, and the trim where it starts (None: a linear model has no other)."""
        given = self.model
        if (isinstance(given, str | Path) and Path(given).suffix.lower() in (".json", ".mat")) or linear_model(
            given
        ) is not None:
            from swashplate.api.export import opened

            if self.speed is not None or self.changes:
                raise SwashError(
                    "is a linear model: it has no speed, card or options to change.",
                    where=str(given),
                    hint="Export it as it is.",
                )
            return opened(given), None
        from swashplate.simulation.trim_curve import trim_curve

        vehicle = self.flying(given)
        return vehicle, trim_curve(vehicle, (self.speed or 0.0,)).trims[0]

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
