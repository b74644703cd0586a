"""The formats of this package: each a function from an `ExportRequest` to its files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from swashplate.export.formats import Export, ExportRequest
from swashplate.models.vehicle import Vehicle

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

    return Export(_encoded({f"{asked.name}_control.json": control_json(asked.linear())}))


def matlab(asked: ExportRequest) -> Export:
    """A `.mat` file of matrices and names."""
    from swashplate.export import matlab as files

    return Export({f"{asked.name}.mat": files.matlab(asked.linear())})


def _traced(asked: ExportRequest) -> Traced:
    from swashplate.export.traced import trace_linear, trace_vehicle

    model, about = asked.model, asked.about
    if not isinstance(model, Vehicle):
        return trace_linear(asked.linear(), name=asked.name)
    assert about is not None
    return trace_vehicle(model, about, name=asked.name, delays=asked.late)


def _encoded(texts: Mapping[str, str]) -> dict[str, bytes]:
    return {name: text.encode("utf-8") for name, text in texts.items()}
