"""Frequency responses as netCDF files (netCDF 4, readable by any netCDF tool), and back without loss.

The file knows arrays and words by the names of `FrequencyResponse`'s fields, not the class.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from swashplate import documents
from swashplate.atomic import write_bytes
from swashplate.errors import FlightError
from swashplate.flights import hdf5
from swashplate.identification.responses.shared_errors import SharedErrors

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
_SHARED = {"noise": ("frequency", "output", "output_2"), "inverse": ("frequency", "input", "input_2")}


class _Words(msgspec.Struct):
    """What a file says beside its numbers."""

    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    method: str
    windows: tuple[float, ...]
    sources: tuple[str, ...]
    warnings: tuple[str, ...]
    problems: tuple[str, ...]
    settings: dict[str, Any]


def save(fields: Mapping[str, Any], path: Path) -> Path:
    """Writes the fields of a `FrequencyResponse` as a file, which appears by rename when it is complete.

    Raises:
        WriteError: where the folder is missing or cannot be written to, or the disk is full.
    """
    import xarray as xr

    variables: dict[str, Any] = {
        "response_real": (_PAIR, fields["response"].real, {"long_name": "real part of the response"}),
        "response_imag": (_PAIR, fields["response"].imag, {"long_name": "imaginary part of the response"}),
    }
    variables |= {name: (dims, fields[name]) for name, dims in _ARRAYS.items()}
    if fields["direct"] is not None:
        direct = {"direct_real": fields["direct"].real, "direct_imag": fields["direct"].imag}
        variables |= {name: (_PAIR, values) for name, values in direct.items()}
        variables["direct_error"] = (_PAIR, fields["direct_error"])
    if fields["shared"] is not None:
        shared = fields["shared"]
        variables["window"] = (("frequency",), shared.window, {"units": "s"})
        for name, dims in _SHARED.items():
            values = getattr(shared, name)
            variables |= {f"shared_{name}_real": (dims, values.real), f"shared_{name}_imag": (dims, values.imag)}
    coordinates = {
        "frequency": ("frequency", fields["omega"], {"units": "rad/s"}),
        "output": list(fields["outputs"]),
        "input": list(fields["inputs"]),
    }
    texts = {name: fields[name] for name in _Words.__struct_fields__}
    attributes = {"swashplate_response": SCHEMA, "words": json.dumps(texts, default=str)}
    data = xr.Dataset(variables, coords=coordinates, attrs=attributes)
    encoding: dict[Any, Any] = {name: {"_FillValue": None} for name in (*variables, "frequency")}
    file = io.BytesIO()  # not on the disk: where that is full, the HDF5 library ends the whole process
    data.to_netcdf(file, engine="h5netcdf", encoding=encoding)
    return write_bytes(path, file.getbuffer())


def load(path: Path) -> dict[str, Any]:
    """The fields of the `FrequencyResponse` in a file that `save` wrote.

    Raises:
        FlightError: where the file is missing, damaged, of a newer schema or something else.
    """
    if not path.is_file():
        raise FlightError("there is no such file.", where=path, hint="Make it with 'swash respond'.")
    try:
        groups = hdf5.read(path, wanted="swashplate_response")
        if groups is None:
            raise ValueError("it says nothing of responses")
        attributes, data = groups[""].attributes, groups[""].variables
        schema = int(np.ravel(attributes["swashplate_response"])[0])
        texts = documents.parse_logged(attributes["words"], _Words, where=path, at="words", error=FlightError)
        arrays: dict[str, Any] = {name: np.asarray(data[name].values, dtype=np.float64) for name in _ARRAYS}
        response = data["response_real"].values + 1j * data["response_imag"].values
        beside: dict[str, Any] = {}
        if "direct_real" in data:
            beside["direct"] = data["direct_real"].values + 1j * data["direct_imag"].values
            beside["direct_error"] = np.asarray(data["direct_error"].values, dtype=np.float64)
        together: dict[str, Any] = {}
        if "window" in data:
            together = {n: data[f"shared_{n}_real"].values + 1j * data[f"shared_{n}_imag"].values for n in _SHARED}
            together["window"] = np.asarray(data["window"].values, dtype=np.float64)
        inputs, outputs = (tuple(map(str, data[name].values)) for name in ("input", "output"))
        omega = np.asarray(data["frequency"].values, dtype=np.float64)
    except FlightError:
        raise
    except Exception as error:  # whatever the libraries raise on foreign or damaged bytes is the file's fault
        raise FlightError(
            "does not hold frequency responses of swashplate.",
            where=path,
            hint="Make it with 'swash respond LOG --inputs ... --outputs ... --out DIR'.",
        ) from error
    if schema > SCHEMA:
        raise FlightError(f"has schema {schema}; this swashplate knows up to {SCHEMA}.", where=path, hint="Update it.")
    sizes = {"frequency": omega.size, "output": len(outputs), "input": len(inputs)}
    shapes = _ARRAYS | _SHARED | {"window": ("frequency",)}
    for name, values in {"response_real": response, **arrays, **beside, **together}.items():
        expected = tuple(sizes[dimension.removesuffix("_2")] for dimension in shapes.get(name, _PAIR))
        if values.shape != expected:
            raise FlightError(f"has shape {values.shape}, expected {expected}.", where=path, channel=name)
    if not np.all(np.isfinite(omega)) or not np.all(np.diff(omega, prepend=0.0) > 0.0):
        raise FlightError("does not rise from above zero.", where=path, channel="frequency")
    if together:
        beside["shared"] = SharedErrors(**together)
    channels = {"omega": omega, "inputs": inputs, "outputs": outputs}
    return {**channels, "response": response, **arrays, **beside, **msgspec.structs.asdict(texts)}
