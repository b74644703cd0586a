"""Flights as netCDF files (netCDF 4, readable by any netCDF tool): one group a stream, nothing lost.

The root has attributes: `swashplate_schema` (version of the channel schema), and as JSON texts `streams` (stream names
in order, each with its group), `provenance`, `history`, `segments`; netCDF attributes take no nested values.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import numpy as np

from swashplate import documents
from swashplate.arrays import Array
from swashplate.atomic import write_bytes
from swashplate.errors import FlightError
from swashplate.flights import hdf5
from swashplate.flights.provenance import LATEST, ProcessingStep, Provenance
from swashplate.flights.schema import SCHEMA_VERSION

if TYPE_CHECKING:
    import xarray as xr

Schema = TypeVar("Schema")
_ENGINE: Final = "h5netcdf"
_NAME: Final = "swashplate_name"
"""Attribute of a variable: the channel's name as JSON, where netCDF cannot hold it (`imu/p`)."""


class Parts(NamedTuple):
    """What a file holds of a flight: the arguments of `Flight`, in its order."""

    streams: Mapping[str, xr.Dataset]
    provenance: Provenance
    history: tuple[ProcessingStep, ...]
    segments: tuple[tuple[float, float], ...]


def json_value(value: Any) -> Any:
    """NumPy numbers in a history as JSON numbers."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} is not a JSON type")


def _attributes(flight: Parts) -> dict[str, Any]:
    groups = {name: f"stream_{index}" for index, name in enumerate(flight.streams)}
    texts = {
        "streams": list(groups.items()),
        "provenance": asdict(flight.provenance),
        "history": [{"operation": step.operation, "details": dict(step.details)} for step in flight.history],
        "segments": flight.segments,
    }
    return {"swashplate_schema": SCHEMA_VERSION} | {
        name: json.dumps(value, default=json_value) for name, value in texts.items()
    }


def timed(values: Array, labels: Mapping[Any, Any]) -> xr.Variable:
    """Numbers over time with their labels, by xarray's short way: the long one imports dask where that is installed."""
    import xarray as xr

    return xr.Variable(("time",), values, labels, fastpath=values.dtype.kind in "biuf")


def over_time(
    time: xr.Variable, variables: Mapping[str, xr.Variable], attributes: Mapping[Any, Any] | None = None
) -> xr.Dataset:
    """A stream of channels that `timed` made, and its times, as a data set."""
    import pandas as pd
    import xarray as xr

    clock = xr.IndexVariable("time", pd.Index(time.values, name="time"), time.attrs)
    return xr.Dataset(variables, coords={"time": clock}, attrs=attributes)


def save(flight: Parts, path: str | os.PathLike[str]) -> Path:
    """Writes a flight as a netCDF file, which appears by rename when it is complete; returns its path.

    The file is made in memory: where the disk is full, the HDF5 library ends the whole process instead of saying so.

    Raises:
        WriteError: where the folder is missing or cannot be written to, or the disk is full.
    """
    import xarray as xr

    attributes = _attributes(flight)
    file = io.BytesIO()
    xr.Dataset(attrs=attributes).to_netcdf(file, mode="w", engine=_ENGINE)
    for name, group in json.loads(attributes["streams"]):
        data = _storable(flight.streams[name])
        # No fill value: a flight's numbers are what they are.
        encoding: dict[Any, Any] = {variable: {"_FillValue": None} for variable in (*data.data_vars, "time")}
        data.to_netcdf(file, mode="a", group=group, engine=_ENGINE, encoding=encoding)
    return write_bytes(path, file.getbuffer())


def _storable(data: xr.Dataset) -> xr.Dataset:
    """A stream under names that netCDF can hold; a channel that is called otherwise keeps its name as an attribute."""
    odd = [str(name) for name in data.data_vars if not _can_be_held(str(name))]
    taken, names = {str(name) for name in data.data_vars}, {}
    for name in odd:
        safe = "".join(letter if _can_be_held(f"x{letter}") else "_" for letter in name).strip(".") or "channel"
        while safe in taken:
            safe += "_"
        taken.add(safe)
        names[name] = safe
    if not names:
        return data
    renamed = data.rename(names)
    for name, safe in names.items():
        renamed[safe].attrs = {**renamed[safe].attrs, _NAME: json.dumps(name)}
    return renamed


