"""Flights as linear models and frequency responses want them: at one rate, with the names of the model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr

from swashplate.flights.conditioning.condition import condition
from swashplate.flights.consistency import refuse_inconsistent
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION, RATES, VELOCITY

STICK, SET_POINT = ("stick_", "rcin_"), "_demand"
"""How names of pilots' sticks begin, and names of set-points end."""

MOTION = (*RATES, *ATTITUDE, *VELOCITY, "vx", "vy", "vz", *POSITION)


def with_names(flight: Flight, wanted: Mapping[str, str]) -> Flight:
    """The flight with channels under new names; a channel that had such a name makes way.

    Args:
        wanted: the log's channel by its new name.

    Raises:
        FlightError: a channel that the flight does not have.
    """
    changed = {source: name for name, source in wanted.items() if name != source}
    if not changed:
        return flight
    for source in changed:
        flight.stream_of(source)
    streams = {
        home: data.drop_vars([n for n in changed.values() if n in data.data_vars]).rename(
            {source: name for source, name in changed.items() if source in data.data_vars}
        )
        for home, data in flight.streams.items()
    }
    return flight.with_streams({home: data for home, data in streams.items() if data.data_vars}).done(
        "rename", **changed
    )


def renamed_channels(flights: Iterable[Flight], names: Iterable[str]) -> dict[str, str]:
    """The log's channel by the name that `with_names` gave it, of these names as far as they were given."""
    told = {
        str(name): source
        for flight in flights
        for step in flight.history
        if step.operation == "rename"
        for source, name in step.details.items()
    }
    return {name: told[name] for name in names if name in told}


def slowest_of(flights: Sequence[Flight], names: Sequence[str]) -> tuple[str, float]:
    """The channel that was logged most slowly, by its flight's history, and its rate [Hz] (infinite for none)."""
    rates = {
        name: float(rate)
        for flight in flights
        for step in flight.history
        if step.operation == "resample"
        for name, rate in step.details.get("slower", {}).items()
        if name in names
    }
    slow = min(rates, key=lambda name: rates[name], default="")
    return slow, rates.get(slow, np.inf)


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
    given, made = names or {}, []
    for raw in (flights,) if isinstance(flights, Flight) else flights:
        refuse_inconsistent(raw)  # whole: the streams that are left out below may be what shows a wrong unit
        logged = {name: source for name, source in given.items() if source in raw}
        flight = with_names(raw, logged)
        whole, beside = all(name in flight for name in channels), {}
        if whole:
            homes = {flight.stream_of(name) for name in (*channels, *also) if name in flight}
            beside = {name: _telling(data) for name, data in flight.streams.items() if name not in homes}
            flight = flight.with_streams({name: data for name, data in flight.streams.items() if name in homes})
        flight = condition(
            flight, rate=rate, cutoff=cutoff, outliers=False, trim_ground=False, derive=not whole, method="spline"
        )
        flight = with_names(flight, {name: source for name, source in given.items() if name not in logged})
        kept = {name: data.drop_vars(set(flight.channels), errors="ignore") for name, data in beside.items()}
        kept = {name: data for name, data in kept.items() if data.data_vars and data.sizes["time"] > 1}
        made.append(flight.with_streams({**flight.streams, **kept}))
    return tuple(made)


def _telling(data: xr.Dataset) -> xr.Dataset:
    """What of a stream may tell what moved an input."""
    names = (str(name) for name in data.data_vars)
    return data[[n for n in names if n in MOTION or n.startswith(STICK) or n.endswith(SET_POINT)]]
