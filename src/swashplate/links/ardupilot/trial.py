"""A trial flight under a SITL binary: wait, arm, hover in three modes, sweep, land; every step told with a verdict.

Mode numbers: ArduCopter/mode.h. Texts of the sweeps: ArduCopter/mode_systemid.cpp.
"""

from __future__ import annotations

import math
import socket
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import LinkError
from swashplate.flights.maneuvers.ardupilot_chirp import START_DELAY, Chirp
from swashplate.links.ardupilot.session import ArduPilotSession
from swashplate.links.ardupilot.sitl import Sitl
from swashplate.links.ardupilot.trial_pilot import Hands, Seen, TrialPilot
from swashplate.links.mavlink.commanding import ACCEPTED, Commanding

STABILIZE, ALT_HOLD, LOITER, LAND, SYSTEM_ID = 0, 2, 5, 9, 25
_STALLED = 15.0
"""s of wall clock without a step of the physics after which nothing is waited for any more."""
_AGAIN = 1.0
"""s of wall clock after which a request is repeated."""
_ANSWERED = 3.0
"""s of wall clock within which a last question is answered."""
_REACHED, _CALM = 0.3, 0.3
"""m from the height, and m/s, where the climb is over."""


class TrialLine(NamedTuple):
    """What was looked at, what was found, what was expected, and whether it passed (None: told, not judged)."""

    what: str
    found: str
    expected: str = ""
    passed: bool | None = None


class TrialEndedError(LinkError):
    """The flight cannot go on; the message says why."""


@dataclass(frozen=True)
class TrialPlan:
    """What is flown.

    Attributes:
        sweeps: by axis.
        run_up: s from the interlock to full rotor speed; 0 for motors without an interlock.
        height: of the hover [m]. hover: s in each mode.
        ekf: s of simulated time that it may take until it can be armed.
        stabilize, alt_hold, loiter: m that the vehicle may be off place (none in ALT_HOLD) and height.
    """

    sweeps: dict[str, Chirp]
    run_up: float
    height: float = 5.0
    hover: float = 10.0
    ekf: float = 120.0
    stabilize: float = 2.0
    alt_hold: float = 0.5
    loiter: float = 0.5


