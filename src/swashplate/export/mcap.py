"""Flights and other time series as MCAP, which Foxglove, Lichtblick, PlotJuggler and Rerun open.

One topic a stream, one JSON message a sample: `{"time": {"sec", "nsec"}, "p": 0.1, ...}` in the flight's own units. The
topic's JSON schema says each channel's unit, frame and meaning; metadata records keep provenance, parameters and
events.
Source: the MCAP specification and its well-known schema encoding "jsonschema".
"""

from __future__ import annotations

import heapq
import io
import json
import math
from collections.abc import Iterator
from itertools import count, repeat
from typing import Any

import numpy as np
import xarray as xr

from swashplate.errors import ExportError
from swashplate.extras import library
from swashplate.flights.flight import Flight

_SECOND = 1_000_000_000
_LATEST = (1 << 63) - 1  # ns


def as_mcap(flight: Flight) -> bytes:
    """A flight as the bytes of an MCAP file.

    Times are `flight.epoch + time`, in whole nanoseconds; where the clock's zero is not known they count from 0, and
    clocks that begin before 0 are moved to it (the metadata record `swashplate` says by how much).

    Raises:
        ExportError: where the flight holds no sample, its times do not fit into nanoseconds, or mcap is not installed.
    """
    writers = _library(flight.provenance.source)
    if not any(data.sizes["time"] for data in flight.streams.values()):
        raise ExportError("the flight holds no sample.", where=flight.provenance.source or None)
    shift = flight.epoch + max(0.0, -(flight.epoch + flight.start))
    if not (flight.stop + shift) * _SECOND < _LATEST:
        raise ExportError(
            f"its times reach {flight.stop + shift:g} s, which nanoseconds of 64 bits do not hold.",
            where=flight.provenance.source or None,
            channel="time",
        )
    file = io.BytesIO()
    writer = writers.Writer(file)
    writer.start(profile="", library="swashplate")
    channels = {}
    for name, data in flight.streams.items():
        text = json.dumps(schema(name, data)).encode()
        identity = writer.register_schema(name=f"swashplate.{name}", encoding="jsonschema", data=text)
        units = {str(c): str(v.attrs.get("units", "")) for c, v in data.data_vars.items()}
        channels[name] = writer.register_channel(
            topic=f"/{name}", message_encoding="json", schema_id=identity, metadata=units
        )
    for stamp, name, message, number in _messages(flight, shift):
        writer.add_message(
            channel_id=channels[name], log_time=stamp, publish_time=stamp, sequence=number, data=message.encode()
        )
    for name, entries in _metadata(flight, shift).items():
        writer.add_metadata(name, entries)
    writer.finish()
    return file.getvalue()


def schema(name: str, data: xr.Dataset) -> dict[str, Any]:
    """The JSON schema of a stream's messages; units, frames and meanings stand in the properties' descriptions."""
    properties: dict[str, Any] = {
        "time": {
            "type": "object",
            "title": "time",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
        }
    }
    for channel, values in data.data_vars.items():
        unit = str(values.attrs.get("units", ""))
        told = (f"[{unit or '?'}]", values.attrs.get("frame", ""), values.attrs.get("long_name", ""))
        properties[str(channel)] = {
            "type": ["number", "null"],
            "description": " ".join(filter(None, map(str, told))),
            "unit": unit,
        }
    return {"title": f"swashplate.{name}", "type": "object", "properties": properties}


def _library(where: str) -> Any:
    return library("mcap.writer", what="the format mcap", where=where or None)


def _messages(flight: Flight, shift: float) -> Iterator[tuple[int, str, str, int]]:
    """Time [ns], stream, text and number of every message, in order of time."""
    stamps = {
        name: np.rint((np.asarray(data["time"].values, dtype=np.float64) + shift) * _SECOND).astype(np.int64)
        for name, data in flight.streams.items()
    }
    rows = {name: _rows(data, stamps[name]) for name, data in flight.streams.items()}
    streams = (zip(times.tolist(), repeat(name), count(), strict=False) for name, times in stamps.items())
    for stamp, name, number in heapq.merge(*streams):
        yield stamp, name, next(rows[name]), number


def _rows(data: xr.Dataset, stamps: np.ndarray[Any, np.dtype[np.int64]]) -> Iterator[str]:
    names = [str(name) for name in data.data_vars]
    columns = [np.asarray(data[name].values, dtype=np.float64).tolist() for name in names]
    for stamp, *numbers in zip(stamps.tolist(), *columns, strict=True):
        # JSON has no NaN: a number that is none is null
        row = {name: value if math.isfinite(value) else None for name, value in zip(names, numbers, strict=True)}
        yield json.dumps({"time": {"sec": stamp // _SECOND, "nsec": stamp % _SECOND}, **row}, separators=(",", ":"))


def _metadata(flight: Flight, shift: float) -> dict[str, dict[str, str]]:
    told = flight.provenance
    about = {
        "source": told.source, "sha256": told.sha256, "reader": told.reader, "vehicle": told.vehicle,
        "simulated": str(told.simulated).lower(), "epoch": repr(told.epoch), "added_to_times": repr(shift),
        "notes": json.dumps(told.notes), "damage": json.dumps(told.damage),
    }  # fmt: skip
    steps = (f"{step.operation} {json.dumps(step.details, default=str)}" for step in flight.history)
    history = {f"{i}": step for i, step in enumerate(steps)}
    events = {f"{i}": f"{event.time!r} {event.kind}: {event.text}" for i, event in enumerate(told.events)}
    parameters = {name: repr(value) for name, value in told.parameters.items()}
    named = {"swashplate": about, "history": history, "events": events, "parameters": parameters}
    return {name: entries for name, entries in named.items() if entries}
