"""Flights as linear models and frequency responses want them: at one rate, with the names of the model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr

from swashplate.flights.channel_names import MOTION, SET_POINT, STICK, with_names
from swashplate.flights.checked import checked
from swashplate.flights.conditioning.condition import condition
from swashplate.flights.flight import Flight


def uniform_records(
    flights: Flight | Iterable[Flight],
    channels: Sequence[str],
    *,
    rate: float = 100.0,
    cutoff: float = 0.0,
    names: Mapping[str, str] | None = None,
    also: Sequence[str] = (),
) -> tuple[Flight, ...]:
    """Flights at one rate, with the streams that hold the channels (and those in `also` that are there) only.

    Sticks, set-points and motion of other streams stay beside them at their own rates: they tell what moved an input.

    Nothing is cut at take-off and landing and no outlier is removed: sweeps are long, and what looks like an outlier to
    motion capture's rules is often a doublet. Channels that the log lacks are derived where attitude and place allow.
    Between samples goes a spline: lines would take 3 dB off a channel at a third of its rate.

    Args:
        flights: as logged.
        channels: that are needed, by the model's names.
        rate: of the result [Hz].
        cutoff: low-pass on all channels [Hz]; 0 for none.
        names: the log's channel by the model's name, where the log calls it otherwise.
        also: channels that are kept where they are.

    Raises:
        FlightError: a channel that is missing, or flights whose channels contradict each other.
    """
    given, records = names or {}, []
    for raw in (flights,) if isinstance(flights, Flight) else flights:
        logged = {name: source for name, source in given.items() if source in raw}
        used = {given.get(name, name) for name in (*channels, *also)}
        # Whole: the streams that are left out below may be what shows a wrong unit; what is derived uses all of them.
        raw = checked(raw, used if all(given.get(name, name) in raw for name in channels) else None)
        flight = with_names(raw, logged)
        complete, beside = all(name in flight for name in channels), {}
        if complete:
            homes = {flight.stream_of(name) for name in (*channels, *also) if name in flight}
            beside = {name: _telling(data) for name, data in flight.streams.items() if name not in homes}
            flight = flight.with_streams({name: data for name, data in flight.streams.items() if name in homes})
        flight = condition(
            flight,
            rate=rate,
            cutoff=cutoff,
            outliers=False,
            trim_ground=False,
            derive=not complete,
            method="spline",
            check=None,
        )
        flight = with_names(flight, {name: source for name, source in given.items() if name not in logged})
        kept = {name: data.drop_vars(set(flight.channels), errors="ignore") for name, data in beside.items()}
        kept = {name: data for name, data in kept.items() if data.data_vars and data.sizes["time"] > 1}
        records.append(flight.with_streams({**flight.streams, **kept}))
    return tuple(records)


def is_uniform(flight: Flight, channels: Sequence[str]) -> bool:
    """Whether a flight has all channels in one stream with one step in each unbroken piece."""
    if not all(name in flight for name in channels) or len({flight.stream_of(name) for name in channels}) != 1:
        return False
    steps = [np.diff(piece.time(channels[0])) for piece in flight.split()]
    every = np.concatenate(steps)
    return bool(every.size and np.ptp(every) <= 1e-6 * every.mean() + 1e-9 + 2.0 * np.spacing(abs(flight.epoch or 0.0)))


def _telling(data: xr.Dataset) -> xr.Dataset:
    """What of a stream may tell what moved an input."""
    names = (str(name) for name in data.data_vars)
    return data[[n for n in names if n in MOTION or n.startswith(STICK) or n.endswith(SET_POINT)]]
