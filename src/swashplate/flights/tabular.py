"""Flights from arrays and data frames, and back."""

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
    given, inside, own = dict(units or {}), {}, {}
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
            own[name] = given.get(name, "")
    return rebased(Flight({"arrays": stream(time, inside, own)}, Provenance(source=source, reader="arrays")))


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
