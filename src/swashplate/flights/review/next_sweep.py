"""What to fly next: a sweep for this vehicle, in its autopilot's own parameters, within what the log shows."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.errors import ManeuverError
from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import MIXER, Chirp
from swashplate.flights.review.stretches import AXES, Interval, LoopAxis, armed, without

_LOW = 0.5  # Hz: two periods of it fit into the dwell, and a hover can be held by hand beside it
_RECORD, _FADE = 60.0, 5.0  # s
_SMALLEST, _LARGEST = 0.04, 0.25  # of full travel
_ABOVE = 3.0  # times the command's own rms: coherence of 0.9 where the loop adds as much
_ROOM = 0.5  # of what is left to the end of the travel
_HIGHEST, _LOWEST_END, _WIDE = 20.0, 8.0, 3.0  # Hz, Hz, bandwidths
_ENDS = (np.deg2rad(60.0), np.deg2rad(20.0))  # rad/s, rad: a sweep moves more than a hover
_RATE = 100.0  # Hz: the log's, five samples at 20 Hz
_BETAFLIGHT = (2025, 12)
"""First Betaflight with a chirp of its own."""


@dataclass(frozen=True)
class NextSweep:
    """A sweep to fly.

    Attributes:
        axis: of the aircraft. parameters: of the autopilot, by name, in its own units.
        rate, angle: where to end it by hand [rad/s], [rad]: half as much again as this log's largest, and 60 deg/s and
            20 deg at least; NaN if not logged.
        why: how its size was found, in words.
    """

    axis: str
    parameters: Mapping[str, float]
    rate: float
    angle: float
    why: str

    def __str__(self) -> str:
        settings = ", ".join(f"{name} {value:g}" for name, value in self.parameters.items())
        ends = ((np.degrees(self.rate), "deg/s"), (np.degrees(self.angle), "deg"))
        limits = [f"{value:.0f} {unit}" for value, unit in ends if np.isfinite(value)]
        end = f"; switch it off beyond {' or '.join(limits)}" if limits else ""
        return f"{self.axis}: {settings} ({self.why}){end}"


def next_sweeps(
    flight: Flight, bandwidths: Mapping[str, float | None], *, swept: Sequence[Interval]
) -> tuple[tuple[NextSweep, ...], str]:
    """Sweeps by axis, and in words what to set beside them, or why there are none.

    Args:
        bandwidths: of the rate loops by axis [Hz], None where it is not known.
        swept: from and to of sweeps [s]: commands are measured outside of them.
    """
    kind = aircraft_kind(flight)
    reader = flight.provenance.reader
    if reader == "ardupilot" and kind is not None and not (kind.main_rotors or kind.multirotor):
        return (), f"System ID mode is Copter's: {kind.noun} has no sweep of its own"
    if reader == "ardupilot":
        sweeps = tuple(each for axis in AXES if (each := _ardupilot(flight, axis, bandwidths, swept)) is not None)
        return sweeps, _beside(flight) if sweeps else "the log has no commands to the mixer (RATE): no size can be said"
    version = re.search(r"Betaflight (\d+)\.(\d+)", flight.provenance.vehicle)
    if reader in ("blackbox", "blackbox csv") and version is not None:
        if (int(version[1]), int(version[2])) < _BETAFLIGHT:
            return (), "Betaflight has a chirp from 2025.12 on; before, move one stick after the other, slow to fast"
        sweeps = tuple(each for axis in AXES if (each := _betaflight(flight, axis)) is not None)
        return sweeps, "set debug_mode = CHIRP, log gyro and set-point, switch the mode CHIRP on once for each axis"
    return (), (
        "this autopilot has no sweep of its own that is known here: move one stick after the other as a sine, from a "
        "slow one (4 s) to as fast as you can, or let `swash maneuver` make a script or a file"
    )


def _ardupilot(
    flight: Flight, axis: LoopAxis, bandwidths: Mapping[str, float | None], swept: Sequence[Interval]
) -> NextSweep | None:
    if axis.command not in flight:
        return None
    time, values = flight.time(axis.command), flight.values(axis.command)
    swept_part = np.zeros(time.shape, dtype=np.bool_)
    for start, stop in without(armed(flight), swept):
        swept_part |= (time >= start) & (time <= stop)
    values = values[swept_part & np.isfinite(values)]
    if values.size < 100 or not np.ptp(values) > 0.0:
        return None
    spread, most = float(np.std(values)), float(np.quantile(np.abs(values), 0.99))
    room = 1.0 - most
    if room < 2.0 * _SMALLEST:
        return None
    size = float(np.clip(_ABOVE * spread, _SMALLEST, min(_LARGEST, _ROOM * room)))
    wide = bandwidths.get(axis.name)
    high = float(np.clip(_WIDE * wide, _LOWEST_END, _HIGHEST)) if wide else _HIGHEST
    try:
        chirp = Chirp.planned(MIXER[axis.name], round(size, 3), (_LOW, round(high, 1)), record=_RECORD, fade=_FADE)
    except ManeuverError:
        return None
    why = f"{axis.command} moves by {spread:.2g} rms, 99 % of it within {most:.2g} of 1"
    return NextSweep(axis.name, chirp.parameters(), *_limits(flight, axis), why)


def _limits(flight: Flight, axis: LoopAxis) -> tuple[float, float]:
    """Where to end a sweep of an axis: rate and angle."""
    angle = {"roll": "phi", "pitch": "theta"}.get(axis.name, "")
    limits = []
    for name, least in zip((axis.motion, angle), _ENDS, strict=True):
        values = np.abs(flight.values(name)) if name in flight else np.zeros(0)
        values = values[np.isfinite(values)]
        limits.append(max(1.5 * float(np.quantile(values, 0.999)), least) if values.size else float("nan"))
    return limits[0], limits[1]


def _beside(flight: Flight) -> str:
    """What else ArduPilot needs: the mode, and a log that is fast enough."""
    rate = flight.rate("p") if "p" in flight else 0.0
    log = "" if rate >= _RATE else f" Set ATTITUDE_FAST in LOG_BITMASK: the rate loop is logged at {rate:.3g} Hz now."
    return f"One axis a flight, in System ID mode (FLTMODE 25), from a steady hover.{log}"


def _betaflight(flight: Flight, axis: LoopAxis) -> NextSweep | None:
    if axis.motion not in flight:
        return None
    most = float(np.quantile(np.abs(np.degrees(flight.values(axis.motion))), 0.999))
    size = float(np.clip(round(0.5 * most, -1), 60.0, 230.0))
    rate = flight.rate(axis.motion)
    parameters = {
        f"chirp_amplitude_{axis.name}": size,
        "chirp_frequency_start_deci_hz": 2.0,
        "chirp_frequency_end_deci_hz": float(round(10.0 * min(0.4 * rate, 300.0))),
        "chirp_time_seconds": 20.0,
    }
    why = f"this log's largest rate is {most:.0f} deg/s, and it has {rate:.3g} samples a second"
    return NextSweep(axis.name, parameters, *_limits(flight, axis), why)
