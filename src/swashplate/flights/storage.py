"""Flights as netCDF files (netCDF 4, readable by any netCDF tool): one group a stream, nothing lost.

The root has attributes: `swashplate_schema` (version of the channel schema), and as JSON texts `streams` (stream names
in order, each with its group), `provenance`, `history`, `segments`; netCDF attributes take no nested values.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
import xarray as xr

from swashplate.atomic import replaced_when_complete
from swashplate.errors import FlightError
from swashplate.flights.flight import Event, Flight, Provenance, Step
from swashplate.flights.readers.source import refuse_oversized
from swashplate.flights.schema import SCHEMA_VERSION

_ENGINE: Final = "h5netcdf"


def _plain(value: Any) -> Any:
    """NumPy numbers in a history as JSON numbers."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} is not a JSON type")


def _attributes(flight: Flight) -> dict[str, Any]:
    groups = {name: f"stream_{index}" for index, name in enumerate(flight.streams)}
    texts = {
        "streams": list(groups.items()),
        "provenance": asdict(flight.provenance),
        "history": [{"operation": step.operation, "details": dict(step.details)} for step in flight.history],
        "segments": flight.segments,
    }
    return {"swashplate_schema": SCHEMA_VERSION} | {
        name: json.dumps(value, default=_plain) for name, value in texts.items()
    }


def save(flight: Flight, path: str | Path) -> Path:
    """Writes a flight as a netCDF file, which appears by rename when it is complete; returns its path.

    Raises:
        FlightError: where the folder is missing or cannot be written to.
    """
    target = Path(path)
    attributes = _attributes(flight)
    try:
        with replaced_when_complete(target) as temporary:
            xr.Dataset(attrs=attributes).to_netcdf(temporary, mode="w", engine=_ENGINE)
            for name, group in json.loads(attributes["streams"]):
                data = flight.streams[name]
                # No fill value: a flight's numbers are what they are.
                encoding: dict[Any, Any] = {variable: {"_FillValue": None} for variable in (*data.data_vars, "time")}
                data.to_netcdf(temporary, mode="a", group=group, engine=_ENGINE, encoding=encoding)
    except OSError as error:
        reason = error.strerror or str(error)
        raise FlightError(
            f"cannot be written: {reason}.", where=target, hint="Check that the folder exists and is yours."
        ) from error
    return target


def _text(value: Any) -> str:
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)


def _checked_attributes(path: Path) -> dict[str, str]:
    """The root's attributes, after every size in the file has been held against the file's own.

    HDF5 can claim a gigantic data set for which nothing was ever stored; reading it would fill the memory with zeros.
    """
    claimed = 0

    def add(_: str, item: object) -> None:
        nonlocal claimed
        if isinstance(item, h5py.Dataset):
            claimed += int(np.prod(item.shape or (), dtype=object)) * item.dtype.itemsize

    with h5py.File(path, "r") as file:
        root = dict(file.attrs)
        if "swashplate_schema" not in root:
            raise FlightError(
                "is an HDF5 or netCDF file that swashplate did not write.",
                where=path,
                hint="Export its channels as CSV with units in the header.",
            )
        version = int(np.ravel(root.pop("swashplate_schema"))[0])
        if version > SCHEMA_VERSION:
            raise FlightError(
                f"has schema version {version}; this swashplate knows versions up to {SCHEMA_VERSION}.",
                where=path,
                hint="Update swashplate.",
            )
        file.visititems(add)
    refuse_oversized(claimed, size=path.stat().st_size, where=str(path), what="its data sets together")
    return {name: _text(value) for name, value in root.items() if not name.startswith("_")}


def _load_stream(path: Path, group: str) -> xr.Dataset:
    with xr.open_dataset(path, group=group, engine=_ENGINE, decode_times=False, mask_and_scale=False) as data:
        return data.load()


def _check_stream(name: str, data: xr.Dataset, place: Path) -> None:
    """Refuses a stream that `save` cannot have written."""
    kinds = {variable.dtype.kind for variable in data.variables.values()}
    if set(data.dims) - {"time"} or "time" not in data.coords or kinds - set("fiub"):
        raise FlightError(f"stream '{name}' is not numbers over one time base.", where=place, hint="Save it again.")
    if not np.all(np.diff(data["time"].values) > 0):
        raise FlightError(
            "the times do not increase: the file is damaged.",
            where=place,
            channel=f"{name}/time",
            hint="Copy it again.",
        )


def _provenance(entry: Mapping[str, Any]) -> Provenance:
    known = {name: value for name, value in entry.items() if name in Provenance.__dataclass_fields__}
    texts = {name: tuple(known.get(name, ())) for name in ("notes", "damage")}
    return Provenance(**(known | texts | {"events": tuple(Event(**event) for event in known.get("events", ()))}))


def load(path: str | Path) -> Flight:
    """The flight in a netCDF file that `save` wrote: equal in streams, attributes, provenance, history and segments.

    Raises:
        FlightError: where the file is missing, was not written by swashplate, is damaged, or is of a newer schema.
    """
    place = Path(path)
    if not place.is_file():
        raise FlightError("there is no such file.", where=place, hint="Check the path.")
    try:
        attributes = _checked_attributes(place)
        streams = {name: _load_stream(place, group) for name, group in json.loads(attributes["streams"])}
        for name, data in streams.items():
            _check_stream(name, data, place)
        return Flight(
            streams=streams,
            provenance=_provenance(json.loads(attributes["provenance"])),
            history=tuple(Step(step["operation"], step["details"]) for step in json.loads(attributes["history"])),
            segments=tuple((float(start), float(stop)) for start, stop in json.loads(attributes["segments"])),
        )
    except FlightError:
        raise
    except Exception as error:  # whatever the libraries raise on damaged bytes is the file's fault
        raise FlightError(
            f"does not read as a swashplate netCDF file: {str(error) or type(error).__name__}.",
            where=place,
            hint="It is damaged: copy or save it again.",
        ) from error
