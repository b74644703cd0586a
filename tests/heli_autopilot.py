"""A stand-in for ArduPilot's helicopter firmware on its SITL link, written from its documents: packets, reader, loops.

It reads answers as `SIM_JSON.cpp` does (keys looked for from the front, no JSON parser), counts frames, repeats itself
while nobody answers, mixes for an H3-120 swashplate and truncates pulses to whole microseconds. Between gyro and servo
stand what `copter-heli.parm` puts there: a gyro filter and filters of target and error at 20 Hz, integrals of roll and
pitch that leak down to ILMI, a cyclic cut at H_CYC_MAX, and a rotor speed output that ramps. Tail and rotor speed leave
one loop later than the swashplate (`rc_write_angle`), and the rates of the log are means of the last loop.
"""

from __future__ import annotations

import json
import math
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from made_autopilot_logs import Row, dataflash
from swashplate.flights.maneuvers.ardupilot_chirp import START_DELAY, Chirp

MAGIC_16, MAGIC_32 = 18458, 29569
Send = Callable[[bytes], bytes | None]


def servo_packet(rate: int, count: int, pulses: list[int], *, outputs: int = 16) -> bytes:
    filled = (pulses + [0] * outputs)[:outputs]
    magic = MAGIC_16 if outputs == 16 else MAGIC_32
    return struct.pack(f"<HHI{outputs}H", magic, rate, count, *filled)


def read_line(answer: bytes) -> dict[str, list[float]]:
    """What ArduPilot finds in an answer; a missing or badly written mandatory key is an assertion."""
    rows = answer.split(b"\n")
    assert (rows[0], rows[-1], len(rows)) == (b"", b"", 3), "a line break before and behind, and one line"
    text = rows[1].decode("ascii")
    found = {}
    for section, key in (
        ("", "timestamp"),
        ("imu", "gyro"),
        ("imu", "accel_body"),
        ("", "position"),
        ("", "attitude"),
        ("", "velocity"),
        ("", "rng_1"),
        ("", "airspeed"),
        ("windvane", "direction"),
        ("windvane", "speed"),
        ("", "velocity_wind"),
        ("rpm", "rpm_1"),
    ):
        start = text.index(section) + len(section) + 1 if section else 1
        at = text.index(key, start) + len(key) + 2
        number = r"-?\d+\.?\d*(?:[eE][-+]?\d+)?"
        vector = re.match(rf"\[({number}), ?({number}), ?({number})\]", text[at:])
        scalar = re.match(number, text[at:])
        assert vector or scalar, (key, text[at : at + 40])
        found[key] = [float(v) for v in vector.groups()] if vector else [float(scalar[0])]  # type: ignore[index]
    assert all(math.isfinite(v) for values in found.values() for v in values)
    return found


def _quickly(answer: bytes) -> dict[str, list[float]]:
    told = json.loads(answer)
    told.update(told.pop("imu"), **told.pop("windvane"), **told.pop("rpm"))
    return {key: value if isinstance(value, list) else [value] for key, value in told.items() if key != "battery"}


@dataclass
class Gains:
    """ArduPilot's parameters by what they do (ATC_ANG_*_P, ATC_RAT_*; `kept`: ILMI, `slope`: D behind FLTD)."""

    angle: tuple[float, float, float] = (4.5, 4.5, 4.5)
    forward: tuple[float, float, float] = (0.18, 0.18, 0.0)
    proportional: tuple[float, float, float] = (0.05, 0.05, 0.25)
    integral: tuple[float, float, float] = (0.1, 0.1, 0.3)
    kept: tuple[float, float] = (0.1, 0.1)
    slope: tuple[float, float, float] = (0.0, 0.0, 0.0)


FILTER = 20.0
"""Hz: INS_GYRO_FILTER, ATC_RAT_*_FLTT, and ATC_RAT_RLL_FLTE, _PIT_FLTE (yaw has none)."""
LEAK, IMAX = 0.02, (0.4, 0.4, 1.0)
"""The share of what is above ILMI that leaks from roll's and pitch's integrals each loop near hover, and the most."""
CYCLIC = 2500.0 / 4500.0
"""H_CYC_MAX: the most of roll and pitch together."""
SETPOINT, RAMP, RUN_UP = 0.66, 8.0, 15.0
"""H_RSC_SETPOINT as a share, H_RSC_RAMP_TIME and H_RSC_RUNUP_TIME [s]."""


