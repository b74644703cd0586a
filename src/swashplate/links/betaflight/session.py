"""A vehicle as the physics of Betaflight's SITL: states out and motors in.

In lockstep (`stepped_clock`) each state answers the motors of a loop. Otherwise each side has a clock of its own. The
firmware sets the pace of its clock from the time stamps of the last two states and when they came: on a busy
machine it rushes by a factor of three. A state with the time stamp of the one before leaves its clock alone, and so
does 0, where it begins: all of lockstep. Without it three states set a pace once, slower than the wall clock where a
machine is busy, and all others have the same stamp; how late steps were is told.
A build with ENABLE_SIMULATOR_GYROPID_SYNC runs a loop for each state.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from swashplate.links.betaflight.motors import MotorMapping
from swashplate.links.betaflight.packets import (
    STATE_PORT,
    STICKS_PORT,
    PulseRefusal,
    pulses_of,
    state_packet,
    sticks_packet,
)
from swashplate.links.betaflight.servo_outputs import SwashServoMapping
from swashplate.links.betaflight.stepped_clock import LOOP
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant
from swashplate.links.sensing import Sensing
from swashplate.links.sockets import wait_at_most
from swashplate.simulation.stepping import Motion

STEP, _WALL = 0.0005, 0.001
"""s between two states: twice for each of its loops, so that none works with a state again and the motors of each are
sent, as they stand in its log; s of wall clock at least."""
LONGEST = 0.02
"""s that the physics moves at once at most: what a machine stood still longer is lost to it, and told."""
_TICK = 0.00025
"""s: moves are whole numbers of it."""
_STARTING, _PATIENCE, _STEADY = 0.002, 0.5, 100
"""s of wall clock without motors after which the next state goes out in lockstep too: while the firmware starts, which
sends few, and behind so many that came for each state."""
_STAMP = 0.015
"""s between the two time stamps that set the pace: 20 ms are no pace for it."""
STICKS_EVERY = 0.01
"""s between two packets of sticks."""
_AT_REST = 1000.0
"""us: motors before the first packet."""
Sticks = Callable[[float, Motion], list[float] | None]
"""A pilot: sticks [us] for a time and a motion; None while nobody holds them."""


@dataclass
class Exchanged:
    """How it goes.

    Attributes:
        states: sent. motors: packets that came.
        longest: between two states, and lost: that the physics left out, in simulated time [s].
    """

    states: int = 0
    motors: int = 0
    longest: float = 0.0
    lost: float = 0.0

    @property
    def answered(self) -> float:
        """Share of the states that a motor packet came for."""
        return self.motors / self.states if self.states else 0.0


class BetaflightSession:
    """A plant under Betaflight, or Rotorflight.

    Args:
        plant: what flies. mapping: its own. sensing: its sensors. notices: where to say what happens.
        sticks: the pilot. doubles: of a state; 17 leave the pressure out (Rotorflight).

    Attributes:
        pulses: the newest outputs [us].
        pace: simulated seconds a second; at most in lockstep.
        in_lockstep: whether the firmware's clock waits for states.
    """

    def __init__(
        self,
        plant: Plant,
        mapping: MotorMapping | SwashServoMapping,
        sensing: Sensing,
        notices: Notices,
        *,
        sticks: Sticks = lambda time, motion: None,
        doubles: int = 18,
    ) -> None:
        self.plant, self._sensing, self._notices, self.sticks, self._size = plant, sensing, notices, sticks, 8 * doubles
        self.pace, self.in_lockstep, self._motors = 1.0, False, mapping.motors
        self.pulses = [_AT_REST] * max(plant.mapping.channels)
        self.exchanged = Exchanged()
        self._said_broken, self._due = False, 0.0

    def take(self, data: bytes) -> None:
        """A datagram of the motors' port, whatever it holds."""
        packet = pulses_of(data)
        if isinstance(packet, PulseRefusal):
            self._notices.tell(packet.kind, packet.sentence)
            return
        wanted = self._motors
        if packet.motors != wanted:
            text = f"the firmware drives {packet.motors} motors, the vehicle has {wanted}: load its configuration."
            self._notices.tell("motors", text)
            return
        if wanted < len(self.pulses) and not any(packet.values[wanted : len(self.pulses)]):
            self._notices.tell("servos", "the firmware sends no servos behind its motor: the vehicle stays as it is.")
            return
        if not self.exchanged.motors:
            self._notices.always(f"Betaflight drives {packet.motors} motors.")
        self.exchanged.motors += 1
        self.pulses = list(packet.values[: len(self.pulses)])

    def begun(self, stamp: float) -> bytes:
        """The state where it stands, with a time stamp [s]."""
        return state_packet(stamp, self._sensing.read(self.plant.motion))[: self._size]

    def step(self, duration: float) -> tuple[bytes, bytes | None]:
        """Move so long [s] under the newest motors. Returns the state to send, and sticks where they are due."""
        motion = self.plant.advance(self.pulses, duration)
        if self.plant.broken and not self._said_broken:
            self._said_broken = True
            self._notices.always(f"the vehicle broke at {self.plant.time:.2f} s: {self.plant.broken}. It lies there.")
        held = self.sticks(self.plant.time, motion)
        self.exchanged.states += 1
        state = self.begun(0.0 if self.in_lockstep else _STAMP)
        if held is None or self.plant.time < self._due:
            return state, None
        self._due = self.plant.time + STICKS_EVERY - 1e-9
        return state, sticks_packet(self.plant.time, held)


