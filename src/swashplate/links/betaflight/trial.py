"""A trial flight under Betaflight's SITL: start, arm, hover in ANGLE mode, sweep the sticks, land; with verdicts."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from swashplate.arrays import Array
from swashplate.links.ardupilot.trial import TrialEndedError, TrialLine
from swashplate.links.betaflight.binary import BetaflightBinary
from swashplate.links.betaflight.gains import AXES
from swashplate.links.betaflight.pilot import AnglePilot
from swashplate.links.betaflight.session import BetaflightSession

_READY, _IDLE = 25.0, 1020.0
"""s of simulated time within which it must arm; us above which motors turn, and so are armed."""
_MEASURED, _OFF = 6.0, 0.2
"""s over which its clock is held against the physics' in lockstep, or else ours, and by how much it may be off."""
_STALLED = 15.0
"""s of wall clock without a motor packet."""
_STRAYS = 0.5
"""m from its place and its height that the hover may stray."""
_LARGEST = {"roll": 0.5, "pitch": 0.5, "yaw": 0.1}
"""Of a full stick."""
_EVEN = 6.0
"""Hz up to which leans are swept as widely; beyond as 1/f, for a quick loop asks its motors for more than they have."""


@dataclass(frozen=True)
class StickSweep:
    """A sweep of a stick: frequencies from low to high [Hz], evenly on a logarithmic scale, for so long [s]."""

    axis: str
    low: float
    high: float
    seconds: float

    def __call__(self, t: float) -> float:
        """The stick, -1 to 1, so long [s] after it began."""
        if not 0.0 < t < self.seconds:
            return 0.0
        ratio = self.high / self.low
        turns = self.low * self.seconds / math.log(ratio) * (ratio ** (t / self.seconds) - 1.0)
        fade = min(1.0, t, self.seconds - t)
        smaller = 1.0 if self.axis == "yaw" else min(1.0, _EVEN / (self.low * ratio ** (t / self.seconds)))
        return _LARGEST[self.axis] * smaller * fade * math.sin(2.0 * math.pi * turns)


