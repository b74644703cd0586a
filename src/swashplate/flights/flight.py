"""`Flight`: what was measured (or simulated), with names, units, frames, and the history of what was done to it."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from swashplate.errors import FlightError, UnitError
from swashplate.flights.schema import channel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Event:
    """Something that a log says happened.

    Attributes:
        time: [s], on the flight's clock.
        kind: "message", "mode", "parameter", "sweep", "armed", "disarmed", "dropout".
        text: in words.
        details: its numbers (JSON types only).
    """

    time: float
    kind: str
    text: str
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Provenance:
    """Where a flight comes from.

    Attributes:
        source: file name, or the simulated vehicle's name.
        sha256: hash of the file's bytes ("" for a simulation).
        reader: the reader's or simulator's name.
        reader_version: its version.
        simulated: True where no aircraft flew.
        vehicle: the vehicle as the log or the user names it.
        notes: what a reader found wrong and what the user must know.
        damage: what is broken in the file itself (cut off, lost bytes, clock resets); the rest of it was read.
        parameters: an autopilot's settings as the log begins; changes in flight are events.
        events: what the log says happened, in order of time.
    """

    source: str = ""
    sha256: str = ""
    reader: str = ""
    reader_version: str = ""
    simulated: bool = False
    vehicle: str = ""
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    events: tuple[Event, ...] = ()

    def parameter(self, name: str, *, at: float = math.inf) -> float | None:
        """An autopilot's setting at a time [s], at the end of the log if none is given; None where it is not logged."""
        value = self.parameters.get(name)
        for event in self.events:
            if event.kind == "parameter" and event.time <= at and event.details.get("name") == name:
                value = float(event.details["value"])
        return value


@dataclass(frozen=True)
class Step:
    """One thing done to a flight: the operation and its numbers (JSON types only)."""

    operation: str
    details: Mapping[str, Any] = field(default_factory=dict)


def stream(time: ArrayLike, channels: Mapping[str, ArrayLike], units: Mapping[str, str] | None = None) -> xr.Dataset:
    """A set of channels that share one time base.

    Args:
        time: strictly increasing times [s], shape (n,).
        channels: arrays of shape (n,) by channel name.
        units: units of channels that the schema does not know; a unit that contradicts the schema is an error.
    """
    stamps = np.asarray(time, dtype=np.float64)
    if stamps.ndim != 1 or (stamps.size > 1 and not np.all(np.diff(stamps) > 0)):
        raise FlightError("time must be one strictly increasing row of numbers.", channel="time")
    variables = {}
    for name, values in channels.items():
        known = channel(name)
        unit = (units or {}).get(name, known.unit)
        if known.unit and unit != known.unit:
            raise UnitError(f"unit is '{unit}', expected '{known.unit}'.", channel=name, hint="Convert it first.")
        data = np.asarray(values)
        if data.shape != stamps.shape:
            raise FlightError(f"has {data.shape} values for {stamps.shape} time stamps.", channel=name)
        variables[name] = xr.DataArray(
            data, dims=("time",), attrs={"units": unit, "frame": known.frame, "long_name": known.description}
        )
    return xr.Dataset(variables, coords={"time": ("time", stamps, {"units": "s"})})


def did_you_mean(name: str, channels: Iterable[str]) -> str | None:
    """A question after the channels that a name which is none may stand for; None where no channel is like it."""
    among, small = tuple(channels), name.lower()
    like = [c for c in among if len(small) > 1 and (small in c.lower() or c.lower() in small.split("_"))]
    near = difflib.get_close_matches(small, among, n=2)
    found = dict.fromkeys((*like, *near))
    return f"Did you mean {' or '.join(repr(c) for c in list(found)[:3])}?" if found else None


