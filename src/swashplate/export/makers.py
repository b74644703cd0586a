"""The formats of this package: each a function from an `ExportRequest` to its files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from swashplate.errors import ExportError
from swashplate.export.formats import Export, ExportRequest
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

if TYPE_CHECKING:
    from swashplate.export.ardupilot_state_space import Sticks
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

    return Export(_encoded({f"{asked.name}_control.json": control_json(asked.linear())}))


def matlab(asked: ExportRequest) -> Export:
    """A `.mat` file of matrices and names."""
    from swashplate.export import matlab as files

    return Export({f"{asked.name}.mat": files.matlab(asked.linear())})


def ardupilot(asked: ExportRequest) -> Export:
    """ArduPilot's state-space JSON for SITL."""
    from swashplate.export.ardupilot_state_space import Sticks, ardupilot_state_space, to_json

    model, about = asked.model, asked.about
    sticks = _sticks(model, about) if about is not None and isinstance(model, Vehicle) else Sticks({})
    numbers, notes = ardupilot_state_space(asked.linear(), sticks)
    return Export(_encoded({f"{asked.name}_ardupilot.json": to_json(numbers)}), notes)


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


def _traced(asked: ExportRequest) -> Traced:
    from swashplate.export.traced import trace_linear, trace_vehicle

    model, about = asked.model, asked.about
    if not isinstance(model, Vehicle):
        return trace_linear(asked.linear(), name=asked.name)
    assert about is not None
    return trace_vehicle(model, about, name=asked.name, delays=asked.late)


def _encoded(texts: Mapping[str, str]) -> dict[str, bytes]:
    return {name: text.encode("utf-8") for name, text in texts.items()}
