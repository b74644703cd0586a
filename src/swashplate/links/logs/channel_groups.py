"""Channels in the groups that an engineer looks for them in, with what the page must know of each."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.flights.readers.log_fields import LogFields
from swashplate.flights.schema import ATTITUDE, POSITION, QUATERNION, RATES, VELOCITY, channel, is_known

_GROUPS = (
    ("Rates", RATES),
    ("Attitude", (*ATTITUDE, *QUATERNION)),
    ("Commands", ("mixer", "servo", "motor", "stick", "sid")),
    ("Velocity", (*VELOCITY, "vx", "vy", "vz", "airspeed", "wind")),
    ("Position", (*POSITION, "altitude")),
    ("Specific force", ("ax", "ay", "az")),
    ("Rotors", ("omega", "alpha", "beta", "eta", "zeta")),
    ("Battery", ("voltage", "current")),
    ("GPS and vibration", ("gps", "vibe", "clips")),
    ("Radio", ("rcin", "rcout")),
)
OTHER = "Other"


def group_of(name: str) -> str:
    """The group of a channel, by what stands before its first underline."""
    if not is_known(name) and not name.startswith(("mixer_", "stick_")):
        return OTHER
    begin = name.partition("_")[0]
    return next((title for title, begins in _GROUPS if begin in begins), OTHER)


def shown_unit(flight: Flight, name: str) -> tuple[str, float]:
    """The unit on the screen, and what an inside value is multiplied by to be in it."""
    known = channel(name)
    return known.shown_unit or str(flight[name].attrs.get("units", "")), known.shown_factor


def _rate(stamps: Array) -> float:
    return 1.0 / float(np.median(np.diff(stamps))) if stamps.size > 1 else 0.0


def groups(flight: Flight) -> list[dict[str, Any]]:
    """Groups with their channels, as the page lists them; a group without a channel is left out."""
    by_title: dict[str, list[dict[str, Any]]] = {title: [] for title in (*(title for title, _ in _GROUPS), OTHER)}
    rates = {home: round(_rate(data["time"].values), 1) for home, data in flight.streams.items()}
    for name in flight.channels:
        unit, _ = shown_unit(flight, name)
        about, samples = channel(name).description, int(flight.time(name).size)
        rate = rates[flight.stream_of(name)]
        entry = {"name": name, "unit": unit, "rate": rate, "samples": samples, "about": about}
        by_title[group_of(name)].append(entry)
    return [{"title": title, "channels": channels} for title, channels in by_title.items() if channels]


def field_groups(fields: LogFields | None) -> list[dict[str, Any]]:
    """The log's own fields, a group for each message."""
    by_message: dict[str, list[dict[str, Any]]] = {}
    for name, field in (fields.listed if fields else {}).items():
        about = f"{field.message} message, field {field.field}, as the log has it"
        entry = {"name": name, "unit": field.unit, "rate": field.rate, "samples": field.samples, "about": about}
        by_message.setdefault(field.message, []).append(entry)
    return [{"title": title, "channels": channels, "raw": True} for title, channels in sorted(by_message.items())]
