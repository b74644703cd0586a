"""Where a flight was and how it stood, as moments that the page draws in three dimensions."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import euler_from_quaternion, quaternion_from_euler, to_body
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION, QUATERNION
from swashplate.links.logs import code_lines
from swashplate.links.logs.opened import Opened
from swashplate.links.logs.shapes import shape_of

MOST = 4000
"""Moments of a page."""
_RATE = 50.0


def track(opened: Opened) -> dict[str, Any]:
    """Times [s], places (north, east, down) [m] and Euler angles [rad] of a log, shape (n, 3) each.

    Raises:
        FlightError: where the log has neither a place nor an attitude.
    """
    flight = opened.ready
    placed = [name for name in POSITION if name in flight]
    angled = _attitude(flight)
    if len(placed) < len(POSITION) and angled is None:
        raise FlightError(
            f"has no place ({', '.join(POSITION)}) and no attitude ({', '.join(ATTITUDE)} or {', '.join(QUATERNION)}).",
            where=opened.read.file,
            hint="There is nothing to draw in three dimensions; the plots show what there is.",
        )
    clock = flight.time(POSITION[0]) if len(placed) == len(POSITION) else angled[0] if angled is not None else None
    assert clock is not None
    if angled is not None:
        start, stop = max(clock[0], angled[0][0]), min(clock[-1], angled[0][-1])
    else:
        start, stop = clock[0], clock[-1]
    time = np.linspace(start, stop, int(min(MOST, max(2, (stop - start) * _RATE))))
    if len(placed) == len(POSITION):
        places = np.stack([np.interp(time, *_finite(flight, name)) for name in POSITION], axis=-1)
    else:
        places = np.zeros((time.size, 3))
    angles = np.zeros((time.size, 3))
    if angled is not None:
        angles = np.stack([np.interp(time, angled[0], np.unwrap(column)) for column in angled[1].T], axis=-1)
    # Velocity along the body axes, of the track itself: what the instruments show is what is drawn.
    drift = np.gradient(places, time, axis=0)
    speeds = to_body(quaternion_from_euler(angles), drift)
    notes = []
    if len(placed) < len(POSITION):
        notes.append("The log has no place: the attitude is drawn at one point.")
    if angled is None:
        notes.append("The log has no attitude: the track is drawn level, with the nose to the north.")
    replayable = not notes
    drawn = [name for name in (*POSITION, *ATTITUDE, *QUATERNION) if name in flight]
    shape, remark = shape_of(flight)
    notes += [remark] * bool(remark)
    depth = shape["skids"]["depth"] if shape["skids"] else 0.25 * shape["size"]
    return {
        "time": time,
        "places": np.round(places, 4),
        "speeds": np.round(speeds, 3),
        "angles": np.round(angles, 5),
        "placed": len(placed) == len(POSITION),
        "picture": {**shape, "floor": float(places[:, 2].max()) + float(depth)},
        "rotors": len(shape["rotors"]),
        "tail": shape["tail"] is not None,
        "notes": notes,
        "code": code_lines.tracked(opened.read, drawn, replayable=replayable).to_document(),
    }


def _finite(flight: Flight, name: str) -> tuple[Array, Array]:
    time, values = flight.time(name), flight.values(name)
    good = np.isfinite(values)
    return time[good], values[good]


def _attitude(flight: Flight) -> tuple[Array, Array] | None:
    """Stamps and Euler angles [rad], shape (n, 3); None where the log has no attitude of at least roll and pitch."""
    if all(name in flight for name in QUATERNION) and len({flight.stream_of(n) for n in QUATERNION}) == 1:
        table = flight.array(QUATERNION)
        good = np.isfinite(table).all(axis=1) & (np.linalg.norm(table, axis=1) > 0.5)
        return (flight.time(QUATERNION[0])[good], euler_from_quaternion(table[good])) if good.sum() > 1 else None
    if not all(name in flight for name in ATTITUDE[:2]):
        return None
    time = flight.time(ATTITUDE[0])
    columns = [np.interp(time, *_finite(flight, name)) if name in flight else np.zeros(time.size) for name in ATTITUDE]
    table = np.stack(columns, axis=-1)
    return (time, table) if time.size > 1 and np.isfinite(table).all() else None
