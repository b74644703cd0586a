"""Names of rate-loop gains and filters, ArduPilot's and Rotorflight's, and what they are in a loop of rad/s.

Rotorflight gives the mixer command u = F target + P e + I int e - D d(rate)/dt of whole numbers, with rates in deg/s.
Its scales are those of its pid.h since headers hold five gains an axis; the filter of the gyro (`gyro_cutoff`) and the
bandwidth of the derivative (`d_cutoff`) are of first order and see the gyro alone, not the target (pid.c, modes 2, 3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array

ARDUPILOT = {"RLL": ("p", "mixer_roll"), "PIT": ("q", "mixer_pitch"), "YAW": ("r", "mixer_yaw")}
"""Rate and mixer command by the axis' name."""
ROTORFLIGHT = {"roll": ("p", "mixer_roll"), "pitch": ("q", "mixer_pitch"), "yaw": ("r", "mixer_yaw")}
_COPTERS, _UNSAID = ("arducopter", "apm:copter", "apm copter"), "ardupilot"
"""What a firmware that has ATC_RAT_* calls itself, and what a log of ArduPilot is said to be that names none."""
_SCALES = {
    "roll": {"P": 6.66666e-6, "I": 2e-4, "D": 1e-7, "FF": 2.5e-5},
    "pitch": {"P": 6.66666e-6, "I": 2e-4, "D": 1e-6, "FF": 2.5e-5},
    "yaw": {"P": 6.666666e-5, "I": 5e-4, "D": 1e-6, "FF": 2.5e-5},
}
"""Command per deg/s, of a gain of one."""
_ENDS = {
    "FF": "f_gain", "P": "p_gain", "I": "i_gain", "D": "d_gain", "FLTG": "gyro_cutoff", "FLTD": "d_cutoff",
}  # fmt: skip
_ARDUPILOT_ENDS = ("FF", "P", "I", "D", "FLTT", "FLTE", "FLTD")
_LARGEST = 1000.0
_FILTER = 20.0  # Hz: FLTE where the log does not say it, and FLTD of a suggestion
_GYRO, _SLOPE = (50.0, 50.0, 100.0), (15.0, 15.0, 20.0)  # Hz: Rotorflight's own, where the log does not say them


def axes_of(known: Mapping[str, float]) -> Mapping[str, tuple[str, str]]:
    """Axes with their rate and command, by the names of the firmware whose gains a log holds; else ArduPilot's."""
    return ROTORFLIGHT if any(f"{axis}_p_gain" in known for axis in ROTORFLIGHT) else ARDUPILOT


def untuned(firmware: str, known: Mapping[str, float]) -> str:
    """Why no gains can be suggested by name for a log, in words; "" where they can.

    Args:
        firmware: of its autopilot, "" where no autopilot wrote it.
        known: the gains and filters that the log holds, by name.
    """
    ours, whose = axes_of(known), firmware.lower()
    if ours is ROTORFLIGHT or not firmware or any(word in whose for word in _COPTERS):
        return ""
    if "rotorflight" in whose:
        return f"{firmware}: its header does not hold five gains an axis, and the scales of others are not known."
    if whose == _UNSAID and any(f"ATC_RAT_{axis}_P" in known for axis in ARDUPILOT):
        return ""
    who = "an ArduPilot vehicle that the log does not name" if whose == _UNSAID else firmware
    return f"{who} flew this log, none that this program tunes: gains have the names of ArduCopter or of Rotorflight."


def names_of(axis: str) -> dict[str, str]:
    """The firmware's name by the short one, `P`, `I`, `D`, `FF` and filters."""
    if axis in ROTORFLIGHT:
        return {name: f"{axis}_{end}" for name, end in _ENDS.items()}
    return {name: f"ATC_RAT_{axis}_{name}" for name in _ARDUPILOT_ENDS}


def filters_of(axis: str, known: Mapping[str, float]) -> dict[str, float]:
    """Corners [Hz] that a suggestion keeps, by their short names."""
    if axis in ROTORFLIGHT:
        index = tuple(ROTORFLIGHT).index(axis)
        return {
            "FLTG": known.get(f"{axis}_gyro_cutoff", _GYRO[index]),
            "FLTD": known.get(f"{axis}_d_cutoff", _SLOPE[index]),
        }
    return {"FLTE": known.get(f"ATC_RAT_{axis}_FLTE", _FILTER), "FLTD": _FILTER}


def short(gains: Mapping[str, float]) -> dict[str, float]:
    """Gains as a loop of rad/s has them, by short names, from either firmware's."""
    known_names = {name: (axis, key) for axis in ROTORFLIGHT for key, name in names_of(axis).items()}
    by_short = {}
    for name, value in gains.items():
        if name in known_names:
            axis, key = known_names[name]
            by_short[key] = float(value) * _unit(axis, key)
        else:
            by_short[name.rsplit("_", 1)[-1]] = float(value)
    return by_short


def written(axis: str, gains: Mapping[str, float]) -> dict[str, float]:
    """Gains of a loop of rad/s by the firmware's names and in its units."""
    return {
        name: _rounded(gains[key] / _unit(axis, key)) if axis in ROTORFLIGHT else gains[key]
        for key, name in names_of(axis).items()
        if key in gains
    }


def representable(axis: str, grid: Mapping[str, Array]) -> dict[str, Array]:
    """Of m sets of gains, shape (m,) each, the ones that the firmware can hold, rounded as it holds them."""
    if axis not in ROTORFLIGHT:
        return dict(grid)
    counts = {key: np.round(values / _unit(axis, key)) for key, values in grid.items()}
    held = np.all([(counts[key] >= 0.0) & (counts[key] <= _LARGEST) for key in ("FF", "P", "I", "D")], axis=0)
    held &= counts["P"] >= 1.0
    rows = np.stack([counts[key][held] for key in grid], axis=1)
    each = np.unique(rows, axis=0)
    return {key: each[:, k] * _unit(axis, key) for k, key in enumerate(grid)}


def gain_text(name: str, value: float) -> str:
    """A gain as a table shows it: a whole number where the firmware holds whole ones."""
    return f"{value:.0f}" if name.endswith(("_gain", "_cutoff")) else f"{value:.4f}"


def beware(axis: str, known: Mapping[str, float]) -> str:
    """What of the firmware's law is not in the loop that was judged, in words; empty for ArduPilot's."""
    if axis not in ROTORFLIGHT:
        return ""
    stops: Sequence[float] = [known[name] for name in ("yaw_stop_gain_0", "yaw_stop_gain_1") if name in known]
    text = " Boost, relax and decay of the error are not in the loop that was judged."
    if axis == "yaw" and stops and max(stops) > 100.0:
        lost = 20.0 * math.log10(max(stops) / 100.0)
        text += f" The stop gain of {max(stops):g} % multiplies P: take {lost:.1f} dB from the gain margin."
    return text


def _unit(axis: str, key: str) -> float:
    return math.degrees(_SCALES[axis][key]) if key in _SCALES[axis] else 1.0


def _rounded(value: float) -> float:
    return float(round(value))
