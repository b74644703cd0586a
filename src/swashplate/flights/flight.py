"""`Flight`: what was measured (or simulated), with names, units, frames, and the history of what was done to it."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights import storage
from swashplate.flights.provenance import LATEST, ProcessingStep, Provenance
from swashplate.flights.schema import channel
from swashplate.meant import taking_names
from swashplate.public import resolve
from swashplate.registry import listed
from swashplate.shown import Shown

if TYPE_CHECKING:  # a quarter of a second to import, and designs and trims have no flight
    import pandas as pd
    import xarray as xr

    from swashplate.flights.stored_column import StoredColumn


def stream(
    time: ArrayLike, channels: Mapping[str, ArrayLike | StoredColumn], units: Mapping[str, str] | None = None
) -> xr.Dataset:
    """A set of channels that share one time base.

    Args:
        time: strictly increasing times [s], shape (n,).
        channels: arrays of shape (n,) by channel name.
        units: units of channels that the schema does not know; a unit that contradicts the schema is an error.
    """
    from swashplate.flights.stored_column import StoredColumn

    stamps = np.asarray(time, dtype=np.float64)
    if np.any(np.abs(stamps) > LATEST):
        raise FlightError(f"reaches {np.max(np.abs(stamps)):g} s: no clock does.", channel="time")
    if stamps.ndim != 1 or (stamps.size > 1 and not np.all(np.diff(stamps) > 0)):
        raise FlightError("time must be one strictly increasing row of numbers.", channel="time")
    variables = {}
    for name, values in channels.items():
        if name == "time":
            raise FlightError("is the name of the times of the samples.", channel=name, hint="Rename this channel.")
        known = channel(name)
        unit = (units or {}).get(name, known.unit)
        if known.unit and unit != known.unit:
            raise UnitError(f"unit is '{unit}', expected '{known.unit}'.", channel=name, hint="Convert it first.")
        data = values if isinstance(values, StoredColumn) else np.asarray(values)
        if data.shape != stamps.shape:
            raise FlightError(f"has {data.shape} values for {stamps.shape} time stamps.", channel=name)
        labels = {"units": unit, "frame": known.frame, "long_name": known.description}
        variables[name] = data.timed(labels) if isinstance(data, StoredColumn) else storage.timed(data, labels)
    return storage.over_time(storage.timed(stamps, {"units": "s"}), variables)


def did_you_mean(name: str, channels: Iterable[str]) -> str | None:
    """A question after the channels that a name which is none may stand for; None where no channel is like it."""
    among, small = tuple(channels), name.lower()
    like = [c for c in among if len(small) > 1 and (small in c.lower() or c.lower() in small.split("_"))]
    near = difflib.get_close_matches(small, among, n=2)
    candidates = dict.fromkeys((*like, *near))
    return f"Did you mean {' or '.join(repr(c) for c in list(candidates)[:3])}?" if candidates else None


@dataclass(frozen=True)
class Flight(Shown):
    """A flight: streams of channels, each stream at its native times.

    Attributes:
        streams: datasets by stream name; every dataset has the one dimension and coordinate `time` [s].
        provenance: where it comes from.
        history: what was done to it since it was read, in order.
        segments: intervals (start, stop) [s] of unbroken data, set by conditioning; empty means one unbroken piece.
    """

    streams: Mapping[str, xr.Dataset]
    provenance: Provenance = field(default_factory=Provenance)
    history: tuple[ProcessingStep, ...] = ()
    segments: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        names: set[str] = set()
        for name, data in self.streams.items():
            doubled = names & set(map(str, data.data_vars))
            if doubled:
                raise FlightError(f"stream '{name}' repeats channels of another stream: {sorted(doubled)}.")
            names |= set(map(str, data.data_vars))

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
        asked = did_you_mean(name, self.channels)
        raise FlightError(
            f"the flight has no such channel.{f' {asked}' if asked else ''}",
            where=self.provenance.source or None,
            channel=name,
            hint=f"It has {listed(self.channels)}.",
        )

    def time(self, name: str) -> Array:
        """Time stamps [s] of a channel, shape (n,)."""
        return np.asarray(self[name]["time"].values, dtype=np.float64)

    def values(self, name: str) -> Array:
        """Values of a channel in its inside unit, shape (n,)."""
        return np.asarray(self[name].values, dtype=np.float64)

    @taking_names
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
    def epoch(self) -> float:
        """Time zero on the log's own clock [s] (`Provenance.epoch`): `epoch + time` puts two logs on one clock."""
        return self.provenance.epoch

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
        return replace(self, history=(*self.history, ProcessingStep(operation, details)))

    def with_streams(self, streams: Mapping[str, xr.Dataset]) -> Flight:
        """A copy with other streams; provenance, history and segments stay."""
        return replace(self, streams=dict(streams))

    def with_channel(self, name: str, values: ArrayLike, *, like: str) -> Flight:
        """A copy with a channel added (or replaced) in the stream of channel `like`, unit from the schema."""
        home = self.stream_of(like)
        data = self.streams[home]
        known = channel(name)
        labels = {"units": known.unit, "frame": known.frame, "long_name": known.description}
        added = data.assign({name: storage.timed(np.asarray(values), labels)})
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

    # ---- other shapes -------------------------------------------------------------------------------------------
    @staticmethod
    def from_arrays(
        time: ArrayLike,
        channels: Mapping[str, ArrayLike],
        *,
        units: Mapping[str, str] | None = None,
        source: str = "",
    ) -> Flight:
        """A flight of arrays that share one time base.

        Args:
            time: strictly increasing times [s], shape (n,); Unix time too.
            channels: arrays of shape (n,) by channel name.
            units: of channels that are not in the schema's unit (deg, deg/s, g, ...): they are converted.
            source: what the flight is called.

        Raises:
            FlightError, UnitError: naming the channel.
        """
        flight: Flight = resolve("flight_from_arrays")(time, channels, units=units, source=source)
        return flight

    @staticmethod
    def from_dataframe(frame: pd.DataFrame, *, units: Mapping[str, str] | None = None, source: str = "") -> Flight:
        """A flight of a data frame: its index is the time [s], its columns are channels (see `from_arrays`)."""
        flight: Flight = resolve("flight_from_dataframe")(frame, units=units, source=source)
        return flight

    def to_dataframe(self, *, stream: str | None = None) -> pd.DataFrame:
        """The channels of one stream as a data frame over time [s], SI and radians; units in `frame.attrs["units"]`.

        Raises:
            FlightError: where there are several streams and none is named.
        """
        frame: pd.DataFrame = resolve("flight_to_dataframe")(self, stream=stream)
        return frame

    # ---- files -------------------------------------------------------------------------------------------------
    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the flight as a netCDF file without loss (`storage.save`); returns its path."""
        parts = storage.Parts(self.streams, self.provenance, self.history, self.segments)
        return storage.save(parts, path)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Flight:
        """The flight in a netCDF file that `save` wrote: equal in streams, attributes, history and segments.

        Raises:
            FlightError: where the file is missing, was not written by swashplate, is damaged, or is of a newer schema.
        """
        return Flight(*storage.load(path))

    @property
    def gravity(self) -> float | None:
        """Gravity [m/s^2] that it was simulated or conditioned with; None where the log does not say."""
        return next((float(step.details["gravity"]) for step in self.history if "gravity" in step.details), None)

    def condition(
        self,
        *,
        rate: float = 100.0,
        cutoff: float = 0.0,
        max_gap: float = 0.06,
        outliers: bool = True,
        trim_ground: bool = True,
        derive: bool = True,
        method: str = "linear",
        check: bool = True,
    ) -> Flight:
        """One uniform stream of clean channels, ready for identification.

        Args:
            rate: [Hz].
            cutoff: corner of a zero-phase low-pass on all channels, inputs too [Hz]; 0 for none.
            max_gap: longest gap that is bridged [s]; longer ones split the flight into segments.
            outliers: remove outliers.
            trim_ground: keep the flying part only.
            derive: add angles, body velocities, rates and specific force where position and attitude are there.
            method: between samples: "linear", "pchip" or "spline".
            check: refuse a log whose channels contradict each other in unit, sign or axis.

        Raises:
            FlightError: see `flights.conditioning.condition.condition`, which does it.
        """
        conditioned: Flight = resolve("condition")(
            self,
            rate=rate,
            cutoff=cutoff,
            max_gap=max_gap,
            outliers=outliers,
            trim_ground=trim_ground,
            derive=derive,
            method=method,
            check=check,
        )
        return conditioned

    def inspect(self) -> Any:
        """What is in it and what is wrong with it: see `swashplate.inspect`."""
        return resolve("inspect")(self)

    def respond(self, **asked: Any) -> Any:
        """Frequency responses of its outputs to its inputs: the arguments of `swashplate.respond`."""
        return resolve("respond")(self, **asked)

    def __repr__(self) -> str:
        name = self.provenance.source or "(unnamed)"
        lines = [f"Flight {name}: {self.duration:.1f} s, {len(self.channels)} channels"]
        for name, data in self.streams.items():
            n = data.sizes["time"]
            rate = f"{1.0 / np.median(np.diff(data['time'].values)):.1f} Hz" if n > 1 else "-"
            lines.append(f"  {name} ({n} samples, {rate}): {', '.join(map(str, data.data_vars))}")
        lines += [f"  {i + 1}. {step.operation} {dict(step.details)}" for i, step in enumerate(self.history)]
        return "\n".join(lines)


def as_flights(flights: Flight | Iterable[Flight]) -> tuple[Flight, ...]:
    """One flight or several as a tuple."""
    return (flights,) if isinstance(flights, Flight) else tuple(flights)
