"""Why an autopilot refuses to be armed, and how fast its clock runs: texts, SYS_STATUS and SYSTEM_TIME."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swashplate.links.mavlink.connection import AUTOPILOT, Connection

REFUSALS = ("prearm:", "arm:", "preflight fail:", "arming denied")
"""How texts begin that say why arming is refused (ArduPilot's, then PX4's)."""
_SETTLED = 1.0
"""s of wall clock below which no real-time factor is said."""
_RUN_PREARM_CHECKS, _SET_MESSAGE_INTERVAL = 401, 511
_SYS_STATUS, _SYSTEM_TIME = 1, 2
_INTERVAL = 200_000.0
"""us between the messages that are asked for."""
_PREARM_CHECK = 1 << 28
_PLACE, _ASSUMED = 1 << 4, 1 << 7
"""EKF_POS_HORIZ_ABS and EKF_CONST_POS_MODE: a place is known; it is only assumed."""
_SENSORS = {
    0: "gyro", 1: "accelerometer", 2: "magnetometer", 3: "barometer", 4: "airspeed sensor", 5: "GPS",
    15: "motor outputs", 16: "RC receiver", 17: "second gyro", 18: "second accelerometer", 19: "second magnetometer",
    20: "geofence", 21: "attitude estimate (EKF)", 22: "terrain", 24: "logging", 25: "battery", 26: "proximity sensor",
    29: "obstacle avoidance", 30: "propulsion",
}  # fmt: skip
"""Bits of MAV_SYS_STATUS_SENSOR."""


@dataclass
class Health:
    """What was heard of an autopilot's readiness.

    Attributes:
        texts: everything that it said, in order.
        refusals: why it cannot be armed, in its own words, each once.
        sick: names of sensors that are enabled and not healthy.
        ready: whether its checks passed; None where it never said.
        placed: whether its EKF has a place on earth (EKF_STATUS_REPORT); None where it never said.
        armed: whether it is armed.
        restarted: whether its clock fell back.
        clock: pairs of wall clock and time since boot [s].
    """

    texts: list[str] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)
    sick: tuple[str, ...] = ()
    ready: bool | None = None
    placed: bool | None = None
    armed: bool = False
    restarted: bool = False
    clock: list[tuple[float, float]] = field(default_factory=list)
    _chunks: dict[int, str] = field(default_factory=dict)

    def take(self, now: float, message: Any) -> None:
        """Take any message, received at `now` [s]."""
        kind = message.get_type()
        if kind == "STATUSTEXT":
            self._text(message)
        elif kind == "SYS_STATUS":
            self._status(message)
        elif kind == "HEARTBEAT":
            self.armed = bool(message.base_mode & 128)
        elif kind == "EKF_STATUS_REPORT":
            self.placed = message.flags & (_PLACE | _ASSUMED) == _PLACE
        elif kind == "SYSTEM_TIME":
            boot = 1e-3 * message.time_boot_ms
            if self.clock and boot < self.clock[-1][1]:
                self.restarted = True
                self.clock.clear()
            self.clock.append((now, boot))

    def real_time_factor(self) -> tuple[float, float] | None:
        """Simulated seconds a second, and how far off that may be; None where less than a second was heard.

        The slope of a line through the pairs of clocks; its bound is twice the largest distance from the line over the
        time heard.
        """
        if len(self.clock) < 3 or self.clock[-1][0] - self.clock[0][0] < _SETTLED:
            return None
        wall, boot = np.array(self.clock).T
        wall = wall - wall[0]
        slope, start = np.polyfit(wall, boot, 1)
        return float(slope), float(2.0 * np.max(np.abs(boot - start - slope * wall)) / wall[-1])

    def _text(self, message: Any) -> None:
        text = message.text
        if message.id:  # a long text comes in pieces of 50 bytes; a shorter one ends it
            text = self._chunks[message.id] = (
                "" if message.chunk_seq == 0 else self._chunks.get(message.id, "")
            ) + text
            if len(message.text) == 50:
                return
        self.texts.append(text)
        if text.lower().startswith(REFUSALS) and text not in self.refusals:
            self.refusals.append(text)

    def _status(self, message: Any) -> None:
        enabled = message.onboard_control_sensors_present & message.onboard_control_sensors_enabled
        sick = enabled & ~message.onboard_control_sensors_health
        self.sick = tuple(name for bit, name in _SENSORS.items() if sick >> bit & 1)
        self.ready = not sick & _PREARM_CHECK if enabled & _PREARM_CHECK else None


def listen_to_health(connection: Connection, *, duration: float) -> Health:
    """Ask for the checks before arming, and listen for so long [s]."""
    health = Health()
    for number in (_SYS_STATUS, _SYSTEM_TIME):
        _command(connection, _SET_MESSAGE_INTERVAL, number, _INTERVAL)
    _command(connection, _RUN_PREARM_CHECKS)
    until = time.monotonic() + duration
    while (left := until - time.monotonic()) > 0.0:
        for now, message in connection.receive(min(left, 0.2)):
            health.take(now, message)
    return health


def _command(connection: Connection, number: int, *values: float) -> None:
    padded: Sequence[float] = (*values, *(0.0,) * (7 - len(values)))
    connection.send("command_long", connection.system, AUTOPILOT, number, 0, *padded)
