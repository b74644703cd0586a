"""The verb `load`: what was saved, read back by what its file is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from swashplate.errors import FlightError, SwashError
from swashplate.flights import hdf5
from swashplate.flights.flight import Flight
from swashplate.identification.core import result_file
from swashplate.identification.core.result import Result
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle


def load(
    path: str | os.PathLike[str], *, equations: Vehicle | None = None
) -> Result[Any, Any] | FrequencyResponse | Flight | Vehicle:
    """What a file of ours holds: a fit (.json), frequency responses or a flight (.nc), or a model (.toml).

    Args:
        path: the file.
        equations: of a fit: the vehicle whose equations it is of, for equations that are no part of the package and of
            no entry point of the group `swashplate.models`.

    Returns:
        A fit whole: estimates, matrices, comparisons with the data, and the model.

    Raises:
        DocumentError, FlightError: for a file that is none of them, or is damaged, naming the entry.
        CardError: for a model that cannot be made again.
        SwashError: for equations that are given with another file than a fit's.
    """
    ending = Path(path).suffix.lower()
    if equations is not None and ending in (".nc", ".toml"):
        raise SwashError("are for a fit's .json only.", where=Path(path), channel="equations")
    if ending == ".toml":
        return vehicle(Path(path))
    if ending == ".nc":
        return Flight.load(path) if _holds_flight(Path(path)) else FrequencyResponse.load(path)
    return result_file.load(path, equations=equations)


def _holds_flight(path: Path) -> bool:
    try:
        return hdf5.read(path, wanted="swashplate_response") is None
    except (FlightError, ValueError):
        return True  # missing or damaged: the reader of flights says how
