"""Names of channels: which are sticks, set-points and motion, and which a flight was given beside the log's own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

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
    renamed = {
        str(name): source
        for flight in flights
        for step in flight.history
        if step.operation == "rename"
        for source, name in step.details.items()
    }
    return {name: renamed[name] for name in names if name in renamed}


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
