"""Who a SITL binary is, before anything is prepared for it: started beside a vehicle that only stands."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence

from swashplate.arrays import Array
from swashplate.errors import LinkError
from swashplate.links.ardupilot.runner import serve
from swashplate.links.ardupilot.session import ArduPilotSession
from swashplate.links.ardupilot.sitl import Sitl
from swashplate.links.ardupilot.trial import Background
from swashplate.links.mavlink.commanding import Commanding
from swashplate.links.mavlink.connection import Connection
from swashplate.links.mavlink.greeting import ARDUPILOT, greet, other_build
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.sensing import Sensing
from swashplate.links.servos import ServoMapping
from swashplate.links.sockets import listen_udp
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.standing import at_rest
from swashplate.simulation.stepping import at_standstill

OLDEST = (4, 5)
"""ArduCopter whose parameters ours are."""
OLDEST_WORDS = ".".join(map(str, OLDEST))


class Immovable:
    """A `SteppingEngine` that compiles nothing: the vehicle stands where it was put.

    Args:
        row: the state row.
        gravity: [m/s^2].
    """

    def __init__(self, row: Array, gravity: float) -> None:
        still = at_standstill(row, gravity)
        self._told = [*still.states, *still.velocity, *still.force]

    def place(self, row: Array) -> None:
        """It is there already."""

    def advance(self, inputs: Sequence[float], around: Array, step: float, steps: int) -> list[float]:
        """The same whatever the inputs are."""
        return list(self._told)


def who_it_is(sitl: Sitl, vehicle: Vehicle, mapping: ServoMapping, environment: Environment, *, timeout: float) -> str:
    """Start a binary, ask which version it is, and end it.

    Args:
        sitl: the binary, in a folder for this alone.
        vehicle: from `standing`. mapping: of its servos. environment: air and gravity.
        timeout: wall clock of each step: until its port is open, until it is heard, until it says its version [s].

    Raises:
        LinkError: a binary that cannot be run, ends, opens no port, is no ArduCopter of version 4.5 or later, or is
            its build for other frames; a port of the physics that is taken.
    """
    around = Surroundings(environment)
    still = Immovable(at_rest(vehicle, environment), float(environment.gravity))
    plant = Plant(vehicle, mapping, around, engine=lambda motion, air: still)
    session = ArduPilotSession(plant, Sensing(plant), Notices(lambda text: None))
    with (
        listen_udp("127.0.0.1", sitl.physics_port) as bound,
        Background(lambda go_on: serve(bound, session, go_on=go_on)),
        sitl,
    ):
        sitl.wait_for_port(timeout)
        with naming_the_end(sitl), Connection(f"tcp:127.0.0.1:{sitl.mavlink_port}", timeout=timeout) as connection:
            kind = greet(connection, ARDUPILOT, timeout)
            if mismatch := other_build(kind, vehicle.traits.servo_layout):
                raise LinkError(mismatch, where=sitl.binary)
            return f"version {_dotted(_version(Commanding(connection), timeout, sitl))}"


@contextlib.contextmanager
def naming_the_end(sitl: Sitl) -> Iterator[None]:
    """Where a connection fails because the binary ended, say how it ended instead."""
    try:
        yield
    except LinkError as error:
        if ending := sitl.ended(patience=2.0):
            raise LinkError(ending, where=sitl.binary, hint=f"All it printed is in {sitl.output}.") from None
        raise error


def _dotted(numbers: Sequence[int]) -> str:
    return ".".join(map(str, numbers))


def _version(autopilot: Commanding, timeout: float, sitl: Sitl) -> tuple[int, int, int]:
    asked = time.monotonic()
    until = asked + timeout
    while autopilot.version is None and time.monotonic() < until and not sitl.ended():
        if time.monotonic() >= asked:
            autopilot.ask_version()
            asked += 0.5
        autopilot.hear(0.1)
    if autopilot.version is None:
        raise LinkError("does not say which version it is.", where=sitl.binary)
    if autopilot.version[:2] < OLDEST:
        raise LinkError(
            f"is version {_dotted(autopilot.version)}, expected {OLDEST_WORDS} or later.", where=sitl.binary
        )
    return autopilot.version