EKF_WAIT = 40.0
"""s from the start until the firmware's EKF has aligned and found its place, before which it refuses to be armed."""
STILL, GPS_SPEED, GPS_CHECKED = 0.02, 0.3, 10.0
"""rad/s that gyros may read while they are calibrated; m/s that EK3_GPS_CHECK allows on the ground; s for which its
checks must hold without a break."""


@dataclass
class Ekf:
    """What stands between power-up and arming: gyro calibration, alignment, GPS checks.

    It is aligned once and stays so: a helicopter that has landed and rocks under a rotor that still turns is no fault.
    """

    begun: float = 0.0
    still_since: float | None = None
    calibrated: bool = False
    good_since: float | None = None
    aligned: bool = False

    def watch(self, state: dict[str, list[float]]) -> None:
        now = state["timestamp"][0]
        if self.aligned:
            return
        still = max(map(abs, state["gyro"])) < STILL
        self.still_since = (now if self.still_since is None else self.still_since) if still else None
        if self.still_since is not None and now - self.still_since >= 2.0:
            self.calibrated = True
        good = self.calibrated and max(map(abs, state["velocity"])) < GPS_SPEED
        self.good_since = (now if self.good_since is None else self.good_since) if good else None
        checked = self.good_since is not None and now - self.good_since >= GPS_CHECKED
        self.aligned = checked and now - self.begun >= EKF_WAIT

    @property
    def refusal(self) -> str:
        if not self.calibrated:
            return "Gyros still settling"
        return "" if self.aligned else "Need Position Estimate"


class LowPass:
    """First or second order (Butterworth), from its first sample on."""

    def __init__(self, order: int) -> None:
        self._order, self._states = order, None

    def __call__(self, x: np.ndarray, dt: float) -> np.ndarray:
        x = np.asarray(x, dtype=float)
        if self._states is None:
            self._states = [x] * (2 * self._order)
        if self._order == 1:
            share = dt / (dt + 1.0 / (2.0 * math.pi * FILTER))
            self._states[0] = self._states[0] + share * (x - self._states[0])
            return self._states[0]
        o = math.tan(math.pi * FILTER * dt)
        c = 1.0 + math.sqrt(2.0) * o + o * o
        b, a1, a2 = o * o / c, 2.0 * (o * o - 1.0) / c, (1.0 - math.sqrt(2.0) * o + o * o) / c
        x1, x2, y1, y2 = self._states
        y = b * (x + 2.0 * x1 + x2) - a1 * y1 - a2 * y2
        self._states = [x, x1, y, y1]
        return y