@dataclass(frozen=True)
class Flight:
    """A flight: streams of channels, each stream at its native times.

    Attributes:
        streams: datasets by stream name; every dataset has the one dimension and coordinate `time` [s].
        provenance: where it comes from.
        history: what was done to it since it was read, in order.
        segments: intervals (start, stop) [s] of unbroken data, set by conditioning; empty means one unbroken piece.
    """

    streams: Mapping[str, xr.Dataset]
    provenance: Provenance = field(default_factory=Provenance)
    history: tuple[Step, ...] = ()
    segments: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for name, data in self.streams.items():
            doubled = seen & set(map(str, data.data_vars))
            if doubled:
                raise FlightError(f"stream '{name}' repeats channels of another stream: {sorted(doubled)}.")
            seen |= set(map(str, data.data_vars))

    # ---- looking -----------------------------------------------------------------------------------------------
    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(str(name) for data in self.streams.values() for name in data.data_vars)

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __getitem__(self, name: str) -> xr.DataArray:
        return self.streams[self.stream_of(name)][name]

    def stream_of(self, name: str) -> str:
        """The name of the stream that holds a channel."""
        for stream_name, data in self.streams.items():
            if name in data.data_vars:
                return stream_name
        raise FlightError(
            f"the flight has no such channel; it has {', '.join(self.channels) or 'none'}.",
            where=self.provenance.source or None,
            channel=name,
            hint=did_you_mean(name, self.channels),
        )

    def time(self, name: str) -> Array:
        """Time stamps [s] of a channel, shape (n,)."""
        return np.asarray(self[name]["time"].values, dtype=np.float64)

    def values(self, name: str) -> Array:
        """Values of a channel in its inside unit, shape (n,)."""
        return np.asarray(self[name].values, dtype=np.float64)

    def array(self, names: Iterable[str]) -> Array:
        """Channels of one stream side by side, shape (n, len(names)).

        Raises:
            FlightError: where the channels do not share a time base (condition the flight to one rate first).
        """
        wanted = tuple(names)
        homes = {self.stream_of(name) for name in wanted}
        if len(homes) > 1:
            raise FlightError(
                f"channels {', '.join(wanted)} lie in streams of different rates ({', '.join(sorted(homes))}).",
                where=self.provenance.source or None,
                hint="Bring them to one rate with flight.condition(rate=...).",
            )
        return np.stack([self.values(name) for name in wanted], axis=-1)

    @property
    def start(self) -> float:
        return min(float(data["time"].values[0]) for data in self.streams.values() if data.sizes["time"])

    @property
    def stop(self) -> float:
        return max(float(data["time"].values[-1]) for data in self.streams.values() if data.sizes["time"])

    @property
    def duration(self) -> float:
        return self.stop - self.start

    def rate(self, name: str) -> float:
        """Sample rate of a channel [Hz] from the median time step."""
        stamps = self.time(name)
        if stamps.size < 2:
            raise FlightError("a single sample has no rate.", where=self.provenance.source or None, channel=name)
        return 1.0 / float(np.median(np.diff(stamps)))

    # ---- making a changed copy ---------------------------------------------------------------------------------
    def done(self, operation: str, **details: Any) -> Flight:
        """A copy whose history says that `operation` was done, with its numbers."""
        return replace(self, history=(*self.history, Step(operation, details)))

    def with_streams(self, streams: Mapping[str, xr.Dataset]) -> Flight:
        """A copy with other streams; provenance, history and segments stay."""
        return replace(self, streams=dict(streams))

    def with_channel(self, name: str, values: ArrayLike, *, like: str) -> Flight:
        """A copy with a channel added (or replaced) in the stream of channel `like`, unit from the schema."""
        home = self.stream_of(like)
        data = self.streams[home]
        known = channel(name)
        labels = {"units": known.unit, "frame": known.frame, "long_name": known.description}
        added = data.assign({name: ("time", np.asarray(values), labels)})
        return self.with_streams({**self.streams, home: added})

    def between(self, start: float, stop: float) -> Flight:
        """The part from `start` to `stop` [s], both included; segments are cut accordingly."""
        cut = {name: data.sel(time=slice(start, stop)) for name, data in self.streams.items()}
        pieces = tuple((max(a, start), min(b, stop)) for a, b in self.segments if b > start and a < stop)
        return replace(self, streams=cut, segments=pieces).done("between", start=start, stop=stop)

    def split(self) -> tuple[Flight, ...]:
        """One flight per segment (the flight itself where it is unbroken)."""
        if len(self.segments) < 2:
            return (self,)
        return tuple(self.between(start, stop) for start, stop in self.segments)

    # ---- files -------------------------------------------------------------------------------------------------
    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the flight as a netCDF file without loss (`storage.save`); returns its path."""
        from swashplate.flights import storage  # the file formats import this module

        return storage.save(self, Path(path))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Flight:
        """The flight in a netCDF file that `save` wrote (`storage.load`)."""
        from swashplate.flights import storage

        return storage.load(Path(path))

    def condition(self, **options: Any) -> Flight:
        """One uniform stream of clean channels, ready for identification: see `swashplate.flights.condition`.

        Args:
            options: rate [Hz], cutoff [Hz], max_gap [s], outliers, trim_ground, derive, method.
        """
        from swashplate.flights.condition import condition  # it needs this class, and SciPy's filters take time to load

        return condition(self, **options)

    def __repr__(self) -> str:
        name = self.provenance.source or "(unnamed)"
        lines = [f"Flight {name}: {self.duration:.1f} s, {len(self.channels)} channels"]
        for name, data in self.streams.items():
            n = data.sizes["time"]
            rate = f"{1.0 / np.median(np.diff(data['time'].values)):.1f} Hz" if n > 1 else "-"
            lines.append(f"  {name} ({n} samples, {rate}): {', '.join(map(str, data.data_vars))}")
        lines += [f"  {i + 1}. {step.operation} {dict(step.details)}" for i, step in enumerate(self.history)]
        return "\n".join(lines)
