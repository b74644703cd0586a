"""All parameters of a running autopilot, by MAVLink's parameter protocol, over a connection that may lose packets.

Protocol: PARAM_REQUEST_LIST is answered by one PARAM_VALUE for each parameter, with its index and the count; what was
lost is asked for by its index with PARAM_REQUEST_READ (https://mavlink.io/en/services/parameter.html).
"""

from __future__ import annotations

import struct
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from swashplate.errors import LinkError
from swashplate.links.mavlink.connection import AUTOPILOT, Connection

ROUNDS = 8
"""Times that what is missing is asked for without any of it coming before that is given up."""
_SILENCE = 0.7
"""s without a parameter after which the missing ones are asked for."""
_AT_ONCE = 50
"""Missing parameters asked for together."""
_LONGEST = 180.0
"""s that a whole reading may take."""
_NO_INDEX = 65_535
_PACKED = {1: "<B", 2: "<b", 3: "<H", 4: "<h", 5: "<I", 6: "<i"}
"""How the four bytes of an integer are read, by MAV_PARAM_TYPE."""


@dataclass
class ParameterReading:
    """What was read.

    Attributes:
        values: by name.
        count: how many there are, as the autopilot says.
        heard: which of their indices came.
    """

    values: dict[str, float] = field(default_factory=dict)
    count: int = 0
    heard: set[int] = field(default_factory=set)

    @property
    def missing(self) -> list[int]:
        """Indices that never came."""
        return [k for k in range(self.count) if k not in self.heard]

    @property
    def complete(self) -> bool:
        """Whether every parameter came."""
        return self.count > 0 and not self.missing

    def take(self, message: Any, *, packed: bool) -> bool:
        """Take a PARAM_VALUE; whether it brought something new."""
        new = message.param_id not in self.values
        self.values[message.param_id] = decoded(message.param_value, message.param_type, packed=packed)
        if message.param_index != _NO_INDEX:
            self.count = message.param_count
            self.heard.add(message.param_index)
        return new


def decoded(value: float, kind: int, *, packed: bool) -> float:
    """A parameter's number.

    Args:
        value: of the message, a 32-bit float.
        kind: MAV_PARAM_TYPE.
        packed: integers are the float's bytes (PX4), not converted to a float (ArduPilot).
    """
    if not packed or kind not in _PACKED:
        return float(value)
    form = _PACKED[kind]
    return float(struct.unpack(form, struct.pack("<f", value)[: struct.calcsize(form)])[0])


def read_parameters(connection: Connection, *, packed: bool) -> ParameterReading:
    """Every parameter that the autopilot sends; `complete` says whether some never came.

    Raises:
        LinkError: where none comes at all, or the connection breaks.
    """
    reading = ParameterReading()
    connection.send("param_request_list", connection.system, AUTOPILOT)
    start = last = time.monotonic()
    vain = 0
    while vain < ROUNDS and not reading.complete and time.monotonic() - start < _LONGEST:
        for now, message in connection.receive(_SILENCE / 4.0):
            if message.get_type() == "PARAM_VALUE" and reading.take(message, packed=packed):
                last, vain = now, 0
        if time.monotonic() - last >= _SILENCE and not reading.complete:
            vain += 1
            last = time.monotonic()
            _ask_again(connection, reading)
    if not reading.values:
        raise LinkError("the autopilot is there, but sends no parameters.", where=connection.address)
    return reading


def _ask_again(connection: Connection, reading: ParameterReading) -> None:
    if not reading.count:
        connection.send("param_request_list", connection.system, AUTOPILOT)
    for index in reading.missing[:_AT_ONCE]:
        connection.send("param_request_read", connection.system, AUTOPILOT, b"", index)


def ask_by_name(connection: Connection, reading: ParameterReading, names: Iterable[str], *, packed: bool) -> None:
    """Ask thrice for parameters that a list may leave out (PX4 lists those in use only); what comes is added."""
    for _ in range(3):
        absent = [name for name in names if name not in reading.values]
        for name in absent:
            connection.send("param_request_read", connection.system, AUTOPILOT, name.encode(), -1)
        until = time.monotonic() + _SILENCE
        while absent and (left := until - time.monotonic()) > 0.0:
            for _, message in connection.receive(left):
                if message.get_type() == "PARAM_VALUE":
                    reading.take(message, packed=packed)
            absent = [name for name in absent if name not in reading.values]