@dataclass
class HeliAutopilot:
    """Stabilize mode with a pilot who keeps the place, and a sweep at the mixer.

    Attributes:
        send: gives a packet to the physics and returns its answer.
        rate: frames per second [Hz] (SIM_RATE_HZ). every: the loops run in every so many of them.
        outputs: 16 or 32.
        sweep: (axis 0 roll to 3 collective, function of time since it began) added after the rate controllers.
        sticks: roll, pitch, yaw and collective that reach the servos while it does not fly.
        keep: lean per m and m/s. lifting: collective per m, and per m/s.
        log: rows of time, p, q, r (means of the last loop), mixer roll, pitch, yaw, collective, sweep, and p, q, r
            behind the gyro filter.
        scaled: outputs that are set as scaled values and leave with the next loop, from 0.
    """

    send: Send
    rate: int = 400
    every: int = 1
    outputs: int = 16
    gains: Gains = field(default_factory=Gains)
    armed: bool = False
    interlock: bool = False
    height: float = 0.0
    sticks: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    sweep: tuple[int, Callable[[float], float]] | None = None
    count: int = 0
    log: list[tuple[float, ...]] = field(default_factory=list)
    answers: list[dict[str, list[float]]] = field(default_factory=list)
    place: tuple[float, float] = (0.0, 0.0)
    collective: float = 0.0
    keep: tuple[float, float] = (0.04, 0.08)
    lifting: tuple[float, float] = (0.06, 0.08)
    scaled: tuple[int, ...] = (3, 7)
    ekf: Ekf = field(default_factory=Ekf)
    _sums: np.ndarray = field(default_factory=lambda: np.zeros(3))
    _lift: float = 0.0
    _pulses: list[int] = field(default_factory=lambda: [1460, 1460, 1460, 1500, 0, 0, 0, 1000])
    _since: float = 0.0
    _ramp: float = 0.0
    _filters: tuple[LowPass, ...] = field(default_factory=lambda: (LowPass(2), LowPass(1), LowPass(1)))
    _heading: float = 0.0
    _slope: LowPass = field(default_factory=lambda: LowPass(1))
    _missed: np.ndarray | None = None
    _turning: np.ndarray | None = None
    _waiting: dict[int, int] = field(default_factory=dict)

    def exchange(self) -> dict[str, list[float]]:
        """One frame: send, wait for the answer, control."""
        packet = servo_packet(self.rate, self.count, self._pulses, outputs=self.outputs)
        answer = self.send(packet)
        for _ in range(5):
            if answer is not None:
                break
            answer = self.send(packet)
        assert answer is not None, "the physics does not answer"
        self.count += 1
        # Every hundredth answer is read the slow way that ArduPilot reads them all.
        state = read_line(answer) if self.count % 100 == 1 else _quickly(answer)
        self.answers.append(state)
        self.ekf.watch(state)
        if self.count % self.every == 0:
            self._control(state)
        return state

    def fly(self, seconds: float) -> dict[str, list[float]]:
        for _ in range(round(seconds * self.rate)):
            state = self.exchange()
        return state

    def wait_for_ekf(self, longest: float = 2.0 * EKF_WAIT, *, seed: int = 0) -> dict[str, list[float]]:
        """Disarmed on the ground until the firmware may be armed, at 100 frames a second, the sticks stirred."""
        flown, random = self.rate, np.random.default_rng(seed)
        self.rate = 100
        for _ in range(round(2.0 * longest)):
            roll, pitch, yaw, collective = random.uniform((-1.0, -1.0, -1.0, 0.0), 1.0).tolist()
            self.sticks = (roll, pitch, yaw, collective)
            state = self.fly(0.5)
            moving = max(map(abs, state["gyro"] + state["velocity"]))
            assert moving < STILL or not self.ekf.calibrated, f"{moving:.3g} rad/s or m/s with the rotor at rest"
            if self.ekf.aligned:
                break
        self.rate, self.sticks = flown, (0.0, 0.0, 0.0, 0.0)
        assert self.ekf.aligned, f"the EKF does not settle in {longest:g} s: {self.ekf.refusal}"
        return state

    def arm(self) -> str:
        """Arm, or the firmware's reason why not."""
        if self.ekf.refusal:
            return self.ekf.refusal
        if self.interlock:
            return "Motor Interlock Enabled"
        if self.sticks[3] > 0.0:
            return "Throttle too high"
        self.armed = True
        return ""

    def begin_sweep(self, axis: int, signal: Callable[[float], float]) -> None:
        self.sweep, self._since = (axis, signal), self.answers[-1]["timestamp"][0]

    def dataflash(self, first: int, chirp: Chirp) -> bytes:
        """The log from row `first` on, as the firmware writes a flight in System ID mode that begins there.

        RATE has the filtered gyros that the loops use, SIDD those of the inertial sensor.
        """
        begun = self.log[first][0]
        sids = (chirp.axis, chirp.magnitude, chirp.start_hz, chirp.stop_hz, chirp.fade_in, chirp.dwell)
        rows: list[Row] = [
            ("MSG", (0, "ArduCopter V4.5.7 (stand-in)")),
            ("EV", (round(1e6 * begun) - 2, 10)),
            ("MODE", (round(1e6 * begun) - 1, 25, 25, 2)),
            ("SIDS", (round(1e6 * begun) - 1, *sids, chirp.record, chirp.fade_out)),
        ]
        for now, p, q, r, roll, pitch, yaw, collective, swept, *slow in self.log[first:]:
            at, (pf, qf, rf) = round(1e6 * now), np.degrees(slow)
            turned = np.degrees((p, q, r)).tolist()
            frequency = float(chirp.frequency(np.array([now - begun - START_DELAY]))[0])
            rows.append(("RATE", (at, 0.0, pf, roll, 0.0, qf, pitch, 0.0, rf, yaw, 0.0, 0.0, collective)))
            rows.append(("SIDD", (at, now - begun, swept, frequency, *turned, 0.0, 0.0, 0.0)))
        rows.append(("EV", (at + 1, 11)))
        return dataflash(rows)

    def _control(self, state: dict[str, list[float]]) -> None:
        now, attitude, dt = state["timestamp"][0], state["attitude"], self.every / self.rate
        gyros, targets, errors = self._filters
        measured = np.array(state["gyro"])
        gyro = gyros(measured, dt)
        running = self.armed and self.interlock
        self._ramp = min(1.0, self._ramp + dt / RAMP) if running else 0.0
        flying = self.armed and self.interlock and self.height > 0.0
        mixer, collective, swept = np.zeros(3), 0.0, 0.0
        if flying:
            wanted = self._lean(state)
            error = np.array([wanted[0] - attitude[0], wanted[1] - attitude[1], self._heading - attitude[2]])
            error[2] = math.remainder(error[2], 2.0 * math.pi)
            g = self.gains
            target = targets(np.clip(np.array(g.angle) * error, -1.5, 1.5), dt)
            miss = target - gyro
            miss[:2] = errors(miss[:2], dt)
            kept = np.clip(self._sums[:2], np.negative(g.kept), g.kept)
            self._sums[:2] += LEAK * (kept - self._sums[:2])
            self._sums = np.clip(self._sums + np.array(g.integral) * miss * dt, np.negative(IMAX), IMAX)
            slope = self._slope((miss - (miss if self._missed is None else self._missed)) / dt, dt)
            self._missed = miss
            mixer = np.array(g.forward) * target + np.array(g.proportional) * miss + self._sums
            mixer += np.array(g.slope) * slope
            collective = self._climb(state)
            if self.sweep is not None:
                axis, signal = self.sweep
                swept = signal(now - self._since)
                if axis < 3:
                    mixer[axis] += swept
                else:
                    collective += swept
        else:
            self._heading = attitude[2]
            self._sums[:] = 0.0
            mixer, collective = np.array(self.sticks[:3]), self.sticks[3]
        mixer = np.clip(mixer, -1.0, 1.0)
        mixer[:2] *= min(1.0, CYCLIC / max(1e-9, math.hypot(mixer[0], mixer[1])))
        self.collective = collective
        computed = self._mixed(mixer, collective)
        self._pulses = [self._waiting.get(output, pulse) for output, pulse in enumerate(computed)]
        self._waiting = {output: computed[output] for output in self.scaled}
        mean = measured if self._turning is None else 0.5 * (self._turning + measured)
        self._turning = measured
        self.log.append((now, *mean, *mixer, collective, swept, *gyro))

    def _lean(self, state: dict[str, list[float]]) -> tuple[float, float]:
        c, s = math.cos(state["attitude"][2]), math.sin(state["attitude"][2])
        place, speed = self.keep
        north = place * (self.place[0] - state["position"][0]) - speed * state["velocity"][0]
        east = place * (self.place[1] - state["position"][1]) - speed * state["velocity"][1]
        return float(np.clip(-s * north + c * east, -0.2, 0.2)), float(np.clip(-c * north - s * east, -0.2, 0.2))

    def _climb(self, state: dict[str, list[float]]) -> float:
        climb = float(np.clip(0.8 * (self.height + state["position"][2]), -0.5, 0.8))
        miss = climb + state["velocity"][2]
        integral, proportional = self.lifting
        self._lift = float(np.clip(self._lift + integral * miss * self.every / self.rate, 0.0, 0.8))
        return float(np.clip(self._lift + proportional * miss, 0.0, 1.0))

    def _mixed(self, mixer: np.ndarray, collective: float) -> list[int]:
        """H3-120 with H_COL_MIN 1460 and H_COL_MAX 1740; tail on 4, rotor speed on 8."""
        share = 0.46 + 0.28 * collective
        roll, pitch, yaw = mixer
        servos = [
            share + 0.45 * (math.cos(math.radians(at + 90)) * roll + math.cos(math.radians(at)) * pitch)
            for at in (-60.0, 60.0, 180.0)
        ]
        pulses = [int(1000 + 1000 * min(1.0, max(0.0, s))) for s in servos]
        return [*pulses, 1500 + int(500 * yaw), 0, 0, 0, int(1000 + 1000 * SETPOINT * self._ramp)]
