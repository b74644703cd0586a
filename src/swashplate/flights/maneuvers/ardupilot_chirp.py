"""ArduPilot's system-identification chirp: its schedule, its settings, and the parameters that make it fly one.

The frequency dwells at the start frequency for two periods, then rises exponentially until the end of the record; the
amplitude fades in and out with half a cosine. Source: ArduPilot's description of the chirp (AP_Math) and of its
System ID mode; held against the target that real logs carry (tests/real).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ManeuverError

START_DELAY = 1.0
"""From the entry into the mode to the start of the chirp [s]."""

AXES: Mapping[int, tuple[str, str]] = {
    1: ("roll angle input", "deg"), 2: ("pitch angle input", "deg"), 3: ("yaw angle input", "deg"),
    4: ("roll angle recovery", "deg"), 5: ("pitch angle recovery", "deg"), 6: ("yaw angle recovery", "deg"),
    7: ("roll rate", "deg/s"), 8: ("pitch rate", "deg/s"), 9: ("yaw rate", "deg/s"),
    10: ("roll mixer", "1"), 11: ("pitch mixer", "1"), 12: ("yaw mixer", "1"), 13: ("collective mixer", "1"),
    14: ("lateral position", "m"), 15: ("longitudinal position", "m"),
    16: ("lateral velocity", "m/s"), 17: ("longitudinal velocity", "m/s"),
    18: ("lateral velocity input", "m/s"), 19: ("longitudinal velocity input", "m/s"),
}  # fmt: skip
"""SID_AXIS: where the chirp enters, and the unit of its magnitude."""

MOVED: Mapping[int, str] = {
    axis: channel
    for channel, axes in (
        ("mixer_roll", (1, 4, 7, 10, 14, 16, 18)),
        ("mixer_pitch", (2, 5, 8, 11, 15, 17, 19)),
        ("mixer_yaw", (3, 6, 9, 12)),
        ("mixer_collective", (13,)),
    )
    for axis in axes
}
"""The command that a chirp at SID_AXIS is added to (10 to 13), or reaches first through the loops before it."""

MIXER: Mapping[str, int] = {"roll": 10, "pitch": 11, "yaw": 12, "heave": 13}
"""Injection behind the rate controller: the loop answers least there (Tischler and Remple 2012, sec. 5.8)."""

_RANGES: Mapping[str, tuple[float, float]] = {
    "SID_F_START_HZ": (0.01, 100.0),
    "SID_F_STOP_HZ": (0.01, 120.0),
    "SID_T_FADE_IN": (0.0, 20.0),
    "SID_T_REC": (0.0, 255.0),
    "SID_T_FADE_OUT": (0.0, 5.0),
}


@dataclass(frozen=True)
class Chirp:
    """One chirp of the System ID mode.

    Attributes:
        axis: SID_AXIS.
        magnitude: largest deflection, in the axis' unit.
        start_hz, stop_hz: the band [Hz].
        record: length with dwell and fades [s].
        fade_in, fade_out: [s].
        dwell: time at `start_hz` [s]; ArduPilot takes two periods.
    """

    axis: int
    magnitude: float
    start_hz: float
    stop_hz: float
    record: float
    fade_in: float
    fade_out: float
    dwell: float

    @staticmethod
    def planned(axis: int, magnitude: float, band: tuple[float, float], *, record: float, fade: float) -> Chirp:
        """The chirp that ArduPilot will fly with these settings.

        Args:
            axis: SID_AXIS.
            magnitude: in the axis' unit.
            band: [Hz].
            record: length [s].
            fade: at both ends [s]; ArduPilot fades out over 5 s at most.

        Raises:
            ManeuverError: naming the setting that ArduPilot does not take.
        """
        chirp = Chirp(
            axis, magnitude, band[0], band[1], record, fade, min(fade, _RANGES["SID_T_FADE_OUT"][1]), 2 / band[0]
        )
        for name, value in chirp.parameters().items():
            low, high = _RANGES.get(name, (-np.inf, np.inf))
            if not low <= value <= high:
                raise ManeuverError(
                    f"is {value:g}; ArduPilot takes {low:g} to {high:g}.",
                    channel=name,
                    hint="Change the band or the length, or fly several sweeps.",
                )
        if chirp.dwell >= record:
            raise ManeuverError(
                f"ArduPilot dwells two periods at the start frequency: {chirp.dwell:.4g} s of {record:g} s.",
                channel="SID_T_REC",
                hint="Give a longer record or a higher start frequency.",
            )
        return chirp

    def frequency(self, time: Array) -> Array:
        """Instantaneous frequency [Hz] at times [s] from the chirp's start."""
        t = np.asarray(time, dtype=np.float64)
        part = np.clip((t - self.dwell) / (self.record - self.dwell), 0.0, 1.0)
        return np.asarray(self.start_hz * (self.stop_hz / self.start_hz) ** part)

    def signal(self, time: Array) -> Array:
        """The chirp at times [s] from its start, in the axis' unit; zero before and after."""
        t = np.asarray(time, dtype=np.float64)
        low = 2.0 * np.pi * self.start_hz
        rise = np.log(self.stop_hz / self.start_hz)
        rest = self.record - self.dwell
        if rise == 0.0:  # a dwell at one frequency: ArduPilot's phase then jumps back to that of a plain sine
            phase = np.where(t <= self.dwell, low * (t - self.dwell), low * t)
        else:
            later = np.clip(t - self.dwell, 0.0, rest)
            phase = np.where(t <= self.dwell, low * (t - self.dwell), low * rest / rise * np.expm1(rise * later / rest))
        inside = (t > 0.0) & (t <= self.record)
        return np.where(inside, self.magnitude * self._window(t) * np.sin(phase), 0.0)

    def _window(self, t: Array) -> Array:
        rising = np.clip(t / self.fade_in, 0.0, 1.0) if self.fade_in > 0.0 else np.ones_like(t)
        falling = np.clip((self.record - t) / self.fade_out, 0.0, 1.0) if self.fade_out > 0.0 else np.ones_like(t)
        # ArduPilot asks for the fade-in first: where the two overlap it wins.
        return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.where(t <= self.fade_in, rising, falling)))

    def parameters(self) -> dict[str, float]:
        """The SID_ parameters that make ArduPilot fly this chirp, by name."""
        return {
            "SID_AXIS": float(self.axis),
            "SID_MAGNITUDE": self.magnitude,
            "SID_F_START_HZ": self.start_hz,
            "SID_F_STOP_HZ": self.stop_hz,
            "SID_T_FADE_IN": self.fade_in,
            "SID_T_REC": self.record,
            "SID_T_FADE_OUT": self.fade_out,
        }

    def parameter_file(self) -> str:
        """The same as a parameter file that ground stations load: one `NAME,value` a line."""
        lines = (f"{name},{int(value) if name == 'SID_AXIS' else value!r}" for name, value in self.parameters().items())
        return "\n".join(lines) + "\n"

    @property
    def axis_name(self) -> str:
        return AXES.get(self.axis, (f"axis {self.axis}", ""))[0]

    @property
    def unit(self) -> str:
        return AXES.get(self.axis, ("", ""))[1]

    def as_details(self) -> dict[str, Any]:
        """JSON types, for an event."""
        return dict(vars(self))
