"""Who answers at an address: the autopilot that is expected, or words that say who does."""

from __future__ import annotations

import time
from collections.abc import Mapping

from swashplate.errors import LinkError
from swashplate.links.mavlink.connection import Connection

AUTOPILOT_NAMES: Mapping[int, str] = {3: "ArduPilot", 12: "PX4"}
"""By MAV_AUTOPILOT."""
ARDUPILOT, PX4, NO_AUTOPILOT = 3, 12, 8
_GROUND_STATION = 6
_ROTORCRAFT = (0, 2, 3, 4, 13, 14, 15, 29, 35)
"""MAV_TYPE that copter firmware has: no frame yet, and 2 to 12 rotors, coaxial, helicopter."""
_HELICOPTER = 4
_BUILDS = {True: "helicopters (arducopter-heli)", False: "multicopters and coaxials with two motors (arducopter)"}
"""ArduCopter's two builds, by whether their type is a helicopter's."""


def beat(connection: Connection) -> None:
    """Say that a ground station is here; TCP ports of SITL wait for bytes."""
    connection.send("heartbeat", _GROUND_STATION, NO_AUTOPILOT, 0, 0, 4)


def greet(connection: Connection, autopilot: int, timeout: float) -> int:
    """Wait for the autopilot's heartbeat, and refuse what is not the vehicle; returns its MAV_TYPE.

    Raises:
        LinkError: naming what is there.
    """
    until = time.monotonic() + timeout
    while (left := until - time.monotonic()) > 0.0:
        beat(connection)
        for _, message in connection.receive(min(left, 0.5)):
            if message.get_type() != "HEARTBEAT" or message.autopilot == NO_AUTOPILOT:
                continue
            if message.autopilot != autopilot:
                other = AUTOPILOT_NAMES.get(message.autopilot, f"autopilot number {message.autopilot}")
                raise LinkError(f"{other} answers, expected {AUTOPILOT_NAMES[autopilot]}.", where=connection.address)
            if message.type not in _ROTORCRAFT:
                problem = f"a vehicle of MAVLink's type {message.type} answers, expected a helicopter or a multicopter."
                raise LinkError(problem, where=connection.address, hint="Is it ArduCopter's binary?")
            connection.system = message.get_srcSystem()
            return int(message.type)
    raise LinkError(
        f"no autopilot was heard within {timeout:g} s.",
        where=connection.address,
        channel="--mavlink",
        hint="Is it running, and its physics (swash link) too? A ground station may hold the port; give another one.",
    )


def other_build(kind: int, layout: str) -> str:
    """What is wrong with ArduCopter's type (MAV_TYPE) for a vehicle's `Traits.servo_layout`, in words; "" for nothing.

    Its two builds fly other frames: a helicopter under the multicopters' would only lack its parameters.
    """
    build, expected = kind == _HELICOPTER, layout != "two motors"
    if build == expected:
        return ""
    return f"MAVLink's type {kind}: this is the build for {_BUILDS[build]}, expected the one for {_BUILDS[expected]}."
