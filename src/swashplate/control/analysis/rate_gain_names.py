"""Names of rate-loop gains and filters, ArduPilot's, Rotorflight's and Betaflight's, and what they are in rad/s.

Rotorflight gives the mixer command u = F target + P e + I int e - D d(rate)/dt of whole numbers, with rates in deg/s.
Its scales are those of its pid.h since headers hold five gains an axis; the filter of the gyro (`gyro_cutoff`) and the
bandwidth of the derivative (`d_cutoff`) are of first order and see the gyro alone, not the target (pid.c, modes 2, 3).

Betaflight's law is the same without F, which is of the stick's speed and in no loop; a whole command is 1000 (pid.h).
Its gyro is logged behind its filters. Both low-passes of D are one of their joint lag here (`DTERM`), no setting.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array

ARDUPILOT = {"RLL": ("p", "mixer_roll"), "PIT": ("q", "mixer_pitch"), "YAW": ("r", "mixer_yaw")}
"""Rate and mixer command by the axis' name."""
ROTORFLIGHT = {"roll": ("p", "mixer_roll"), "pitch": ("q", "mixer_pitch"), "yaw": ("r", "mixer_yaw")}
BETAFLIGHT = {"Roll": ("p", "mixer_roll"), "Pitch": ("q", "mixer_pitch"), "Yaw": ("r", "mixer_yaw")}
DTERM = "dterm_lpf"
_COPTERS, _UNSAID = ("arducopter", "apm:copter", "apm copter"), "ardupilot"
"""What a firmware that has ATC_RAT_* calls itself, and what a log of ArduPilot is said to be that names none."""
_SCALES = {
    "roll": {"P": 6.66666e-6, "I": 2e-4, "D": 1e-7, "FF": 2.5e-5},
    "pitch": {"P": 6.66666e-6, "I": 2e-4, "D": 1e-6, "FF": 2.5e-5},
    "yaw": {"P": 6.666666e-5, "I": 5e-4, "D": 1e-6, "FF": 2.5e-5},
    **{axis: {"P": 3.2029e-5, "I": 2.44381e-4, "D": 5.29e-7} for axis in BETAFLIGHT},
}
"""Command per deg/s, of a gain of one."""
_ENDS = {
    "FF": "f_gain", "P": "p_gain", "I": "i_gain", "D": "d_gain", "FLTG": "gyro_cutoff", "FLTD": "d_cutoff",
}  # fmt: skip
_ARDUPILOT_ENDS = ("FF", "P", "I", "D", "FLTT", "FLTE", "FLTD")
_LARGEST, _LARGEST_OF_BETAFLIGHT = 1000.0, 250.0
_FILTER = 20.0  # Hz: FLTE where the log does not say it, and FLTD of a suggestion
_OF_GYRO = {"FLTG": 0.0}  # the derivative is the gyro's, and its filter is behind it
_GYRO, _SLOPE = (50.0, 50.0, 100.0), (15.0, 15.0, 20.0)  # Hz: Rotorflight's own, where the log does not say them


def axes_of(known: Mapping[str, float]) -> Mapping[str, tuple[str, str]]:
    """Axes with their rate and command, by the names of the firmware whose gains a log holds; else ArduPilot's."""
    if any(f"{axis}_p_gain" in known for axis in ROTORFLIGHT):
        return ROTORFLIGHT
    return BETAFLIGHT if any(names_of(axis)["P"] in known for axis in BETAFLIGHT) else ARDUPILOT


def firmware_of(axis: str) -> str:
    """Whose name of an axis it is."""
    return "Rotorflight" if axis in ROTORFLIGHT else "Betaflight" if axis in BETAFLIGHT else "ArduPilot"


def cli_lines(gains: Mapping[str, float]) -> list[str]:
    """Lines of the command line of Rotorflight or Betaflight that set gains, without `save`.

    Betaflight's D is not raised in quick maneuvers (`d_max`): it is the one that was judged.
    """
    settings = {name: value for name, value in gains.items() if name != DTERM}
    settings |= {f"d_max_{name[2:]}": value for name, value in gains.items() if name.startswith("d_")}
    return [f"set {name} = {value:.0f}" for name, value in settings.items()]


def untuned(firmware: str, known: Mapping[str, float]) -> str:
    """Why no gains can be suggested by name for a log, in words; "" where they can.

    Args:
        firmware: of its autopilot, "" where no autopilot wrote it.
        known: the gains and filters that the log holds, by name.
    """
    ours, whose = axes_of(known), firmware.lower()
    if ours is not ARDUPILOT or not firmware or any(word in whose for word in _COPTERS):
        return ""
    if "rotorflight" in whose:
        return f"{firmware}: its header does not hold five gains an axis, and the scales of others are not known."
    if whose == _UNSAID and any(f"ATC_RAT_{axis}_P" in known for axis in ARDUPILOT):
        return ""
    who = "an ArduPilot vehicle that the log does not name" if whose == _UNSAID else firmware
    return (
        f"{who} flew this log, none that this program tunes: gains have the names of ArduCopter, of "
        "Rotorflight, or of Betaflight from 2025.12 on with filters of first order (PT1) of D."
    )


