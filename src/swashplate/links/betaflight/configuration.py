"""Lines of Betaflight's command line that make a new configuration fly a vehicle in its SITL.

Names: its cli.c, settings.c and msp_box.c (permanent numbers of modes).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from swashplate.errors import LinkError
from swashplate.files import read_text
from swashplate.links.betaflight.motors import MotorMapping

ANGLE_LIMIT = 30.0
"""Degrees at a full stick in ANGLE mode."""
_ARM, _ANGLE = 0, 1
"""Modes; the switches are channels 5 and 6."""
_UP = "1700 2100"
_SET = re.compile(r"set\s+(\w+)\s*=\s*(-?\d+(?:\.\d+)?)")


def configuration(mapping: MotorMapping, gains: Mapping[str, float]) -> str:
    """The text of a file for `--config`.

    Args:
        mapping: of the motors.
        gains: settings by name that are set too, e.g. `p_roll`.
    """
    lines = [
        "feature -GPS",
        "feature AIRMODE",  # without it the mixer takes a part of every command away below half throttle
        "feature -RX_SERIAL",
        "mixer CUSTOM",
        "mmix reset",
        *(f"mmix {i} 1.000 {roll:.3f} {pitch:.3f} {yaw:.3f}" for i, (roll, pitch, yaw) in enumerate(mapping.mixer)),
        f"aux 0 {_ARM} 0 {_UP} 0 0",
        f"aux 1 {_ANGLE} 1 {_UP} 0 0",
        "set simplified_pids_mode = OFF",
        "set small_angle = 180",
        f"set angle_limit = {ANGLE_LIMIT:g}",
        "set blackbox_device = VIRTUAL",
        "set blackbox_sample_rate = 1/2",
        *(f"set {name} = {value:g}" for name, value in gains.items()),
        "save",
    ]
    return "\n".join(lines) + "\n"


def read_settings(path: str | Path) -> dict[str, float]:
    """The numbers that lines of Betaflight's command line set (`set p_roll = 45`); remarks and `save` are passed over.

    Raises:
        LinkError: naming the line that is neither.
    """
    settings: dict[str, float] = {}
    for line in read_text(Path(path)).splitlines():
        text = line.partition("#")[0].strip()
        if not text or text == "save":
            continue
        hit = _SET.fullmatch(text)
        if hit is None:
            raise LinkError(f"has the line '{text[:60]}', expected 'set NAME = NUMBER'.", where=path)
        settings[hit[1]] = float(hit[2])
    return settings
