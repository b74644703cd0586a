"""Flights from arrays and data frames, and back; and as CSV files, units in the header, numbers exact."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from swashplate.errors import FlightError
from swashplate.flights.epoch import rebased
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.flights.schema import channel
from swashplate.flights.units import to_inside

if TYPE_CHECKING:
    import pandas as pd


import csv
import io
from pathlib import Path

import xarray as xr

from swashplate.atomic import write_text
from swashplate.flights.epoch import iso


def from_arrays(
    time: ArrayLike, channels: Mapping[str, ArrayLike], *, units: Mapping[str, str] | None = None, source: str = ""
) -> Flight:
    """A flight of channels that share one time base.

    Args:
        time: strictly increasing times [s], shape (n,); of Unix time, `Flight.epoch` says what was taken off.
        channels: arrays of shape (n,) by channel name.
        units: of channels that are not in the schema's unit (deg, deg/s, g, %, ...): they are converted.
        source: what the flight is called in messages and reports.

    Raises:
        FlightError: times that do not increase, or arrays of another length.
        UnitError: a unit that is not known, or of another kind than the channel's.
    """
    given, inside, labels = dict(units or {}), {}, {}
    strangers = sorted(set(given) - set(channels))
    if strangers:
        raise FlightError("has a unit but no values.", channel=", ".join(strangers), hint="Check the spelling.")
    for name, values in channels.items():
        known = channel(name).unit
        if name in given:
            inside[name] = to_inside(values, given[name], expected=known, channel=name, where=source or None)
        else:
            inside[name] = np.asarray(values, dtype=np.float64)
        if not known:
            labels[name] = given.get(name, "")
    return rebased(Flight({"arrays": stream(time, inside, labels)}, Provenance(source=source, reader="arrays")))


def from_dataframe(frame: pd.DataFrame, *, units: Mapping[str, str] | None = None, source: str = "") -> Flight:
    """A flight of a data frame whose index is the time [s] and whose columns are channels; see `from_arrays`."""
    columns = {str(name): frame[name].to_numpy() for name in frame.columns}
    return from_arrays(frame.index.to_numpy(dtype=np.float64), columns, units=units, source=source)


def to_dataframe(flight: Flight, *, stream: str | None = None) -> pd.DataFrame:
    """The channels of one stream as a data frame over time [s], in SI units and radians.

    Args:
        flight: whose.
        stream: which; may be left out where there is only one.

    Returns:
        Columns by channel; `frame.attrs["units"]` has the unit of each.

    Raises:
        FlightError: where there are several streams and none is named, or none of that name.
    """
    if stream is None and len(flight.streams) == 1:
        stream = next(iter(flight.streams))
    if stream is None or stream not in flight.streams:
        raise FlightError(
            f"has the streams {', '.join(flight.streams) or '(none)'}; "
            + ("which of them is not said." if stream is None else f"'{stream}' is none of them."),
            where=flight.provenance.source or None,
            hint="Name one as stream=..., or bring all to one rate with flight.condition(rate=...).",
        )
    data = flight.streams[stream]
    frame = data.to_dataframe()
    frame.attrs = {"units": {str(name): str(values.attrs.get("units", "")) for name, values in data.items()}}
    return frame


def _header(data: xr.Dataset, zero: float) -> list[str]:
    cells = [f"time [s since {iso(zero)}]" if zero else "time [s]"]
    for name, values in data.data_vars.items():
        unit = values.attrs.get("units", "")
        cells.append(f"{name} [{unit}]" if unit else str(name))
    return cells


def as_csv(data: xr.Dataset, *, epoch: float = 0.0) -> str:
    """A stream as CSV text.

    Args:
        epoch: time zero [s since 1970], which the header then says; 0 where it is not known.

    Raises:
        FlightError: where a number is not finite (the reader would refuse it).
    """
    columns = [np.asarray(data["time"].values, dtype=np.float64)]
    for name, values in data.data_vars.items():
        columns.append(np.asarray(values.values, dtype=np.float64))
        if not np.isfinite(columns[-1]).all():
            raise FlightError(
                "holds numbers that are not finite.", channel=str(name), hint="Cut or condition it first."
            )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_header(data, epoch))
    writer.writerows(zip(*(map(repr, column.tolist()) for column in columns), strict=True))
    return text.getvalue()


def write_csv(flight: Flight, path: str | Path) -> tuple[Path, ...]:
    """Writes a flight as CSV and returns the files' paths.

    A flight of one stream becomes the file `path`; of several, one file each: `flight.csv` gives `flight_motion.csv`,
    `flight_inputs.csv`. All numbers read back exactly, the epoch too (`time [s since ...]`). Provenance, history and
    segments do not go into a CSV file; netCDF (`Flight.save`) keeps them.

    Raises:
        FlightError: where the flight has no stream or holds numbers that are not finite.
        WriteError: where a file cannot be written.
    """
    target = Path(path)
    if not flight.streams:
        raise FlightError("the flight has no stream to write.", where=target)
    names = list(flight.streams)
    paths = [target] if len(names) == 1 else [target.with_name(f"{target.stem}_{n}{target.suffix}") for n in names]
    # All of them before the first file appears.
    texts = [as_csv(flight.streams[name], epoch=flight.epoch) for name in names]
    return tuple(write_text(place, text) for place, text in zip(paths, texts, strict=True))
