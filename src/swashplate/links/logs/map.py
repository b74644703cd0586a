"""Where a flight was, from above: the estimate's track, else that of the GPS."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.links.logs import code_lines
from swashplate.links.logs.bins import extremes
from swashplate.links.logs.opened import Opened

MOST = 3000
"""Places of a map."""
_RADIUS = 6_371_000.0
_LATITUDE, _LONGITUDE = re.compile(r"lat(itude)?(_deg)?", re.IGNORECASE), ("lng", "lon", "longitude", "longitude_deg")
_WHOLE = 1e7
"""A field of whole numbers holds so many to the degree."""


def map_of(opened: Opened) -> dict[str, Any]:
    """Times [s], metres to the north and to the east of the first place, and what they are from.

    Raises:
        FlightError: where the log has no place.
    """
    flight = opened.ready
    if "x" in flight and "y" in flight and flight.stream_of("x") == flight.stream_of("y"):
        names = ("x", "y")
        time, north, east = flight.time("x"), flight.values("x"), flight.values("y")
        remark = "The track as the log's x and y have it."
    else:
        names = _fields(opened)
        if names is None:
            raise FlightError(
                "has no place: neither x and y, nor a latitude and a longitude.",
                where=opened.read.file,
                hint="There is nothing to draw on a map; the plots show what there is.",
            )
        latitude, longitude = opened.shown(names[0]), opened.shown(names[1])
        time, north, east = _metres(latitude.time, latitude.values, longitude.values)
        remark = f"The track of {names[0]} and {names[1]}."
    good = np.isfinite(north) & np.isfinite(east)
    if good.sum() < 2:
        raise FlightError("has fewer than two places.", where=opened.read.file)
    time, north, east = time[good], north[good], east[good]
    if time.size > MOST:
        kept = np.unique(np.concatenate([extremes(north, MOST // 4), extremes(east, MOST // 4)]))
        time, north, east = time[kept], north[kept], east[kept]
    drawn = [name for name in names if name in flight]
    return {
        "time": time,
        "north": np.round(north, 3),
        "east": np.round(east, 3),
        "words": remark,
        "code": code_lines.tracked(opened.read, drawn, replayable=False).to_document() if drawn else None,
    }


def _fields(opened: Opened) -> tuple[str, str] | None:
    """Latitude and longitude of one receiver: of the GPS where it is called so, with samples."""
    flight = opened.ready
    if "latitude" in flight and "longitude" in flight:
        return "latitude", "longitude"
    listed = opened.fields.listed if opened.fields else {}
    pairs = []
    for name, field in listed.items():
        if _LATITUDE.fullmatch(field.field) and field.samples > 1:
            other = next(
                (f"{field.message}.{end}" for end in _pairs(field.field) if f"{field.message}.{end}" in listed), ""
            )
            if other:
                pairs.append(("gps" not in field.message.lower(), name, other))
    return min(pairs)[1:] if pairs else None


def _pairs(latitude: str) -> list[str]:
    return [end for word in _LONGITUDE for end in (word, word.capitalize())] + [latitude.replace("lat", "lon")]


def _metres(time: Array, latitude: Array, longitude: Array) -> tuple[Array, Array, Array]:
    """Places on the plane that touches the Earth at the first of them; places that no receiver has are left out."""
    size = min(time.size, latitude.size, longitude.size)
    time, latitude, longitude = time[:size], latitude[:size], longitude[:size]
    if size and np.nanmax(np.abs(latitude)) > 360.0:
        latitude, longitude = latitude / _WHOLE, longitude / _WHOLE
    good = np.isfinite(latitude) & np.isfinite(longitude) & ((latitude != 0.0) | (longitude != 0.0))
    time, latitude, longitude = time[good], np.radians(latitude[good]), np.radians(longitude[good])
    if not time.size:
        return time, latitude, longitude
    north = _RADIUS * (latitude - latitude[0])
    return time, north, _RADIUS * (longitude - longitude[0]) * np.cos(latitude[0])
