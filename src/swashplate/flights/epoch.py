"""Times near zero, and the epoch beside them: float64 seconds since 1970 step by 0.24 microseconds, too coarse a step.

A flight's stamps are small numbers; `Provenance.epoch` says where their zero lies on the log's own clock. Two logs that
were stamped by one clock lie together at `flight.epoch + flight.time(name)`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from swashplate.flights.flight import Flight

Array = NDArray[np.float64]

LARGE = 1e6
"""First stamp [s] from which a clock is moved: 12 days, where float64 steps by 0.1 ns. No log runs for so long."""

_ISO = re.compile(
    r"(?P<day>\d{4}-\d{2}-\d{2})[T ](?P<time>\d{2}:\d{2}(?::\d{2})?)(?P<fraction>[.,]\d+)?"
    r"\s*(?P<zone>Z|[+-]\d{2}:?\d{2})?"
)

_US = re.compile(  # month first, as AM and PM show
    r"(?P<month>\d{1,2})/(?P<day>\d{1,2})/(?P<year>\d{4})[ T]+(?P<hour>\d{1,2}):(?P<minute>\d{2})"
    r"(?::(?P<second>\d{2})(?P<fraction>[.,]\d+)?)?\s*(?P<half>[AP]M)",
    re.IGNORECASE,
)
_DOTTED = re.compile(
    r"(?P<day>\d{1,2})\.(?P<month>\d{1,2})\.(?P<year>\d{4})[ T]+(?P<hour>\d{1,2}):(?P<minute>\d{2})"
    r"(?::(?P<second>\d{2})(?P<fraction>[.,]\d+)?)?"
)
_CLOCK = re.compile(r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2})(?P<fraction>[.,]\d+)?")


def zero_of(first: float | Decimal) -> int:
    """The whole second [s] that becomes time zero where the first stamp is large, else 0."""
    return math.floor(first) if abs(float(first)) >= LARGE else 0


def rebased(flight: Flight) -> Flight:
    """The flight with small stamps: every stream and event earlier by the same whole seconds, which `epoch` keeps."""
    starts = [float(data["time"].values[0]) for data in flight.streams.values() if data.sizes["time"]]
    shift = zero_of(min(starts)) if starts and math.isfinite(min(starts)) else 0
    if shift:
        streams = {
            name: data.assign_coords(time=("time", data["time"].values - shift, data["time"].attrs))
            for name, data in flight.streams.items()
        }
        origin = flight.provenance
        events = tuple(replace(event, time=event.time - shift) for event in origin.events)
        flight = replace(
            flight,
            streams=streams,
            provenance=replace(origin, events=events, epoch=origin.epoch + shift),
            segments=tuple((start - shift, stop - shift) for start, stop in flight.segments),
        )
    return flight


def note(epoch: float) -> str:
    """Where time zero lies, in words."""
    seconds = f"{epoch:.9f}".rstrip("0").rstrip(".")
    return f"time zero is {seconds} s of the log's clock ({iso(epoch)} if it counts from 1970)"


def iso(epoch: float) -> str:
    """Seconds since 1970 as ISO 8601 in UTC, with every digit of the number."""
    exact = Decimal(repr(float(epoch)))
    seconds = math.floor(exact)
    fraction = f"{exact - seconds:f}".partition(".")[2].rstrip("0")
    try:
        day = datetime.fromtimestamp(seconds, UTC)
    except (ValueError, OverflowError, OSError):
        return "no date"
    return f"{day:%Y-%m-%dT%H:%M:%S}{'.' if fraction else ''}{fraction}Z"


def from_iso(text: str) -> Decimal | None:
    """Seconds since 1970 of a date and time in ISO 8601 (UTC where it names no zone); None where it is none."""
    match = _ISO.fullmatch(text.strip())
    if match is None:
        return None
    try:
        day = datetime.fromisoformat(f"{match['day']}T{match['time']}{(match['zone'] or 'Z')}")
    except ValueError:
        return None
    return int(day.timestamp()) + _fraction(match)


def _fraction(match: re.Match[str]) -> Decimal:
    return Decimal("0." + match["fraction"][1:] if match["fraction"] else 0)


def from_text(text: str) -> Decimal | None:
    """Seconds since 1970 of a date and time as tables write them; None where it is none.

    ISO 8601, `03/05/2026 02:20:00.5 PM` (the United States: month first) and `05.03.2026 14:20:00,5`. Dates with
    slashes and without AM or PM are not read: nobody can tell day from month.
    """
    if (iso := from_iso(text)) is not None:
        return iso
    match = _US.fullmatch(text.strip()) or _DOTTED.fullmatch(text.strip())
    if match is None:
        return None
    hour = int(match["hour"])
    if half := match.groupdict().get("half"):
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + 12 * (half.upper() == "PM")
    year, month, day, minute, second = (int(match[p] or 0) for p in ("year", "month", "day", "minute", "second"))
    try:
        when = datetime(year, month, day, hour, minute, second, tzinfo=UTC)
    except ValueError:
        return None
    return int(when.timestamp()) + _fraction(match)


def of_day(text: str) -> Decimal | None:
    """Seconds since midnight of a time of day such as `14:23:00.1`; None where it is none."""
    match = _CLOCK.fullmatch(text.strip())
    if match is None or int(match["hour"]) > 23 or int(match["minute"]) > 59 or int(match["second"]) > 60:
        return None
    return 3600 * int(match["hour"]) + 60 * int(match["minute"]) + int(match["second"]) + _fraction(match)


_DATE = re.compile(r"\d{4}-\d{2}-\d{2}|\d{1,2}[./]\d{1,2}[./]\d{4}")


def is_time(text: str) -> bool:
    """Whether a cell of a table is a date, a time of day or both."""
    if not text[:1].isdigit():
        return False
    return _DATE.fullmatch(text) is not None or of_day(text) is not None or from_text(text) is not None


def small(stamps: Sequence[Decimal]) -> tuple[Array, int]:
    """Exact stamps [s] as float64 times, shape (n,), and the second that became their zero."""
    zero = zero_of(stamps[0]) if stamps else 0
    return np.array([float(stamp - zero) for stamp in stamps], dtype=np.float64), zero
