"""A stand-in for a running autopilot, from MAVLink's public message definitions: parameters, checks, texts, its clock.

Like SITL it serves one TCP client; like PX4 it may send to a UDP port instead.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common

HEALTHY = common.MAV_SYS_STATUS_SENSOR_3D_GYRO | common.MAV_SYS_STATUS_AHRS | common.MAV_SYS_STATUS_PREARM_CHECK


@dataclass
class StandIn:
    """How it behaves.

    Attributes:
        parameters: its own, by name. integers: those that it holds as 32-bit integers.
        autopilot, type: of its heartbeat.
        lost: so many of the first answers to a list are lost, every `lost`-th. never: names that it never sends.
        unlisted: names that it sends only when they are asked for by name.
        refusals: texts of its checks before arming. sick: bits of sensors that are not healthy.
        tells: whether it sends SYS_STATUS.
        speed: simulated seconds a second. boots: wall seconds after which its clock falls back.
        silent: says nothing at all.
    """

    parameters: Mapping[str, float]
    integers: frozenset[str] = frozenset()
    autopilot: int = common.MAV_AUTOPILOT_ARDUPILOTMEGA
    type: int = common.MAV_TYPE_HELICOPTER
    lost: int = 0
    never: frozenset[str] = frozenset()
    unlisted: frozenset[str] = frozenset()
    refusals: tuple[str, ...] = ()
    sick: int = 0
    tells: bool = True
    speed: float = 1.0
    boots: float = float("inf")
    silent: bool = False
    udp: int | None = None
    asked_again: int = 0

    def __enter__(self) -> StandIn:
        self._over = threading.Event()
        self._writer: Any = common.MAVLink(None, srcSystem=7, srcComponent=1)
        self._reader: Any = common.MAVLink(None)
        self._listed = [name for name in self.parameters if name not in self.unlisted]
        if self.udp is None:
            self._door = socket.create_server(("127.0.0.1", 0))
            self.address = f"tcp:127.0.0.1:{self._door.getsockname()[1]}"
        else:
            self._door = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._door.connect(("127.0.0.1", self.udp))
            self.address = f"udp:127.0.0.1:{self.udp}"
        self._door.settimeout(60.0)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self._door.close()

    def _run(self) -> None:
        self._wire = self._door if self.udp is not None else self._door.accept()[0]
        self._wire.settimeout(0.02)
        start = beat = time.monotonic()
        with self._wire:
            while not self._over.is_set():
                now = time.monotonic()
                if now >= beat and not self.silent:
                    self._beat(now - start)
                    beat += 0.1
                try:
                    data = self._wire.recv(65_536)
                except (TimeoutError, ConnectionError):
                    continue
                if not data:
                    return
                for message in self._reader.parse_buffer(data) or ():
                    if not self.silent:
                        self._answer(message)

    def _send(self, name: str, *values: object) -> None:
        try:
            self._wire.sendall(getattr(self._writer, f"{name}_encode")(*values).pack(self._writer))
        except ConnectionError:
            self._over.set() if self.udp is None else None

    def _beat(self, since: float) -> None:
        self._send("heartbeat", self.type, self.autopilot, 0, 0, 3)
        since = since if since < self.boots else since - self.boots
        self._send("system_time", 0, round(1e3 * self.speed * since))
        if self.tells:
            ready = 0 if self.refusals or self.sick else common.MAV_SYS_STATUS_PREARM_CHECK
            healthy = (HEALTHY & ~self.sick & ~common.MAV_SYS_STATUS_PREARM_CHECK) | ready
            self._send("sys_status", HEALTHY, HEALTHY, healthy, *(0,) * 10)

    def _answer(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            for place, name in enumerate(self._listed):
                if not (self.lost and place % self.lost == 0):
                    self._parameter(name)
        elif kind == "PARAM_REQUEST_READ":
            self.asked_again += 1
            name = message.param_id if message.param_index < 0 else self._listed[message.param_index]
            if name in self.parameters and not (self.lost and self.asked_again % 2):
                self._parameter(name)
        elif kind == "COMMAND_LONG" and message.command == common.MAV_CMD_RUN_PREARM_CHECKS:
            for number, text in enumerate(self.refusals, start=1):
                raw = text.encode()
                pieces = [raw[k : k + 50] for k in range(0, len(raw), 50)]
                for place, piece in enumerate(pieces):
                    self._send("statustext", 2, piece, number if len(pieces) > 1 else 0, place)

    def _parameter(self, name: str) -> None:
        if name in self.never:
            return
        value, kind = self.parameters[name], common.MAV_PARAM_TYPE_REAL32
        if name in self.integers:
            kind = common.MAV_PARAM_TYPE_INT32
            if self.autopilot == common.MAV_AUTOPILOT_PX4:  # PX4 sends the integer's bytes
                value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        place = self._listed.index(name) if name in self._listed else 65_535
        self._send("param_value", name.encode(), value, kind, len(self._listed), place)
