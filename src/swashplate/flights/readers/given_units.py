"""Units that a user gives for a log that names its own: what its numbers really are, where the log is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from swashplate.errors import UnitError
from swashplate.flights import units
from swashplate.flights.flight import Flight
from swashplate.flights.schema import LOGGED_UNIT, channel
from swashplate.registry import listed, nearest


def with_units(flight: Flight, given: Mapping[str, str], *, where: str) -> Flight:
    """The flight with the numbers of some channels taken in other units than the log says, noted in its provenance.

    Args:
        given: unit by channel, as `{"p": "-rad/s"}` for a gyro that counts the other way, or `{"q": "deg/s"}` for one
            whose numbers are degrees. It stands in place of the unit that the channel was logged in.

    Raises:
        UnitError: no such channel, or a unit of another quantity.
    """
    streams, notes = dict(flight.streams), []
    for name, unit in given.items():
        if name not in flight:
            raise UnitError(
                f"a unit is given for a channel that the log lacks; it has {listed(flight.channels)}.",
                where=where,
                channel=name,
                hint=nearest(name, flight.channels) or "Correct the name that the unit is given for.",
            )
        inside = str(flight[name].attrs.get("units", ""))
        before = str(flight[name].attrs.get(LOGGED_UNIT, "")) or inside
        factor = units.to_inside(1.0, unit, expected=inside, channel=name, where=where) / units.to_inside(1.0, before)
        for stream, data in streams.items():
            if name in data:
                changed = (data[name] * float(factor)).assign_attrs({**data[name].attrs, LOGGED_UNIT: unit})
                streams[stream] = data.assign({name: changed})
        notes.append(f"{name}: taken in {unit}, which was given, and not in {before}, as the log has it")
    told = replace(flight.provenance, notes=(*flight.provenance.notes, *notes))
    return replace(flight.with_streams(streams), provenance=told)


def unit_to_give(flight: Flight, name: str, *, sign: str, looks_like: str = "") -> str:
    """The option that mends a channel: it replaces the unit that the file was read with, sign and all.

    Args:
        flight, name: the flight, and its channel.
        sign: "-" where the sign must be turned, "" where it is right.
        looks_like: the unit that its numbers are in; "" where its own is right.
    """
    inside = channel(name).unit
    own = flight[name].attrs
    logged = str(own.get(LOGGED_UNIT, "")) or inside or str(own.get("units", "")) or "1"
    turned, plain = logged.startswith("-"), logged.removeprefix("-")
    if looks_like and plain != inside:
        return f"It was read as {logged}; check its unit."
    signed = "-" if turned != bool(sign) else ""
    return f"Give --unit {name}={signed}{looks_like or plain}."