@dataclass
class BetaflightTrial:
    """A flight in progress.

    Attributes:
        session: stepped by another thread. pilot: its sticks. binary: the firmware.
        height: of the hover [m]. hover: s of it. sweeps: that are flown.
        lines: what was found so far.
        armed: simulated time at which the motors began to turn [s].
        excited: sweeps that were flown to their end, and when they began [s].
    """

    session: BetaflightSession
    pilot: AnglePilot
    binary: BetaflightBinary
    height: float
    hover: float
    sweeps: tuple[StickSweep, ...]
    lines: list[TrialLine] = field(default_factory=list)
    armed: float = math.nan
    excited: dict[str, tuple[StickSweep, float]] = field(default_factory=dict)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.session.plant.time

    def wait(self, done: Callable[[], bool], *, longest: float) -> bool:
        """Until `done`, or so many simulated seconds have passed; whether it was done.

        Raises:
            TrialEndedError: where the binary ends or falls silent, or the vehicle breaks.
        """
        begun, heard, when = self.time, self.session.exchanged.motors, time.monotonic()
        while not done():
            if ending := self.binary.ended():
                raise TrialEndedError(ending)
            if self.session.plant.broken:
                raise TrialEndedError(f"the vehicle broke at {self.time:.1f} s: {self.session.plant.broken}.")
            if self.time - begun > longest:
                return False
            if self.session.exchanged.motors != heard:
                heard, when = self.session.exchanged.motors, time.monotonic()
            elif time.monotonic() - when > _STALLED:
                raise TrialEndedError(
                    f"no motor packet came for {_STALLED:g} s; its last words: {self.binary.last_words() or 'none'}."
                )
            time.sleep(0.02)
        return True

    def pause(self, seconds: float) -> None:
        """Let simulated time pass."""
        until = self.time + seconds
        self.wait(lambda: self.time >= until, longest=2.0 * seconds + 1.0)

    def _tell(self, what: str, result: str, expected: str, passed: bool) -> None:
        self.lines.append(TrialLine(what, result, expected, passed))

    def fly(self, say: Callable[[str], None]) -> None:
        """All of it; `say` is told every step.

        Raises:
            TrialEndedError: where it cannot go on; `lines` say how far it came.
        """
        say("waiting for its clock and its motors")
        self.meet_its_clock()
        say("arming")
        self.arm()
        say("hovering in ANGLE mode")
        self.take_off()
        for sweep in self.sweeps:
            say(f"sweeping {sweep.axis}")
            self.fly_sweep(sweep)
        say("landing")
        self.land()

    def meet_its_clock(self) -> None:
        """Hold the pace of its clock against the physics' in lockstep, or else against ours, and take it over."""
        in_step = self.session.in_lockstep
        asked, unit = (1.0, "s of the physics'") if in_step else (self.session.pace, "s a second")
        self.wait(lambda: self.session.exchanged.motors > 0, longest=_READY)
        first = self._tick()
        self.wait(lambda: self._now() > first[0] + _MEASURED, longest=math.inf)
        last = self._tick()
        pace = (last[1] - first[1]) / max(1e-9, last[0] - first[0])
        right = abs(pace / asked - 1.0) < _OFF
        self._tell("its clock", f"{pace:.3f} {unit}", f"{asked:g} within {100.0 * _OFF:g} %", right)
        if not right:
            raise TrialEndedError(f"its clock runs at {pace:.3g} {unit}, asked were {asked:g}.")
        if not in_step:
            self.session.pace = pace

    def _now(self) -> float:
        return self.time if self.session.in_lockstep else time.monotonic()

    def _tick(self) -> tuple[float, float]:
        """When it next tells the time of its clock, and that [s]."""
        before = self.binary.clock
        self.wait(lambda: self.binary.clock != before, longest=_READY)
        return self._now(), self.binary.clock

    def arm(self) -> None:
        """Throttle down, the switch up as soon as nothing but its time of grace is in the way, or it says no more.

        It tells why it refuses, and not that it no longer does.
        """
        begun, grace = self.time, lambda: self.binary.refusals() in ("", "BOOTGRACE")
        self.wait(grace, longest=0.4 * _READY)
        self.pause(3.0)
        self.pilot.phase = "armed"
        turning = self.wait(lambda: min(self.session.pulses) > _IDLE, longest=3.0)
        for _ in range(3):
            if turning or self.time - begun > _READY:
                break
            self.pilot.phase = "off"  # a switch that was up too early has to come down
            self.pause(1.5)
            self.pilot.phase = "armed"
            turning = self.wait(lambda: min(self.session.pulses) > _IDLE, longest=2.0)
        if not turning:
            why = self.binary.refusals() or "it does not say why"
            self._tell("armed", f"not within {_READY:g} s: {why}", "motors turn", False)
            raise TrialEndedError(f"it does not arm: {why}.")
        self.armed = self.time
        took = self.time - begun
        self._tell("armed", f"after {took:.1f} s", f"within {_READY:g} s", took <= _READY)
        self.pause(1.0)

    def take_off(self) -> None:
        """Up to the height, and a while there."""
        self.pilot.take_off(self.height)

        def there() -> bool:
            now = self.pilot.looks[-1]
            return abs(now.down + self.height) < 0.2

        reached = self.wait(there, longest=30.0)
        self._tell("lift-off", f"{-self.pilot.looks[-1].down:.2f} m", f"{self.height:g} m", reached)
        if not reached:
            raise TrialEndedError("it does not lift off.")
        self.pause(4.0)
        first = len(self.pilot.looks)
        self.pause(self.hover)
        rows = np.array(self.pilot.looks[first:])
        place, height, lean = _strayed(rows)
        text = f"place {place:.2f} m, height {height:.2f} m, lean {math.degrees(lean):.1f} deg"
        self._tell("hover in ANGLE", text, f"place and height within {_STRAYS:g} m", max(place, height) <= _STRAYS)

    def fly_sweep(self, sweep: StickSweep) -> None:
        """One stick, from one end of the band to the other."""
        began = self.time
        self.pilot.begin_sweep(AXES.index(sweep.axis), sweep)
        self.pause(sweep.seconds + 0.5)
        self.pilot.sweep = None
        self.excited[sweep.axis] = sweep, began
        text = f"{sweep.seconds:g} s, {sweep.low:g} to {sweep.high:g} Hz"
        self._tell(f"sweep of {sweep.axis}", text, "flown to its end", True)
        self.pause(4.0)

    def land(self) -> None:
        """Down, and the switch off."""
        self.pilot.height = -0.3
        down = self.wait(lambda: abs(self.pilot.looks[-1].down) < 0.05, longest=20.0)
        self.pause(1.0)
        self.pilot.phase = "off"
        off = self.wait(lambda: max(self.session.pulses) < _IDLE, longest=3.0)
        now = self.pilot.looks[-1]
        lean = math.degrees(math.hypot(now.roll, now.pitch))
        text = f"{abs(now.down):.2f} m high, {lean:.1f} deg, {'disarmed' if off else 'still armed'}"
        self._tell("landing", text, "on the ground, upright, disarmed", down and off and lean < 10.0)
        self.pause(1.0)  # the log is closed


def _strayed(rows: Array) -> tuple[float, float, float]:
    """How far looks are at most from their middle in place, height [m] and lean [rad]."""
    _, north, east, down, roll, pitch, _ = rows.T
    middle = [0.5 * (float(x.max()) + float(x.min())) for x in (north, east, down)]
    place = np.hypot(north - middle[0], east - middle[1])
    lean = np.hypot(roll - roll.mean(), pitch - pitch.mean())
    return float(place.max()), float(np.abs(down - middle[2]).max()), float(lean.max())