def _can_be_held(name: str) -> bool:
    """Whether netCDF can call a variable so: slashes part groups, a zero ends the name, the rest is Unicode."""
    return bool(name.strip(".")) and not {"/", "\0"} & set(name) and not any("\ud800" <= c <= "\udfff" for c in name)


def _groups(path: Path) -> dict[str, hdf5.Group]:
    """What is in a file of ours, by the names of its groups."""
    groups = hdf5.read(path, wanted="swashplate_schema")
    if groups is None:
        raise FlightError(
            "is an HDF5 or netCDF file that swashplate did not write.",
            where=path,
            hint="Export its channels as CSV with units in the header.",
        )
    version = int(np.ravel(groups[""].attributes["swashplate_schema"])[0])
    if version > SCHEMA_VERSION:
        raise FlightError(
            f"has schema version {version}; this swashplate knows versions up to {SCHEMA_VERSION}.",
            where=path,
            hint="Update swashplate.",
        )
    return groups


def _stream(name: str, group: hdf5.Group, place: Path) -> xr.Dataset:
    """A group's data set; refuses what `save` cannot have written."""
    if "time" not in group.variables:
        raise FlightError("has no time.", where=place, channel=name, hint="Save it again.")
    time = group.variables["time"].values
    for variable, column in group.variables.items():
        if column.values.shape != time.shape or column.values.ndim != 1 or column.values.dtype.kind not in "fiub":
            raise FlightError(
                f"has the shape {column.values.shape} and the type {column.values.dtype}, expected numbers over time.",
                where=place,
                channel=f"{name}/{variable}",
                hint="Save it again.",
            )
    if time.dtype.kind != "f" or not np.all(np.abs(time) <= LATEST) or not np.all(np.diff(time) > 0):
        raise FlightError(
            "the times do not increase: the file is damaged.",
            where=place,
            channel=f"{name}/time",
            hint="Copy it again.",
        )
    columns = {}
    for variable, column in group.variables.items():
        labels, channel = dict(column.attributes), variable
        if _NAME in labels:
            channel = documents.parse_logged(str(labels.pop(_NAME)), str, where=place, at=variable, error=FlightError)
        if channel in columns:
            raise FlightError("is there twice.", where=place, channel=f"{name}/{channel}", hint="Save it again.")
        columns[channel] = timed(column.values, labels)
    return over_time(columns.pop("time"), columns, group.attributes)


def _attribute(attributes: Mapping[str, str], name: str, schema: type[Schema], place: Path) -> Schema:
    if name not in attributes:
        raise FlightError("is missing.", where=place, channel=name, hint="It is damaged: copy or save it again.")
    return documents.parse_logged(attributes[name], schema, where=place, at=name, error=FlightError)


def load(path: str | os.PathLike[str]) -> Parts:
    """What is in a netCDF file that `save` wrote: equal in streams, attributes, provenance, history and segments.

    Raises:
        FlightError: where the file is missing, was not written by swashplate, is damaged, or is of a newer schema.
    """
    place = Path(path)
    if not place.is_file():
        raise FlightError("there is no such file.", where=place, hint="Check the path.")
    try:
        groups = _groups(place)
        attributes = {name: str(value) for name, value in groups[""].attributes.items()}
        named = _attribute(attributes, "streams", list[tuple[str, str]], place)
        streams = {name: _stream(name, groups[group], place) for name, group in named}
        return Parts(
            streams=streams,
            provenance=_attribute(attributes, "provenance", Provenance, place),
            history=_attribute(attributes, "history", tuple[ProcessingStep, ...], place),
            segments=_attribute(attributes, "segments", tuple[tuple[float, float], ...], place),
        )
    except FlightError:
        raise
    except Exception as error:  # whatever the libraries raise on damaged bytes is the file's fault
        raise FlightError(
            f"does not read as a swashplate netCDF file: {str(error) or type(error).__name__}.",
            where=place,
            hint="It is damaged: copy or save it again.",
        ) from error
