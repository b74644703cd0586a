"""Names of ArduPilot's flight modes: every firmware counts its own, and mode 5 is LOITER here and FBWA there.

Source: ArduPilot's mode numbers (`mode.h` of each vehicle, 4.0 to 4.7). Traditional helicopters fly Copter's, boats
Rover's. Blimp's are not here: MANUAL and LAND have changed places between its versions.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

_COPTER = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 7: "CIRCLE", 9: "LAND",
    11: "DRIFT", 13: "SPORT", 14: "FLIP", 15: "AUTOTUNE", 16: "POSHOLD", 17: "BRAKE", 18: "THROW", 19: "AVOID_ADSB",
    20: "GUIDED_NOGPS", 21: "SMART_RTL", 22: "FLOWHOLD", 23: "FOLLOW", 24: "ZIGZAG", 25: "SYSTEMID", 26: "AUTOROTATE",
    27: "AUTO_RTL", 28: "TURTLE", 29: "RATE_ACRO",
}  # fmt: skip
_PLANE = {
    0: "MANUAL", 1: "CIRCLE", 2: "STABILIZE", 3: "TRAINING", 4: "ACRO", 5: "FBWA", 6: "FBWB", 7: "CRUISE",
    8: "AUTOTUNE", 10: "AUTO", 11: "RTL", 12: "LOITER", 13: "TAKEOFF", 14: "AVOID_ADSB", 15: "GUIDED",
    16: "INITIALISING", 17: "QSTABILIZE", 18: "QHOVER", 19: "QLOITER", 20: "QLAND", 21: "QRTL", 22: "QAUTOTUNE",
    23: "QACRO", 24: "THERMAL", 25: "LOITER_ALT_QLAND", 26: "AUTOLAND",
}  # fmt: skip
_ROVER = {
    0: "MANUAL", 1: "ACRO", 3: "STEERING", 4: "HOLD", 5: "LOITER", 6: "FOLLOW", 7: "SIMPLE", 8: "DOCK", 9: "CIRCLE",
    10: "AUTO", 11: "RTL", 12: "SMART_RTL", 15: "GUIDED", 16: "INITIALISING",
}  # fmt: skip
_SUB = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 7: "CIRCLE", 9: "SURFACE", 16: "POSHOLD",
    19: "MANUAL", 20: "MOTOR_DETECT", 21: "SURFTRAK",
}  # fmt: skip
_TRACKER = {0: "MANUAL", 1: "STOP", 2: "SCAN", 3: "SERVOTEST", 4: "GUIDED", 10: "AUTO", 16: "INITIALISING"}
_FIRMWARES: Mapping[str, Mapping[int, str]] = {
    "copter": _COPTER, "plane": _PLANE, "rover": _ROVER, "sub": _SUB, "tracker": _TRACKER, "blimp": {},
}  # fmt: skip
# "ArduCopter V4.5.7 (abc)", "APM:Plane V3.3", "AntennaTracker V1.1", "Blimp V4.2"
_SAID = re.compile(r"(?:Ardu|AP[A-Z]*:? ?|Antenna ?)?(Copter|Plane|Rover|Sub|Tracker|Blimp) ?V\d", re.IGNORECASE)


def is_firmware(text: str) -> bool:
    """Whether a message of the log is the one in which the firmware says its name and version."""
    return _SAID.match(text) is not None


def mode_name(firmware: str, number: int) -> str:
    """The mode's name in this firmware; its number where the firmware is not known or has no such mode.

    Args:
        firmware: as the log says it: "ArduPlane V4.5.7 (abc)".
    """
    said = _SAID.match(firmware)
    return _FIRMWARES[said[1].lower()].get(number, f"mode {number}") if said else f"mode {number}"
