"""Betaflight's chirps, as its log tells them: the debug fields of its chirp mode, held against the header's law.

With its debug mode CHIRP, `debug[1]` is the axis (0 roll, 1 pitch, 2 yaw, -1 none) and `debug[2]` ten times the
frequency [Hz]. The header has the band, the length and the amplitude. The chirp is added to the rate's set-point; its
frequency rises exponentially, without fades. The number of that debug mode differs between versions, so the fields
themselves are asked whether they follow the law. Sources: Betaflight's pull requests 13105 and 15113.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.provenance import Event
from swashplate.flights.readers.blackbox_encodings import Whole
from swashplate.flights.readers.blackbox_header import Header

_AXES = (("roll", 7, 1.0), ("pitch", 8, -1.0), ("yaw", 9, -1.0))
"""Name, the same place in System ID's count of axes, and the sign from forward-left-up to forward-right-down."""
_OFF = 0.02  # of the frequency, beside a step of the field: what a chirp's own law does not explain
_FOLLOWS = 0.95  # of the samples
_FEWEST = 20  # samples


@dataclass(frozen=True)
class _Law:
    start_hz: float
    stop_hz: float
    seconds: float

    def since(self, hertz: Array) -> Array:
        """Time since the start [s] at which the chirp has a frequency [Hz]."""
        return np.asarray(self.seconds * np.log(hertz / self.start_hz) / np.log(self.stop_hz / self.start_hz))


def chirps(header: Header, columns: Mapping[str, Whole], time: Array) -> list[Event]:
    """The chirps that the log tells of.

    Args:
        columns: of the main frames, by field, shape (n,). time: of each frame [s], shape (n,).
    """
    law = _Law(
        0.1 * header.number("chirp_frequency_start_deci_hz"),
        0.1 * header.number("chirp_frequency_end_deci_hz"),
        header.number("chirp_time_seconds"),
    )
    if not (0.0 < law.start_hz < law.stop_hz and law.seconds > 0.0 and {"debug[1]", "debug[2]"} <= columns.keys()):
        return []
    axis, deci = columns["debug[1]"], columns["debug[2]"]
    on = np.isin(axis, range(len(_AXES))) & (deci > 0)
    edges = np.flatnonzero(np.diff(np.where(on, axis, -1), prepend=-1, append=-1))
    events = []
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if on[first] and last - first >= _FEWEST:
            hertz = np.asarray(0.1 * deci[first:last], dtype=np.float64)
            start = _start(law, time[first:last], hertz)
            if start is not None:
                events.append(_event(header, law, int(axis[first]), start, float(time[last - 1])))
    return events


def _start(law: _Law, time: Array, hertz: Array) -> float | None:
    """When the chirp began [s]; None where the field does not follow the header's law."""
    # A step of the field is 0.1 Hz: half of one is little where the frequency is high.
    sharp = hertz >= np.median(hertz)
    start = float(np.median(time[sharp] - law.since(hertz[sharp])))
    own = law.start_hz * (law.stop_hz / law.start_hz) ** ((time - start) / law.seconds)
    follows = np.abs(hertz - own) <= 0.1 + _OFF * own
    rises = law.since(hertz[-1:])[0] - law.since(hertz[:1])[0] > 0.0
    return start if rises and np.mean(follows) >= _FOLLOWS else None


def _event(header: Header, law: _Law, axis: int, start: float, last: float) -> Event:
    name, place, sign = _AXES[axis]
    magnitude = sign * header.number(f"chirp_amplitude_{name}", 1.0)
    chirp = Chirp(place, magnitude, law.start_hz, law.stop_hz, law.seconds, fade_in=0.0, fade_out=0.0, dwell=0.0)
    words = f"{chirp.axis_name}, {chirp.start_hz:g}-{chirp.stop_hz:g} Hz in {chirp.record:g} s"
    times = {"start": start, "stop": start + law.seconds, "seen": min(start + law.seconds, last)}
    return Event(start, "sweep", words, {**chirp.as_details(), **times, "channel": f"mixer_{name}"})
