"""A pilot at a radio who sees where the vehicle is: keeps a place and a height in manual modes, else lets go.

Sticks go to SITL's RC port as 16 pulses, every 20 ms of simulated time, from within the physics: however fast the
simulation runs, the pilot is never late.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from swashplate.simulation.stepping import Motion

PERIOD = 0.02
"""s of simulated time between two looks."""
PLACE, SPEED, _MOST_LEAN = 0.04, 0.08, 0.15
"""Lean [rad] per m and per m/s, and the most: 0.6 rad/s and well damped with gravity alone."""
_CLIMB, _SINK, _UP = 0.8, -0.5, 0.8
"""m/s per m of height, and the limits."""
_HEAVE_BANDWIDTH, _HEAVE_INTEGRAL = 2.0, 0.75
"""rad/s of the climb loop, and 1/s of its integral beside it."""
_PULSES = struct.Struct("<16H")

Hands = Literal["down", "flying", "height let go", "centred"]
"""Collective down and the rest centred; all sticks flown; collective centred and the rest flown; all centred."""


class Seen(NamedTuple):
    """One look: time [s], place north, east, down from the start [m], roll, pitch, yaw [rad], main rotor [rad/s]."""

    time: float
    north: float
    east: float
    down: float
    roll: float
    pitch: float
    yaw: float
    rotor: float


@dataclass
class TrialPilot:
    """Who holds the sticks.

    Attributes:
        send: to SITL's RC port.
        heave: climb acceleration per unit of the collective stick [m/s^2], about hover.
        hover_stick: about where it hovers (0 to 1).
        lean_max: lean at a full stick [rad].
        keep: lean per m off its place and per m/s [rad].
        depth: of the ground below the origin of the motion [m].
        hands: what they do. interlock: whether the switch on channel 8 is up.
        height: to keep [m]. place: to keep, north and east [m].
        looks: every look. due: when the next one is [s].
    """

    send: Callable[[bytes], object]
    heave: float
    hover_stick: float
    lean_max: float = math.radians(30.0)
    keep: tuple[float, float] = (PLACE, SPEED)
    depth: float = 0.0
    hands: Hands = "down"
    interlock: bool = False
    height: float = 0.0
    place: tuple[float, float] = (0.0, 0.0)
    looks: list[Seen] = field(default_factory=list)
    _lift: float = 0.0
    due: float = 0.0

    def take_off(self) -> None:
        """Take the sticks where the vehicle stands; the collective begins a little below hover."""
        self.place = (self.looks[-1].north, self.looks[-1].east) if self.looks else (0.0, 0.0)
        self._lift = 0.6 * self.hover_stick
        self.hands = "flying"

    def look(self, time: float, motion: Motion, rotor: float) -> None:
        """Called after every step of the physics."""
        if time < self.due - 1e-9 and time > self.due - 1.0:
            return
        self.due = time + PERIOD
        body, v = motion.body, motion.velocity
        x, y, z, phi, theta, psi = map(float, (body.x, body.y, body.z, body.phi, body.theta, body.psi))
        now = Seen(time, x, y, z + self.depth, phi, theta, psi, rotor)
        self.looks.append(now)
        leans = self.hands in ("flying", "height let go")
        roll, pitch = self._lean(now, float(v.x), float(v.y)) if leans else (0.0, 0.0)
        lift = self._collective(now, float(v.z)) if self.hands == "flying" else 0.0
        throttle = {"down": 0.0, "flying": lift}.get(self.hands, 0.5)
        sticks = [1500.0 + 500.0 * _within(roll, 1.0), 1500.0 + 500.0 * _within(pitch, 1.0), 1000.0 + 1000.0 * throttle]
        pulses = [*(round(stick) for stick in sticks), 1500, 1800, 1500, 1500, 1900 if self.interlock else 1100]
        self.send(_PULSES.pack(*pulses, *(0,) * 8))

    def _lean(self, now: Seen, north_speed: float, east_speed: float) -> tuple[float, float]:
        """Roll and pitch sticks (-1 to 1; nose up is positive) that bring it back."""
        place, speed = self.keep
        north = place * (self.place[0] - now.north) - speed * north_speed
        east = place * (self.place[1] - now.east) - speed * east_speed
        c, s = math.cos(now.yaw), math.sin(now.yaw)
        ahead, right = _within(c * north + s * east, _MOST_LEAN), _within(c * east - s * north, _MOST_LEAN)
        return right / self.lean_max, -ahead / self.lean_max

    def _collective(self, now: Seen, sink: float) -> float:
        climb = min(_UP, max(_SINK, _CLIMB * (self.height + now.down)))
        miss, gain = climb + sink, _HEAVE_BANDWIDTH / abs(self.heave)
        self._lift = min(0.9, max(0.0, self._lift + _HEAVE_INTEGRAL * gain * miss * PERIOD))
        return min(1.0, max(0.0, self._lift + gain * miss))


def _within(value: float, most: float) -> float:
    return min(most, max(-most, value))