@dataclass
class Trial:
    """A flight in progress.

    Attributes:
        session: the link; stepped by another thread. pilot: who holds the sticks there.
        autopilot: over MAVLink. sitl: the binary.
        plan: what is flown.
        lines: what was found so far.
        swept_axes: axes whose sweep was flown to its end.
    """

    session: ArduPilotSession
    pilot: TrialPilot
    autopilot: Commanding
    sitl: Sitl
    plan: TrialPlan
    lines: list[TrialLine] = field(default_factory=list)
    swept_axes: list[str] = field(default_factory=list)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.session.plant.time

    # ---- waiting -------------------------------------------------------------------------------------------------
    def wait(self, done: Callable[[], bool], *, longest: float) -> bool:
        """Until `done`, or so many simulated seconds have passed; whether it was done.

        Raises:
            TrialEndedError: where the binary ends or restarts, the vehicle breaks, or time stands still.
        """
        begun, last, advanced = self.time, -1.0, time.monotonic()
        while not done():
            self._check()
            if self.time - begun > longest:
                return False
            if self.time != last:
                last, advanced = self.time, time.monotonic()
            elif time.monotonic() - advanced > _STALLED:
                raise TrialEndedError(
                    f"the binary sent no servo packet for {_STALLED:g} s; its last words: "
                    f"{self.sitl.last_words() or 'none'}."
                )
            try:
                self.autopilot.hear(0.02)
            except LinkError as error:
                raise TrialEndedError(self.sitl.ended(patience=2.0) or str(error)) from None
        return True

    def pause(self, seconds: float) -> None:
        """Let simulated time pass."""
        until = self.time + seconds
        self.wait(lambda: self.time >= until, longest=2.0 * seconds + 1.0)

    def _check(self) -> None:
        if ending := self.sitl.ended():
            raise TrialEndedError(ending)
        if self.session.progress.restarts or self.autopilot.health.restarted:
            raise TrialEndedError(f"the autopilot restarted by itself; its last words: {self.sitl.last_words()}.")
        if self.session.plant.broken:
            raise TrialEndedError(f"the vehicle broke at {self.time:.1f} s: {self.session.plant.broken}.")

    def _asked(self, ask: Callable[[], None], done: Callable[[], bool], *, longest: float) -> bool:
        """Ask again and again until it is done."""
        asked = [-math.inf]

        def again() -> bool:
            if done():
                return True
            if time.monotonic() - asked[0] >= _AGAIN:
                asked[0] = time.monotonic()
                ask()
            return False

        return self.wait(again, longest=longest)

    def _tell(self, what: str, result: str, expected: str, passed: bool) -> bool:
        self.lines.append(TrialLine(what, result, expected, passed))
        return passed

    def _end(self, what: str, result: str, expected: str) -> None:
        self._tell(what, result, expected, False)
        raise TrialEndedError(f"{what}: {result}.")

    # ---- the flight ----------------------------------------------------------------------------------------------
    def fly(self, say: Callable[[str], None]) -> None:
        """All of it; `say` is told every step.

        Raises:
            TrialEndedError: where it cannot go on; `lines` say how far it came.
        """
        say("waiting for the EKF")
        self.wait_for_ekf()
        say("arming, run-up and lift-off")
        self.arm()
        self.take_off()
        modes: tuple[tuple[str, int, Hands, float], ...] = (
            ("STABILIZE", STABILIZE, "flying", self.plan.stabilize),
            ("ALT_HOLD", ALT_HOLD, "height let go", self.plan.alt_hold),
            ("LOITER", LOITER, "centred", self.plan.loiter),
        )
        for name, mode, hands, limit in modes:
            say(f"hovering in {name}")
            self.hover(name, mode, hands, limit)
        for axis, chirp in self.plan.sweeps.items():
            say(f"sweeping {axis}")
            self.sweep(axis, chirp)
        say("landing")
        self.land()

    def wait_for_ekf(self) -> None:
        """Until its EKF has a place, without which LOITER is refused, and its own checks let it be armed."""
        health, last = self.autopilot.health, list[str]()

        def ask() -> None:
            last[:] = health.refusals or last
            health.refusals.clear()
            self.autopilot.ask_readiness(interval=0.5)

        ready = self._asked(ask, lambda: health.ready is True and health.placed is True, longest=self.plan.ekf)
        if not ready:
            if not (health.refusals or last):  # simulated seconds can be over before a first answer is heard
                ask()
                until = time.monotonic() + _ANSWERED
                self.wait(lambda: bool(health.refusals) or time.monotonic() > until, longest=math.inf)
            why = "; ".join(health.refusals or last) or ", ".join(health.sick) or "it does not say why"
            why = "its EKF has no place" if health.ready else why
            self._end("ready to be armed", f"not within {self.plan.ekf:g} s: {why}", f"within {self.plan.ekf:g} s")
        self._tell("ready to be armed", f"after {self.time:.0f} s", f"within {self.plan.ekf:g} s", True)

    def arm(self) -> None:
        """In STABILIZE, collective down, interlock off."""
        self.set_mode("STABILIZE", STABILIZE)
        health = self.autopilot.health
        health.refusals.clear()
        armed = self._asked(self.autopilot.ask_arming, lambda: self.autopilot.arming_answer == ACCEPTED, longest=20.0)
        if not armed:
            why = "; ".join(dict.fromkeys(health.refusals)) or "it does not say why"
            self._end("armed", f"refused: {why}", "armed")
        self.pilot.interlock = True
        self._tell("armed", "yes", "armed", self.wait(lambda: health.armed, longest=5.0))

    def set_mode(self, name: str, mode: int) -> None:
        """Change the mode, or end."""
        said = len(self.autopilot.health.texts)
        if not self._asked(lambda: self.autopilot.ask_mode(mode), lambda: self.autopilot.mode == mode, longest=15.0):
            reason = "; ".join(dict.fromkeys(self.autopilot.health.texts[said:])) or "it does not say why"
            self._end(f"mode {name}", f"refused: {reason}", "entered")

    def take_off(self) -> None:
        """Run-up, then up to the height."""
        if self.plan.run_up:
            self.pause(self.plan.run_up)
        self.pilot.height = self.plan.height
        self.pilot.take_off()

        def there() -> bool:
            if not self.autopilot.health.armed:
                self._end("lift-off", "it disarmed itself", "in the air")
            now = self.pilot.looks[-1]
            return abs(now.down + self.plan.height) < _REACHED and self.speed_of_climb() < _CALM

        if not self.wait(there, longest=60.0):
            now = self.pilot.looks[-1]
            self._end("lift-off", f"{-now.down:.1f} m high after 60 s", f"{self.plan.height:g} m")
        self._tell("lift-off", f"{-self.pilot.looks[-1].down:.1f} m", f"{self.plan.height:g} m", True)

    def speed_of_climb(self) -> float:
        """Of the last half second [m/s]."""
        last, before = self.pilot.looks[-1], self.pilot.looks[-25 if len(self.pilot.looks) > 25 else 0]
        return abs(last.down - before.down) / max(0.02, last.time - before.time)

    def hover(self, name: str, mode: int, hands: Hands, limit: float) -> None:
        """A while in a mode, and how far it strays: from the place (where it is kept) and in height."""
        self.set_mode(name, mode)
        self.pilot.hands = hands
        self.pause(min(5.0, self.plan.hover))
        first = len(self.pilot.looks)
        self.pause(self.plan.hover)
        rows = np.array(self.pilot.looks[first:])
        place, height, lean = strayed(rows)
        held = height if hands == "height let go" else max(place, height)
        motion = f"place {place:.2f} m, height {height:.2f} m, lean {math.degrees(lean):.1f} deg"
        what = "height" if hands == "height let go" else "place and height"
        if not self._tell(f"hover in {name}", motion, f"{what} within {limit:g} m", held <= limit) and held > 10.0:
            raise TrialEndedError(f"hover in {name}: {motion}.")

    def sweep(self, axis: str, chirp: Chirp) -> None:
        """From STABILIZE into System ID and back."""
        self.pilot.hands, self.pilot.place = "flying", (self.pilot.looks[-1].north, self.pilot.looks[-1].east)
        self.set_mode("STABILIZE", STABILIZE)
        self.pause(4.0)
        for name, value in chirp.parameters().items():
            ask, done = partial(self.autopilot.set_value, name, value), partial(self._has, name, value)
            if not self._asked(ask, done, longest=15.0):
                self._end(f"sweep of {axis}", f"{name} cannot be set to {value:g}", "set")
        said = len(self.autopilot.health.texts)
        self.set_mode("SYSTEMID", SYSTEM_ID)
        until = self.time + START_DELAY + chirp.record + 0.5

        def bad() -> list[str]:
            texts = self.autopilot.health.texts[said:]
            return [text for text in texts if text.startswith(("SystemID Stopped", "SystemID Parameter Error"))]

        self.wait(lambda: self.time >= until or bool(bad()), longest=chirp.record + 10.0)
        if bad() and self.time < until:
            self._tell(f"sweep of {axis}", bad()[0], "flown to its end", False)
        else:
            self.swept_axes.append(axis)
            self._tell(
                f"sweep of {axis}",
                f"{chirp.record:g} s, {chirp.start_hz:g} to {chirp.stop_hz:g} Hz",
                "flown to its end",
                True,
            )
        self.set_mode("STABILIZE", STABILIZE)
        self.pause(2.0)

    def _has(self, name: str, value: float) -> bool:
        """Whether the autopilot has said that a parameter is so."""
        return math.isclose(self.autopilot.values.get(name, math.nan), value, rel_tol=1e-5)

    def land(self) -> None:
        """In LAND, until it disarms itself."""
        self.set_mode("LAND", LAND)
        self.pilot.hands = "down"
        health = self.autopilot.health
        down = self.wait(lambda: not health.armed, longest=90.0)
        self.pilot.interlock = False
        if down:
            self.pause(2.0)
        now = self.pilot.looks[-1]
        lean = math.degrees(math.hypot(now.roll, now.pitch))
        landed = f"{abs(now.down):.2f} m high, {lean:.1f} deg, {'disarmed' if down else 'still armed'}"
        self._tell("landing", landed, "on the ground, upright, disarmed", down and abs(now.down) < 0.1 and lean < 10.0)