def names_of(axis: str) -> dict[str, str]:
    """The firmware's name by the short one, `P`, `I`, `D`, `FF` and filters."""
    if axis in ROTORFLIGHT:
        return {name: f"{axis}_{end}" for name, end in _ENDS.items()}
    if axis in BETAFLIGHT:
        of_yaw = {"FLTE": "yaw_lowpass_hz"} if axis == "Yaw" else {}
        return {**{name: f"{name.lower()}_{axis.lower()}" for name in "PID"}, **of_yaw, "FLTD": DTERM}
    return {name: f"ATC_RAT_{axis}_{name}" for name in _ARDUPILOT_ENDS}


def filters_of(axis: str, known: Mapping[str, float]) -> dict[str, float]:
    """Corners [Hz] that a suggestion keeps, by their short names."""
    if axis in ROTORFLIGHT:
        index = tuple(ROTORFLIGHT).index(axis)
        return {
            "FLTG": known.get(f"{axis}_gyro_cutoff", _GYRO[index]),
            "FLTD": known.get(f"{axis}_d_cutoff", _SLOPE[index]),
        }
    if axis in BETAFLIGHT:
        return {**_OF_GYRO, **{key: known.get(name, 0.0) for key, name in names_of(axis).items() if key[0] == "F"}}
    return {"FLTE": known.get(f"ATC_RAT_{axis}_FLTE", _FILTER), "FLTD": _FILTER}


def short(gains: Mapping[str, float]) -> dict[str, float]:
    """Gains as a loop of rad/s has them, by short names, from either firmware's."""
    known_names = {name: (axis, key) for axis in (*ROTORFLIGHT, *BETAFLIGHT) for key, name in names_of(axis).items()}
    by_short = dict(_OF_GYRO) if DTERM in gains else {}
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
        name: gains[key] if axis in ARDUPILOT else _rounded(gains[key] / _unit(axis, key))
        for key, name in names_of(axis).items()
        if key in gains
    }


def representable(axis: str, grid: Mapping[str, Array]) -> dict[str, Array]:
    """Of m sets of gains, shape (m,) each, the ones that the firmware can hold, rounded as it holds them."""
    if axis in ARDUPILOT:
        return dict(grid)
    most = _LARGEST_OF_BETAFLIGHT if axis in BETAFLIGHT else _LARGEST
    counts = {key: np.round(values / _unit(axis, key)) for key, values in grid.items()}
    held = np.all([(counts[key] >= 0.0) & (counts[key] <= most) for key in ("FF", "P", "I", "D")], axis=0)
    held &= counts["P"] >= 1.0
    rows = np.stack([counts[key][held] for key in grid], axis=1)
    each = np.unique(rows, axis=0)
    return {key: each[:, k] * _unit(axis, key) for k, key in enumerate(grid)}


def gain_text(name: str, value: float) -> str:
    """A gain as a table shows it: a whole number where the firmware holds whole ones."""
    return f"{value:.4f}" if name.startswith(("ATC_", "INS_")) else f"{value:.0f}"


def beware(axis: str, known: Mapping[str, float]) -> str:
    """What of the firmware's law is not in the loop that was judged, in words; empty for ArduPilot's."""
    if axis in BETAFLIGHT:
        remark = " TPA, anti-gravity and d_max are not in the loop that was judged"
        around = "; with an angle of 5 1/s around it (angle_p_gain 50) it keeps them too" if axis != "Yaw" else ""
        return f"{remark}{around}."
    if axis in ARDUPILOT:
        return ""
    stops: Sequence[float] = [known[name] for name in ("yaw_stop_gain_0", "yaw_stop_gain_1") if name in known]
    text = " Boost, relax and decay of the error are not in the loop that was judged."
    if axis == "yaw" and stops and max(stops) > 100.0:
        lost = 20.0 * math.log10(max(stops) / 100.0)
        text += f" The stop gain of {max(stops):g} % multiplies P: take {lost:.1f} dB from the gain margin."
    return text


def _unit(axis: str, key: str) -> float:
    scales = _SCALES.get(axis, {})
    return math.degrees(scales[key]) if key in scales else 1.0


def _rounded(value: float) -> float:
    return float(round(value))
