"""Which channels a sweep is identified with, where nobody says: what it moved, and what answers to that."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep

_RATES = {"roll": "p", "pitch": "q", "yaw": "r"}
_HEAVE = ("collective", "thrust", "heave", "throttle")
_INPUTS = ("mixer_{}", "servo_{}", "stick_{}")
_INJECTED = "sid_target"


class Channels(NamedTuple):
    """Input and output of a sweep's response, and what was injected ("" where nothing was)."""

    input: str
    output: str
    reference: str


def channels_of(flight: Flight, sweep: Sweep, *, input: str = "", output: str = "") -> Channels:
    """The channels of a sweep: those named, the others by the axis that the sweep names.

    Raises:
        FlightError: where the log has none that fits.
    """
    terms = sweep.axis.replace("_", " ").lower().split()
    axis = next((name for name in _RATES if name in terms), "collective" if set(terms) & set(_HEAVE) else "")
    driven = input or next(
        (name for pattern in _INPUTS if axis and (name := pattern.format(axis)) in flight),
        sweep.channel if sweep.channel in flight and sweep.channel != _INJECTED else "",
    )
    answers = (_RATES[axis],) if axis in _RATES else ("az", "w", "vz") if axis else ("p", "q", "r")
    answer = output or next((name for name in answers if name in flight), "")
    for name, role in ((driven, "input"), (answer, "output")):
        if not name or name not in flight:
            raise FlightError(
                f"no {role} is known for a sweep of '{sweep.axis}'; the log has {', '.join(flight.channels)}.",
                where=flight.provenance.source or None,
                channel=name or None,
                hint="Choose input and output yourself.",
            )
    injected = _INJECTED if sweep.source == "log" and _INJECTED in flight else ""
    return Channels(driven, answer, injected)
