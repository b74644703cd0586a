"""A pilot of a multirotor in ANGLE mode: arms, takes off, keeps a place and a height, sweeps a stick, lands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from swashplate.links.betaflight.configuration import ANGLE_LIMIT
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.stepping import Motion

_PERIOD = 0.01
"""s between two looks."""
_PLACE, _SPEED, _LEAN = 0.08, 0.14, 0.3
"""Lean [rad] per m and per m/s, and the most."""
_CLIMB, _FAST, _BAND, _INTEGRAL = 1.0, 0.7, 2.0, 0.8
"""1/s and m/s of the climb; rad/s of the climb loop, and 1/s of its integral beside it."""
_TURN = 0.1
"""Of a full stick per rad of heading. More of the stick turns the nose left: the default bridge of the SITL hands the
gyro's yaw over with the body's sign, and Betaflight counts its own the other way."""
_LOW, _CENTRE, _HIGH = 1000.0, 1500.0, 2000.0

_ARMS, _LIFTS = 8.0, 10.0
"""s: when a pilot by himself arms, behind the firmware's time of grace, and takes off."""

Phase = Literal["off", "armed", "flying"]
"""Throttle down and disarmed; armed on the ground; in the air, sticks flown."""


class Look(NamedTuple):
    """Time [s], place north, east, down from the start [m], roll, pitch, yaw [rad]."""

    time: float
    north: float
    east: float
    down: float
    roll: float
    pitch: float
    yaw: float


@dataclass
class AnglePilot:
    """Who holds the sticks.

    Attributes:
        lift: acceleration per unit of the throttle stick (0 to 1) [m/s^2]. hover_stick: about where it hovers.
        depth: of the ground below the origin of the motion [m].
        phase: what is done. height: to keep [m].
        sweep: added to the roll, pitch or yaw stick (0 to 2), a function of time since it began; None for none.
        looks: every look. sent: time [s] and roll, pitch and yaw sticks (-1 to 1) of each.
    """

    lift: float
    hover_stick: float
    depth: float = 0.0
    phase: Phase = "off"
    height: float = 1.0
    sweep: tuple[int, Callable[[float], float]] | None = None
    looks: list[Look] = field(default_factory=list)
    sent: list[tuple[float, float, float, float]] = field(default_factory=list)
    _since: float = 0.0
    _due: float = -1.0
    _sum: float = 0.0
    _place: tuple[float, float] = (0.0, 0.0)
    _sticks: list[float] | None = None

    def take_off(self, height: float) -> None:
        """Take the sticks where it stands."""
        self._place, self.height = (self.looks[-1].north, self.looks[-1].east) if self.looks else (0.0, 0.0), height
        self._sum, self.phase = 0.7 * self.hover_stick, "flying"

    def begin_sweep(self, axis: int, signal: Callable[[float], float]) -> None:
        """Add a signal to a stick from now on."""
        self.sweep, self._since = (axis, signal), self.looks[-1].time

    def __call__(self, time: float, motion: Motion) -> list[float]:
        """Sticks and switches [us]: roll, pitch, throttle, yaw, arm, angle."""
        if self._sticks is not None and time < self._due - 1e-9:
            return self._sticks
        self._due = time + _PERIOD
        body = motion.body
        now = Look(time, *map(float, (body.x, body.y, body.z + self.depth, body.phi, body.theta, body.psi)))
        self.looks.append(now)
        roll = pitch = yaw = throttle = 0.0
        if self.phase == "flying":
            v = motion.velocity
            roll, pitch = self._lean(now, float(v.x), float(v.y))
            yaw = max(-1.0, min(1.0, _TURN * math.remainder(now.yaw, 2.0 * math.pi)))
            throttle = self._throttle(now, float(v.z))
            if self.sweep is not None:
                axis, signal = self.sweep
                added = [0.0, 0.0, 0.0]
                added[axis] = signal(time - self._since)
                roll, pitch, yaw = roll + added[0], pitch + added[1], yaw + added[2]
        armed = _LOW if self.phase == "off" else _HIGH
        roll, pitch, yaw = (max(-1.0, min(1.0, each)) for each in (roll, pitch, yaw))
        self.sent.append((time, roll, pitch, yaw))
        sticks = [_CENTRE + 500.0 * each for each in (roll, pitch, yaw)]
        self._sticks = [*sticks[:2], _LOW + 1000.0 * throttle, sticks[2], armed, _HIGH]
        return self._sticks

    def _lean(self, now: Look, north_speed: float, east_speed: float) -> tuple[float, float]:
        """Roll and pitch sticks (-1 to 1; nose down is positive) that bring it back."""
        north = _PLACE * (self._place[0] - now.north) - _SPEED * north_speed
        east = _PLACE * (self._place[1] - now.east) - _SPEED * east_speed
        c, s, full = math.cos(now.yaw), math.sin(now.yaw), math.radians(ANGLE_LIMIT)
        ahead, right = (max(-_LEAN, min(_LEAN, each)) for each in (c * north + s * east, c * east - s * north))
        return right / full, ahead / full

    def _throttle(self, now: Look, sink: float) -> float:
        climb = max(-_FAST, min(_FAST, _CLIMB * (self.height + now.down)))
        miss, gain = climb + sink, _BAND / abs(self.lift)
        self._sum = max(0.0, min(0.95, self._sum + _INTEGRAL * gain * miss * _PERIOD))
        return max(0.0, min(1.0, self._sum + gain * miss))


def pilot_for(model: LinearModel, depth: float) -> AnglePilot:
    """A pilot who knows a multirotor by its linear model, and how deep the ground is below its origin [m]."""
    omega, place = 3.0, model.states.index("w")
    answer = np.linalg.solve(1j * omega * np.eye(len(model.states)) - model.A, model.B @ np.ones(len(model.inputs)))
    return AnglePilot(float(abs(omega * answer[place])), float(np.mean(list(model.trim.commands().values()))), depth)


def hovering(pilot: AnglePilot, *, height: float = 1.5) -> Callable[[float, Motion], list[float]]:
    """The same as who arms by himself, takes off and stays at a height [m]."""

    def sticks(time: float, motion: Motion) -> list[float]:
        if pilot.phase == "off" and time > _ARMS:
            pilot.phase = "armed"
        elif pilot.phase == "armed" and time > _LIFTS:
            pilot.take_off(height)
        return pilot(time, motion)

    return sticks
