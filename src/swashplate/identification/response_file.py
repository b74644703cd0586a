"""Frequency responses as netCDF files (netCDF 4, readable by any netCDF tool), and back without loss."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from swashplate.atomic import replaced_when_complete
from swashplate.errors import FlightError
from swashplate.identification.frequency_response import FrequencyResponse

SCHEMA = 1
_PAIR = ("frequency", "output", "input")
_ARRAYS = {
    "coherence": _PAIR,
    "error": _PAIR,
    "multiple": ("frequency", "output"),
    "input_power": ("frequency", "input"),
    "output_power": ("frequency", "output"),
    "input_coherence": ("frequency", "input", "input_2"),
}
_WORDS = ("input_units", "output_units", "method", "windows", "sources", "warnings", "problems", "settings")


def save(response: FrequencyResponse, path: Path) -> Path:
    """Writes the file, which appears by rename when it is complete.

    Raises:
        FlightError: where the folder is missing or cannot be written to.
    """
    variables: dict[str, Any] = {
        "response_real": (_PAIR, response.response.real, {"long_name": "real part of the response"}),
        "response_imag": (_PAIR, response.response.imag, {"long_name": "imaginary part of the response"}),
    }
    variables |= {name: (dims, getattr(response, name)) for name, dims in _ARRAYS.items()}
    coordinates = {
        "frequency": ("frequency", response.omega, {"units": "rad/s"}),
        "output": list(response.outputs),
        "input": list(response.inputs),
    }
    words = {name: getattr(response, name) for name in _WORDS}
    attributes = {"swashplate_response": SCHEMA, "words": json.dumps(words, default=str)}
    data = xr.Dataset(variables, coords=coordinates, attrs=attributes)
    try:
        with replaced_when_complete(path) as temporary:
            encoding: dict[Any, Any] = {name: {"_FillValue": None} for name in (*variables, "frequency")}
            data.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)
    except OSError as error:
        raise FlightError(
            f"cannot be written: {error.strerror or error}.", where=path, hint="Check that the folder exists."
        ) from error
    return path


def load(path: Path) -> FrequencyResponse:
    """The responses in a file that `save` wrote.

    Raises:
        FlightError: where the file is missing, damaged, of a newer schema or something else.
    """
    if not path.is_file():
        raise FlightError("there is no such file.", where=path, hint="Make it with 'swash respond'.")
    try:
        with xr.open_dataset(path, engine="h5netcdf", mask_and_scale=False) as found:
            data = found.load()
        schema = int(np.ravel(data.attrs["swashplate_response"])[0])
        words = json.loads(data.attrs["words"])
        arrays: dict[str, Any] = {name: np.asarray(data[name].values, dtype=np.float64) for name in _ARRAYS}
        response = data["response_real"].values + 1j * data["response_imag"].values
        inputs, outputs = (tuple(map(str, data[name].values)) for name in ("input", "output"))
        omega = np.asarray(data["frequency"].values, dtype=np.float64)
    except Exception as error:  # whatever the libraries raise on foreign or damaged bytes is the file's fault
        raise FlightError(
            "does not hold frequency responses of swashplate.",
            where=path,
            hint="Make it with 'swash respond LOG --inputs ... --outputs ... --out DIR'.",
        ) from error
    if schema > SCHEMA:
        raise FlightError(f"has schema {schema}; this swashplate knows up to {SCHEMA}.", where=path, hint="Update it.")
    for name in ("input_units", "output_units", "windows", "sources", "warnings", "problems"):
        words[name] = tuple(words[name])
    return FrequencyResponse(omega=omega, inputs=inputs, outputs=outputs, response=response, **arrays, **words)
