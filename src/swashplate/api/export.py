"""Models, controllers and flights in the formats of other programs, from what a user calls them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from swashplate.control.kinds import read_controller
from swashplate.engine.c_expression import Precision, identifier
from swashplate.export import formats
from swashplate.export.control_json import read_linear
from swashplate.export.controller_c import controller_code
from swashplate.export.formats import Export, Model
from swashplate.export.matlab import read_matlab
from swashplate.flights.flight import Flight
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim


def opened(model: str | os.PathLike[str]) -> Model:
    """The model that a name or a file stands for: matrices of an export, or a vehicle of any kind.

    Raises:
        SwashError: where there is none, or its file is wrong.
    """
    place = os.fspath(model)
    ending = Path(place).suffix.lower()
    if ending == ".json":
        return read_linear(place)
    if ending == ".mat":
        return read_matlab(place)
    return vehicle(place)


def export_model(
    model: str | os.PathLike[str] | Model,
    form: str,
    *,
    name: str | None = None,
    trim: Trim | None = None,
    precision: Precision = "double",
    delays: bool | None = None,
    controller: Controller | str | Path | None = None,
    draws: Sequence[Vehicle] = (),
    flight: Flight | None = None,
) -> Export:
    """A vehicle or a linear model in another program's format; `.save(folder)` writes it.

    Args:
        model: a vehicle or a linear model, or its name or file (also `.json` and `.mat` of an export).
        form: "c", "fmu", "control", "matlab", "simulink", "web" (a page in which it flies), or another package's.
        name: what files and C functions begin with; the model's own name where None.
        trim: where a vehicle starts, and what its linear model is about; hover where None.
        precision: of C ("double" or "single"); the other formats are double.
        delays: take along a vehicle's identified input delays; where the card knows them if None.
        controller: what flies it on the page of "web", or its file; the page's own pilot where None.
        draws: models that a fit cannot tell from it (`fit.draw(5)`), which fly beside it on that page.
        flight: that it was learnt from, as logged: it replays beside the model there.

    Raises:
        ExportError: where the format cannot hold the model, CasADi is missing, or the compiler refuses the sources.
        TrimError: where a vehicle has no hover.
    """
    if isinstance(model, str | os.PathLike):
        name, model = name or Path(model).stem, opened(model)
    flown = read_controller(controller) if isinstance(controller, str | Path) else controller
    return formats.export_model(
        model,
        form,
        name=name or model.name,
        trim=trim,
        precision=precision,
        delays=delays,
        controller=flown,
        draws=draws,
        flight=flight,
    )


def export_controller(path: str | Path, *, name: str | None = None, precision: Precision = "double") -> Export:
    """A controller's file as the C of its step.

    Args:
        path: what `swash control decouple` or `swash control design` wrote.
        name: what the file begins with; the controller file's name where None.
        precision: "double" or "single".

    Raises:
        SwashError: where the file is wrong, or the controller has no C yet.
    """
    read = read_controller(path)
    code = controller_code(read, precision="float" if precision == "single" else "double")
    told = f"One step: {code.operations} operations, {code.work_bytes} bytes of temporaries."
    return Export({f"{identifier(name or Path(path).stem)}.c": code.source.encode()}, (told,))
