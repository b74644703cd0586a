"""Models and controllers in the formats of other programs, from what a user calls them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.api.asking import drawn, linear_model, strings
from swashplate.api.saying import Say
from swashplate.control.kinds import load_controller
from swashplate.documents import kind_of
from swashplate.engine.emit import identifier
from swashplate.errors import ExportError, SwashError
from swashplate.export import formats
from swashplate.export.control_json import read_linear
from swashplate.export.controller_c import controller_code
from swashplate.export.formats import Export, Model
from swashplate.export.linear import Linear
from swashplate.export.matlab import read_matlab
from swashplate.flights.readers.options import is_log
from swashplate.models.catalogue import vehicle as find
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim_curve import trim_curve

if TYPE_CHECKING:
    from swashplate.api.verbs.export import ExportModel


def export_asked(asked: ExportModel, say: Say) -> Export:
    """The files that were asked for."""
    if asked.form not in formats.FORMATS:
        hint = f"There are {', '.join(formats.FORMATS)}."
        raise ExportError(f"'{asked.form}' is no format.", channel="--format", hint=hint)
    given, flown, name = asked.model, asked.controller, asked.name
    if name is None and asked.one_file and asked.out is not None:
        name = asked.out.stem
    if is_log(given, matrices=asked.form != "web"):
        return _page(asked, name, say)
    if isinstance(given, str | Path):
        if kind_of(given) == "controller":
            return _controller(asked, given, name)
        name = name or Path(given).stem
    model, at = _model(asked)
    return formats.export_model(
        model,
        asked.form,
        name=name or model.name,
        trim=at,
        precision="single" if asked.precision == "float" else "double",
        delays=asked.delays,
        controller=load_controller(flown) if isinstance(flown, str | Path) else flown,
        draws=_draws(asked, model),
        flight=asked.logged(),
    )


def _page(asked: ExportModel, name: str | None, say: Say) -> Export:
    """The page of a log."""
    from swashplate.api.web_log import export_log

    where, form = str(asked.model), f"--format {asked.form}"
    if asked.form != "web":
        raise SwashError("is a log: --format web writes its page.", where=where, channel=form)
    given = {"--speed": asked.speed, "--set": asked.changes, "delays": asked.delays, "controller": asked.controller}
    given |= {"posterior": asked.posterior, "flight": asked.flight}
    refused = [one for one, value in given.items() if value is not None]
    if refused:
        raise SwashError("is for vehicles, and this is a log.", where=where, channel=", ".join(refused))
    stamps = "drop" if asked.drop_bad_stamps else "error"
    return export_log(
        where,
        name=name,
        keep=strings(asked.keep),
        units=asked.units,
        mapping=asked.mapping,
        bad_stamps=stamps,
        say=say,
    )


def _controller(asked: ExportModel, path: str | Path, name: str | None) -> Export:
    """A controller's file as the C of its step."""
    if asked.form != "c":
        raise SwashError("is a controller: --format c writes its step.", where=path, channel=f"--format {asked.form}")
    only_vehicles = {"--speed": asked.speed, "--set": asked.changes, "delays": asked.delays}
    if refused := [option for option, value in only_vehicles.items() if value is not None]:
        raise SwashError("is for vehicles, and this is a controller.", where=path, channel=", ".join(refused))
    code = controller_code(load_controller(path), precision=asked.precision)  # pyrefly: ignore[bad-argument-type]
    told = f"One step: {code.operations} operations, {code.work_bytes} bytes of temporaries."
    return Export({f"{identifier(name or Path(path).stem)}.c": code.source.encode()}, (told,))


def _model(asked: ExportModel) -> tuple[Model, Trim | None]:
    """What is exported, and the trim where it starts (None: a linear model has no other)."""
    given = asked.model
    ending = Path(given).suffix.lower() if isinstance(given, str | Path) else ""
    model: Model
    if ending in _MATRICES:
        model = _MATRICES[ending](given)
    elif isinstance(given, Linear | StateSpaceModel):
        model = given
    elif (isinstance(given, Vehicle) and given.structure is not None) or linear_model(given) is not None:
        model = find(given) if isinstance(given, str | Path) else given
    else:
        vehicle = asked.flying(given)
        return vehicle, trim_curve(vehicle, (asked.speed or 0.0,)).trims[0]
    if asked.speed is not None or asked.changes:
        hint = "Export it as it is."
        raise SwashError("is a linear model: it has no speed, card or options to change.", where=str(given), hint=hint)
    return model, None


def _draws(asked: ExportModel, model: Model) -> Sequence[Vehicle]:
    if not isinstance(asked.draws, int):
        return asked.draws
    if asked.posterior is None or not isinstance(model, Vehicle):
        return ()
    return drawn(model, asked.posterior, count=asked.draws)


_MATRICES: Mapping[str, Callable[[str | Path], Linear]] = {".json": read_linear, ".mat": read_matlab}
"""What an export wrote, by its ending."""
