"""What a ground station asks of an autopilot: modes, arming, parameters, and what it answers."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from swashplate.links.mavlink.connection import AUTOPILOT, Connection
from swashplate.links.mavlink.greeting import beat
from swashplate.links.mavlink.health import Health

_DO_SET_MODE, _ARM_DISARM, _REQUEST_MESSAGE, _SET_MESSAGE_INTERVAL, _RUN_PREARM_CHECKS = 176, 400, 512, 511, 401
_AUTOPILOT_VERSION, _SYS_STATUS, _SYSTEM_TIME, _EKF_STATUS_REPORT = 148, 1, 2, 193
_CUSTOM_MODE_ENABLED = 1.0
_REAL32 = 9
ACCEPTED = 0
"""MAV_RESULT."""


class Commanding:
    """A connection to an autopilot that was greeted.

    Args:
        connection: to it.

    Attributes:
        health: what it said of its readiness, and all its texts.
        mode: its custom mode; None before a heartbeat.
        acknowledged: MAV_RESULT by command, the newest.
        values: parameters that came, by name.
        version: (major, minor, patch) of its firmware; None until it said so.
    """

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.health = Health()
        self.mode: int | None = None
        self.acknowledged: dict[int, int] = {}
        self.values: dict[str, float] = {}
        self.version: tuple[int, int, int] | None = None
        self._beaten = 0.0

    def hear(self, wait: float) -> None:
        """Take what comes within `wait` [s]; a heartbeat goes out every second."""
        if time.monotonic() - self._beaten >= 1.0:
            self._beaten = time.monotonic()
            beat(self.connection)
        for now, message in self.connection.receive(wait):
            self.health.take(now, message)
            self._take(message)

    def _take(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self.mode = int(message.custom_mode)
        elif kind == "COMMAND_ACK":
            self.acknowledged[int(message.command)] = int(message.result)
        elif kind == "PARAM_VALUE":
            self.values[message.param_id] = float(message.param_value)
        elif kind == "AUTOPILOT_VERSION":
            number = int(message.flight_sw_version)
            self.version = (number >> 24 & 255, number >> 16 & 255, number >> 8 & 255)

    def command(self, number: int, *values: float) -> None:
        """Send a COMMAND_LONG; its answer is forgotten and waited for anew."""
        self.acknowledged.pop(number, None)
        padded: Sequence[float] = (*values, *(0.0,) * (7 - len(values)))
        self.connection.send("command_long", self.connection.system, AUTOPILOT, number, 0, *padded)

    def ask_version(self) -> None:
        """Ask which version it is."""
        self.command(_REQUEST_MESSAGE, _AUTOPILOT_VERSION)

    def ask_readiness(self, *, interval: float) -> None:
        """Ask for its checks before arming, and for SYS_STATUS, its clock and its EKF every `interval` [s]."""
        for number in (_SYS_STATUS, _SYSTEM_TIME, _EKF_STATUS_REPORT):
            self.command(_SET_MESSAGE_INTERVAL, number, 1e6 * interval)
        self.command(_RUN_PREARM_CHECKS)

    def ask_mode(self, mode: int) -> None:
        """Ask for a mode."""
        self.command(_DO_SET_MODE, _CUSTOM_MODE_ENABLED, mode)

    def ask_arming(self) -> None:
        """Ask to be armed."""
        self.command(_ARM_DISARM, 1.0)

    @property
    def arming_answer(self) -> int | None:
        """MAV_RESULT of the last request to be armed; None until it came."""
        return self.acknowledged.get(_ARM_DISARM)

    def set_value(self, name: str, value: float) -> None:
        """Set a parameter; its answer stands in `values`."""
        self.values.pop(name, None)
        self.connection.send("param_set", self.connection.system, AUTOPILOT, name.encode(), value, _REAL32)
