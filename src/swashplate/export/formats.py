"""From a model to the files of one format."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.atomic import folder_when_complete, write_bytes
from swashplate.engine.emit import identifier
from swashplate.engine.statements import Precision
from swashplate.errors import ExportError
from swashplate.export.linear import Linear, logged_delays, of_state_space, of_vehicle
from swashplate.export.origin import origin_of
from swashplate.flights.flight import Flight
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.residual import refuse_predictor
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.registry import Registry
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim import trim as find_trim

if TYPE_CHECKING:
    from swashplate.export.traced import Traced


def c(asked: ExportRequest) -> Export:
    """C99 source and header: step, rates and Jacobians."""
    from swashplate.export.model_c import model_code
    from swashplate.export.traced import late_notes

    traced = _traced(asked)
    return Export(_encoded(model_code(traced, precision=asked.precision).files()), late_notes(traced))


def fmu(asked: ExportRequest) -> Export:
    """An FMI 2.0 co-simulation unit."""
    from importlib import metadata

    from swashplate.export import fmu as unit

    traced = _traced(asked)
    content, message = unit.fmu(traced, version=metadata.version("swashplate"))
    return Export({f"{asked.name}.fmu": content}, (message,) if message else ())


def simulink(asked: ExportRequest) -> Export:
    """A C S-function and what builds it."""
    from swashplate.export import simulink as blocks
    from swashplate.export.traced import late_notes

    traced = _traced(asked)
    return Export(_encoded(blocks.simulink(traced)), late_notes(traced))


def control(asked: ExportRequest) -> Export:
    """JSON for python-control."""
    from swashplate.export.control_json import control_json

    return Export(_encoded({f"{asked.name}_control.json": control_json(asked.linear(), origin=asked.origin)}))


def matlab(asked: ExportRequest) -> Export:
    """A `.mat` file of matrices and names."""
    from swashplate.export import matlab as files

    return Export({f"{asked.name}.mat": files.matlab(asked.linear(), origin=asked.origin)})


def _traced(asked: ExportRequest) -> Traced:
    from swashplate.export.traced import trace_linear, trace_vehicle

    model, about = asked.model, asked.about
    if not isinstance(model, Vehicle):
        return replace(trace_linear(asked.linear(), name=asked.name), origin=asked.origin)
    assert about is not None
    return replace(trace_vehicle(model, about, name=asked.name, delays=asked.late), origin=asked.origin)


def _encoded(texts: Mapping[str, str]) -> dict[str, bytes]:
    return {name: text.encode("utf-8") for name, text in texts.items()}


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
        with folder_when_complete(place, ours=self.files) as here:
            for name, content in self.files.items():
                write_bytes(here / name, content)
        return [place / name for name in self.files]


@dataclass(frozen=True)
class ExportRequest:
    """What a format is asked to hold.

    Attributes:
        model: a vehicle or a linear model.
        name: what files and C functions begin with.
        about: the trim where a vehicle starts; None for a linear model.
        late: delays of a vehicle's inputs [s], None for none.
        precision: of numbers in C.
        controller: what flies it where the format is flown; None for the page's own.
        draws: models that a fit cannot tell from it, for formats that show them.
        origin: commit, card and data that it was made from, a line each.
        flight: that it was learnt from, for formats that show it.
    """

    model: Model
    name: str
    about: Trim | None
    late: Mapping[str, float] | None
    precision: Precision
    controller: Controller | None = None
    draws: tuple[Vehicle, ...] = ()
    origin: tuple[str, ...] = ()
    flight: Flight | None = None

    def linear(self) -> Linear:
        """The model as matrices."""
        if isinstance(self.model, Linear):
            return replace(self.model, name=self.name)
        if isinstance(self.model, StateSpaceModel):
            return of_state_space(self.model, name=self.name)
        assert self.about is not None
        return of_vehicle(self.model, self.about, name=self.name, delays=self.late)


Maker = Callable[[ExportRequest], Export]
FORMATS: Registry[Maker] = Registry(
    "exports",
    what="format",
    own={
        "c": "swashplate.export.formats:c",
        "fmu": "swashplate.export.formats:fmu",
        "control": "swashplate.export.formats:control",
        "matlab": "swashplate.export.formats:matlab",
        "simulink": "swashplate.export.formats:simulink",
        "web": "swashplate.api.web_page:web",
    },
)
"""A format is a function from an `ExportRequest` to an `Export`; other packages add theirs by an entry point."""


def export_model(
    model: Model,
    form: str,
    *,
    name: str,
    trim: Trim | None = None,
    precision: Precision = "double",
    delays: bool | None = None,
    controller: Controller | None = None,
    draws: Sequence[Vehicle] = (),
    flight: Flight | None = None,
) -> Export:
    """A vehicle or a linear model in another program's format.

    Args:
        model: a vehicle (packaged, a card's or identified) or a linear model, as `swash identify` writes it or as
            `read_linear` and `read_matlab` read it.
        form: "c", "fmu", "control", "matlab", "simulink", "web", or another package's (`FORMATS`).
        name: what files and C functions begin with.
        trim: where a vehicle starts, and what its linear model is about; hover where none is given.
        precision: of C ("double" or "single"); the other formats are double.
        delays: take along what an identified vehicle's motion lagged its logged inputs by; where not given, where the
            card knows it. A linear model has its own, unless they are not to be taken along (False).
        controller: what flies it on the page of "web"; its own pilot where None.
        draws: models that a fit cannot tell from it (`fit.draw(5)`), which fly beside it on that page.
        flight: that it was learnt from, which flies beside it there too.

    Raises:
        ExportError: where the format cannot hold the model, CasADi is missing, or the compiler refuses the sources.
        CardError: for a model whose residual is for predictions only.
        TrimError: where a vehicle has no hover.
    """
    if form not in FORMATS:
        raise ExportError(f"'{form}' is no format.", channel="--format", hint=f"There are {', '.join(FORMATS)}.")
    if precision != "double" and form != "c":
        raise ExportError(f"numbers of '{form}' are double.", channel="--precision", hint="It is for --format c.")
    if (controller or draws or flight) and form != "web":
        raise ExportError(
            f"'{form}' holds no controller, no drawn models and no flight.", channel="--format", hint="web does."
        )
    flying = model if isinstance(model, Vehicle) and model.structure is None else None
    late, left_out, about, origin = None, "", trim, origin_of(model)
    if flying is None:
        model = model.structure or model if isinstance(model, Vehicle) else model
        if trim is not None:
            raise ExportError("a linear model holds at the one flight that it was identified in.", channel="--speed")
        if delays:
            raise ExportError("a linear model brings its own delays.", channel="--delays", hint="Leave it out.")
        if delays is False:
            model, left_out = _without_delays(model, name)
    else:
        refuse_predictor(flying, "exports")
        known = logged_delays(flying) if delays else input_delays(flying)
        late = None if delays is False else known or None
        if delays is False and any(known.values()):
            listed = ", ".join(f"{name} {1e3 * d:.3g} ms" for name, d in known.items() if d)
            left_out = f"Left out: the identified delays of the inputs ({listed})."
        about = trim or find_trim(flying)
    called = identifier(name)
    written = FORMATS[form](
        ExportRequest(model, called, about, late, precision, controller, tuple(draws), origin, flight)
    )
    return replace(written, notes=(*written.notes, left_out)) if left_out else written


def _without_delays(model: Model, name: str) -> tuple[Linear, str]:
    """A linear model's matrices alone, and what was left out."""
    if isinstance(model, Linear):
        undelayed, known = model, dict(model.delays)
    else:
        structure = structure_of(model)
        undelayed = of_state_space(replace(structure, delays={}), name=name)
        known = {key: float(expression(structure.numbers())) for key, expression in structure.delays.items()}
    left = {name: delay for name, delay in known.items() if delay}
    listed = ", ".join(f"{name} {1e3 * delay:.3g} ms" for name, delay in left.items())
    return replace(undelayed, delays={}), f"Left out: the model's delays ({listed})." if left else ""
