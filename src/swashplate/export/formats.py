"""From a model to the files of one format."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from swashplate.atomic import write_bytes
from swashplate.errors import ExportError
from swashplate.export.c_text import Precision, identifier
from swashplate.export.linear import Linear, logged_delays, of_state_space, of_vehicle
from swashplate.identification.state_space import StateSpaceModel
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim import trim as find_trim
from swashplate.vehicles.vehicle import Vehicle

if TYPE_CHECKING:
    from swashplate.export.ardupilot_state_space import Sticks
    from swashplate.export.traced import Traced

Format = Literal["c", "fmu", "ardupilot-statespace", "control", "matlab", "simulink"]
Model = Vehicle | StateSpaceModel | Linear


@dataclass(frozen=True)
class Export:
    """Files of one format.

    Attributes:
        files: contents by name. notes: what a user must know about them.
    """

    files: Mapping[str, bytes]
    notes: tuple[str, ...] = ()

    def save(self, folder: str | Path) -> list[Path]:
        """Write the files; the folder is made if missing. Returns their paths."""
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        return [write_bytes(place / name, content) for name, content in self.files.items()]


def export_model(
    model: Model,
    form: Format,
    *,
    name: str,
    trim: Trim | None = None,
    precision: Precision = "double",
    delays: bool = False,
) -> Export:
    """A vehicle or a linear model in another program's format.

    Args:
        model: a vehicle (packaged, a card's or identified) or a linear model, as `swash fit-ss` writes it or as
            `read_linear` and `read_matlab` read it.
        form: "c", "fmu", "ardupilot-statespace", "control", "matlab" or "simulink".
        name: what files and C functions begin with.
        trim: where a vehicle starts, and what its linear model is about; hover where none is given.
        precision: of C ("double" or "single"); the other formats are double.
        delays: take along what an identified vehicle's motion lagged its logged inputs by. A linear model has its own.

    Raises:
        ExportError: where the format cannot hold the model, CasADi is missing, or the compiler refuses the sources.
        TrimError: where a vehicle has no hover.
    """
    if form not in _MAKERS:
        raise ExportError(f"'{form}' is no format.", channel="--format", hint=f"There are {', '.join(_MAKERS)}.")
    if precision != "double" and form != "c":
        raise ExportError(f"numbers of '{form}' are double.", channel="--precision", hint="It is for --format c.")
    if trim is not None and not isinstance(model, Vehicle):
        raise ExportError("a linear model holds at the one flight that it was identified in.", channel="--speed")
    if delays and not isinstance(model, Vehicle):
        raise ExportError("a linear model brings its own delays.", channel="--delays", hint="Leave it out.")
    late = logged_delays(model) if delays and isinstance(model, Vehicle) else None
    called = identifier(name)
    about = trim
    if isinstance(model, Vehicle) and about is None:
        about = find_trim(model, voltage=model.card.values().get("voltage_nominal"))
    return _MAKERS[form](_Asked(model, about, late), called, precision)


@dataclass(frozen=True)
class _Asked:
    """What is exported: a model, where it starts, and delays of a vehicle's inputs [s]."""

    model: Model
    about: Trim | None
    late: Mapping[str, float] | None


def _linear(asked: _Asked, name: str) -> Linear:
    model, about = asked.model, asked.about
    if isinstance(model, Linear):
        return replace(model, name=name)
    if isinstance(model, StateSpaceModel):
        return of_state_space(model, name=name)
    assert about is not None
    return of_vehicle(model, about, name=name, delays=asked.late)


def _c(asked: _Asked, name: str, precision: Precision) -> Export:
    from swashplate.export.model_c import model_code
    from swashplate.export.traced import late_notes

    traced = _traced(asked, name)
    return Export(_encoded(model_code(traced, precision=precision).files()), (*traced.notes, *late_notes(traced)))


def _fmu(asked: _Asked, name: str, precision: Precision) -> Export:
    from importlib import metadata

    from swashplate.export.fmu import fmu

    traced = _traced(asked, name)
    content, message = fmu(traced, version=metadata.version("swashplate"))
    return Export({f"{name}.fmu": content}, (*traced.notes, *([message] if message else [])))


def _simulink(asked: _Asked, name: str, precision: Precision) -> Export:
    from swashplate.export.simulink import simulink
    from swashplate.export.traced import late_notes

    traced = _traced(asked, name)
    return Export(_encoded(simulink(traced)), (*traced.notes, *late_notes(traced)))


def _control(asked: _Asked, name: str, precision: Precision) -> Export:
    from swashplate.export.control_json import control_json

    return Export(_encoded({f"{name}_control.json": control_json(_linear(asked, name))}))


def _matlab(asked: _Asked, name: str, precision: Precision) -> Export:
    from swashplate.export.matlab import matlab

    return Export({f"{name}.mat": matlab(_linear(asked, name))})


def _ardupilot(asked: _Asked, name: str, precision: Precision) -> Export:
    from swashplate.export.ardupilot_state_space import Sticks, ardupilot_state_space, to_json

    model, about = asked.model, asked.about
    sticks = _sticks(model, about) if about is not None and isinstance(model, Vehicle) else Sticks({})
    numbers, notes = ardupilot_state_space(_linear(asked, name), sticks)
    return Export(_encoded({f"{name}_ardupilot.json": to_json(numbers)}), notes)


def _sticks(vehicle: Vehicle, trim: Trim) -> Sticks:
    """Full sticks from a single-rotor card: cyclic to its stop, collective and tail over their whole ranges."""
    from swashplate.export.ardupilot_state_space import Sticks

    limits = dict(zip(vehicle.input_names, vehicle.input_limits, strict=True))
    whole = {name: high - low for name, (low, high) in limits.items()}
    reach = {name: whole[name] if name == "theta0" else whole[name] / 2.0 for name in whole}
    if "theta0" not in limits:
        return Sticks(reach)
    if trim.speed or trim.lateral or trim.climb or trim.turn:
        raise ExportError("the format's equations are about hover.", channel="--speed", hint="Leave it out.")
    commands, states = trim.commands(), trim.states()
    return Sticks(reach, states["phi"], float(vehicle.values().rotor_speed), (*limits["theta0"], commands["theta0"]))


def _traced(asked: _Asked, name: str) -> Traced:
    from swashplate.export.traced import trace_linear, trace_vehicle

    model, about = asked.model, asked.about
    if not isinstance(model, Vehicle):
        return trace_linear(_linear(asked, name), name=name)
    assert about is not None
    return trace_vehicle(model, about, name=name, delays=asked.late)


def _encoded(texts: Mapping[str, str]) -> dict[str, bytes]:
    return {name: text.encode("utf-8") for name, text in texts.items()}


_MAKERS: Mapping[Format, Callable[[_Asked, str, Precision], Export]] = {
    "c": _c,
    "fmu": _fmu,
    "ardupilot-statespace": _ardupilot,
    "control": _control,
    "matlab": _matlab,
    "simulink": _simulink,
}
