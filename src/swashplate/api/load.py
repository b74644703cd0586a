"""The verb `load`: what was saved, read back by what its file is."""

from __future__ import annotations

import os
from pathlib import Path

from swashplate import documents
from swashplate.errors import FlightError, SwashError
from swashplate.flights import hdf5
from swashplate.flights.flight import Flight
from swashplate.identification.core import result_file
from swashplate.identification.core.result import Result
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.validation import saved
from swashplate.validation.along_inputs import ModelComparison
from swashplate.validation.residuals import Residuals
from swashplate.validation.validation import Validation
from swashplate.validation.verification import Verification

_HINT = "`swash identify`, `fit-ss`, `fit-tf`, `fit-time` and `validate` write such files to --out."


def load(
    path: str | os.PathLike[str], *, equations: Vehicle | None = None
) -> (
    Result[object, object]
    | FrequencyResponse
    | Flight
    | Vehicle
    | Validation
    | Verification
    | ModelComparison
    | Residuals
):
    """What a file of ours holds.

    A .json holds a fit, a validation, a verification, a comparison of models or residuals; a .nc holds frequency
    responses or a flight; a .toml holds a model.

    Args:
        path: the file.
        equations: of a .json: the vehicle whose equations it is of, for equations that are no part of the package and
            of no entry point of the group `swashplate.models`.

    Returns:
        The object whole, as it was saved: a fit with its matrices, comparisons with the data and its model; a
        validation with its scores, verdicts and predictions.

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
    document = documents.read_document(os.fspath(path), form="json", hint=_HINT)
    if document.get("kind") in saved.KINDS:
        judged: Validation = saved.from_document(document, where=os.fspath(path), equations=equations)
        return judged
    return result_file.from_document(document, where=os.fspath(path), equations=equations)


def _holds_flight(path: Path) -> bool:
    try:
        return hdf5.read(path, wanted="swashplate_response") is None
    except (FlightError, OSError, ValueError):
        return True  # missing or damaged: the reader of flights says how