def strayed(rows: Array) -> tuple[float, float, float]:
    """How far looks (rows of `Seen`) are at most from their middle in place and height [m], and the lean [rad]."""
    looks = Seen(*rows.T)
    centre = [0.5 * (float(np.max(x)) + float(np.min(x))) for x in (looks.north, looks.east, looks.down)]
    place = np.hypot(looks.north - centre[0], looks.east - centre[1])
    lean = np.hypot(looks.roll - np.mean(looks.roll), looks.pitch - np.mean(looks.pitch))
    return float(place.max()), float(np.abs(looks.down - centre[2]).max()), float(lean.max())


class Piloted:
    """A session whose pilot looks after every answer; what `serve` steps.

    Args:
        session: the link. pilot: looks, and moves the sticks.
    """

    def __init__(self, session: ArduPilotSession, pilot: TrialPilot) -> None:
        self._session, self._pilot = session, pilot

    def handle(self, data: bytes, sender: tuple[str, int], now: float) -> bytes | None:
        """The session's answer; the sticks are moved before it is sent."""
        answer = self._session.handle(data, sender, now)
        if answer is not None:
            self._look()
        return answer

    def carry_on(self, bound: socket.socket) -> tuple[tuple[bytes, tuple[str, int]] | None, bool]:
        """The session's, until the pilot is due."""
        left, more = self._session.carry_on(bound, self._pilot.due)
        if more:
            self._look()
        return left, more

    def _look(self) -> None:
        plant = self._session.plant
        self._pilot.look(plant.time, plant.motion, plant.rotor_speeds(plant.motion)[0])


class Background:
    """Work in a thread of its own, as a context: asked to end, then joined.

    Args:
        work: is given what says whether to go on.
    """

    def __init__(self, work: Callable[[Callable[[], bool]], None]) -> None:
        self._over = threading.Event()
        self._failed: list[BaseException] = []
        self._work = work
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        try:
            self._work(lambda: not self._over.is_set())
        except BaseException as error:
            self._failed.append(error)

    def __enter__(self) -> Background:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    @property
    def failed(self) -> Sequence[BaseException]:
        """What ended it before it was asked to."""
        return self._failed