def serve(
    bound: socket.socket,
    session: BetaflightSession,
    *,
    go_on: Callable[[], bool] = lambda: True,
    idle_exit: float | None = None,
) -> None:
    """Send states to this machine, in lockstep or at their pace, and take what comes on the motors' port.

    Args:
        bound: a UDP socket on the motors' port; it is not closed.
        session: what answers.
        go_on: asked at every step whether to go on.
        idle_exit: end after so many seconds without a motor packet; None goes on for ever.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.bind(("127.0.0.1", 0))  # left to itself, the first packet would open a port to every machine
        steps = _in_lockstep(bound, out, session) if session.in_lockstep else _at_pace(bound, out, session)
        heard, came = time.monotonic(), 0
        for duration in steps:
            if not go_on():
                return
            state, sticks = session.step(duration)
            if sticks is not None:
                _send(out, sticks, STICKS_PORT)
            _send(out, state, STATE_PORT)
            if session.exchanged.motors > came:
                heard, came = time.monotonic(), session.exchanged.motors
            if idle_exit is not None and time.monotonic() - heard >= idle_exit:
                return


def _in_lockstep(bound: socket.socket, out: socket.socket, session: BetaflightSession) -> Iterator[float]:
    """A loop for each packet of motors."""
    begun, session.exchanged.longest, answered = time.monotonic(), LOOP, 0
    while True:
        if answered in (0, _STEADY):
            wait_at_most(bound, _PATIENCE if answered else _STARTING)
        yield LOOP
        answered = answered + 1 if _receive(bound, session) else 0
        if (left := begun + session.plant.time / session.pace - time.monotonic()) > 0.0:
            time.sleep(left)


def _at_pace(bound: socket.socket, out: socket.socket, session: BetaflightSession) -> Iterator[float]:
    """What the wall clock has moved."""
    bound.setblocking(False)
    for stamp in (0.0, 0.0, _STAMP):  # the second is the first whose time it keeps
        _send(out, session.begun(stamp), STATE_PORT)
        time.sleep(_STAMP / session.pace if stamp == 0.0 else 0.0)
    moved_to = time.monotonic()
    while True:
        pace = session.pace
        while (left := moved_to + max(STEP / pace, _WALL) - time.monotonic()) > 0.0:
            time.sleep(left)
        while _receive(bound, session):
            pass
        ticks = int((time.monotonic() - moved_to) * pace / _TICK)
        moved_to += ticks * _TICK / pace
        duration = min(LONGEST, ticks * _TICK)
        counts = session.exchanged
        counts.longest, counts.lost = max(counts.longest, ticks * _TICK), counts.lost + ticks * _TICK - duration
        yield duration


def _send(out: socket.socket, data: bytes, port: int) -> None:
    try:
        out.sendto(data, ("127.0.0.1", port))
    except OSError:
        return  # nobody is there yet, or any more


def _receive(bound: socket.socket, session: BetaflightSession) -> bool:
    """Take one datagram; whether one came."""
    try:
        data = bound.recv(2048)
    except (TimeoutError, BlockingIOError, ConnectionError):
        return False
    session.take(data)
    return True
