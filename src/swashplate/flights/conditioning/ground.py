"""The flying part of a flight: without the wait on the ground, a crash and what led to it, or a hand that holds it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.derive import GRAVITY, derive
from swashplate.flights.conditioning.filters import lowpass
from swashplate.flights.conditioning.resample import resample
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION, QUATERNION, RATES

Mask = NDArray[np.bool_]
_MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class GroundRule:
    """What counts as not flying.

    Attributes:
        crash_tilt: tilt from upright beyond which the flight is lost [rad].
        crash_acceleration: acceleration against the local axes beyond which something was hit [m/s^2].
        envelope: robust standard deviations of the body rates beyond which control is being lost before a crash.
        calm: how long the rates must have been inside the envelope [s].
        margin: cut before the onset [s].
        rest_speed, rest_rate: slower than this is at rest [m/s], [rad/s].
        idle: motors below this part of what they do while they run do not carry the aircraft.
        clear: so high above where it stood the skids are free and most of the ground effect is gone [m].
        climb: how long it takes to get there at most [s]; a flight that stays lower is kept.
        hold_force: mean in-plane specific force [m/s^2], against the record's median, that no hovering rotor gives.
        hold_time: over how long it is averaged [s].
        hold_speed: above this speed drag may give it [m/s].
    """

    crash_tilt: float = np.pi / 4
    crash_acceleration: float = 2.0 * GRAVITY
    envelope: float = 4.0
    calm: float = 0.5
    margin: float = 0.1
    rest_speed: float = 0.03
    rest_rate: float = 0.1
    idle: float = 0.7
    clear: float = 0.3
    climb: float = 5.0
    hold_force: float = 0.4
    hold_time: float = 2.0
    hold_speed: float = 0.3


@dataclass(frozen=True)
class FlyingInterval:
    """The flying part [s] and, in words, why it starts and ends there."""

    start: float
    stop: float
    reasons: tuple[str, ...] = ()


def _runs(mask: Mask) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _crash(time: Array, rates: Array, lost: Mask, rule: GroundRule) -> int:
    """Index of the last sample before control is lost, given where it is lost for certain."""
    event = int(np.argmax(lost))
    before = rates[: max(event, 1)]
    sigma = _MAD_TO_SIGMA * np.median(np.abs(before - np.median(before, axis=0)), axis=0)
    wild = np.any(
        np.abs(before - np.median(before, axis=0)) > rule.envelope * np.maximum(sigma, rule.rest_rate), axis=1
    )
    # Walk back from the event until the rates have been calm for `calm` seconds.
    onset = event
    for k in np.flatnonzero(wild)[::-1]:
        if time[onset] - time[k] > rule.calm:
            break
        onset = int(k)
    return int(np.searchsorted(time, time[onset] - rule.margin))


def _carried(
    motors: Array, rest: Mask, height: Array, time: Array, rule: GroundRule, wait: int
) -> tuple[int, int, list[str]]:
    """First and last sample of the longest stretch off the ground, and what bounds it in words.

    Motors that idle for `wait` samples carry nothing, and an aircraft that still rests, or has hardly risen, when they
    speed up stands on the ground. In the air it may be at rest and hover just above it.
    """
    grounded = np.zeros(motors.size, dtype=np.bool_)
    idle = motors < rule.idle * np.percentile(motors, 90.0)
    for start, stop in _runs(idle):
        if stop - start > wait:
            grounded[start:stop] = True
    for start, stop in _runs(rest | grounded):
        grounded[start:stop] |= grounded[start:stop].any()
    airborne = _runs(~grounded)
    if not airborne:
        return 0, motors.size - 1, []
    first, last = max(airborne, key=lambda run: run[1] - run[0])
    last -= 1
    reasons = []
    high = np.arange(first, last + 1)
    if first > 0:
        risen = high[(height[high] > height[first - 1] + rule.clear) & (time[high] < time[first] + rule.climb)]
        first = int(risen[0]) if risen.size else first
        reasons.append(f"on the ground until {time[first]:.2f} s: motors idle, then at rest or just above it")
    if last < motors.size - 1:
        risen = high[(height[high] > height[last + 1] + rule.clear) & (time[high] > time[last] - rule.climb)]
        last = max(first, int(risen[-1])) if risen.size else last
        reasons.append(f"on the ground from {time[last]:.2f} s: at rest or just above it, then motors idle")
    return first, last, reasons


def flying_interval(flight: Flight, *, rule: GroundRule | None = None) -> FlyingInterval:
    """Where the aircraft flies freely under control.

    * Ground: motors well below those that carry it, and before and after that at rest or hardly above where it stood;
      of several flights in one record the longest.
    * Crash: tilt or acceleration beyond any flight; the end is set where the rates leave their own envelope before it.
    * Held (by hand, stand or tether) at the end: a thrust that is tilted accelerates the aircraft; where attitude is
      tilted for seconds and nothing accelerates, the specific force in the body's plane shows that something else
      carries it. In free hover its mean is close to zero.

    Args:
        flight: position and attitude, and motors where known, outliers removed.
        rule: thresholds.
    """
    rule = rule or GroundRule()
    all_of_it = FlyingInterval(flight.start, flight.stop)
    if not all(name in flight for name in POSITION) or not (
        all(name in flight for name in QUATERNION) or all(name in flight for name in ATTITUDE)
    ):
        return replace(all_of_it, reasons=("no position and attitude: ground and crash cannot be told, all is kept",))
    # Gaps do not matter for looking at it: bridge them all. 5 Hz keeps the flight and drops the tracking noise.
    wanted = (*POSITION, *(QUATERNION if QUATERNION[0] in flight else ATTITUDE), "motor_lower", "motor_upper")
    bare = {n: d[[c for c in wanted if c in d.data_vars]] for n, d in flight.streams.items()}
    bare = {n: d for n, d in bare.items() if len(d.data_vars)}
    try:
        uniform = resample(replace(flight, streams=bare, segments=()), rate=50.0, max_gap=np.inf, shortest_piece=0.0)
        motion = derive(lowpass(uniform, cutoff=5.0))
    except FlightError as error:
        return replace(all_of_it, reasons=(f"too short to judge, all is kept: {error.problem}",))
    time, rate = motion.time("u"), 50.0
    rates = motion.array(RATES)
    force = motion.array(("ax", "ay", "az"))
    speed = np.linalg.norm(motion.array(("u", "v", "w")), axis=1)
    tilt = np.arccos(np.clip(np.cos(motion.values("phi")) * np.cos(motion.values("theta")), -1.0, 1.0))
    acceleration = np.abs(np.linalg.norm(force, axis=1) - (motion.gravity or GRAVITY))
    first, last = 0, time.size - 1
    reasons: list[str] = []

    motors = [motion.values(name) for name in ("motor_lower", "motor_upper") if name in motion]
    if motors:
        rest = (speed < rule.rest_speed) & np.all(np.abs(rates) < rule.rest_rate, axis=1)
        first, last, reasons = _carried(
            np.mean(motors, axis=0), rest, -motion.values("z"), time, rule, wait=round(rule.calm * rate)
        )

    lost = (tilt > rule.crash_tilt) | (acceleration > rule.crash_acceleration)
    if lost[first : last + 1].any():
        event = first + int(np.argmax(lost[first : last + 1]))
        last = first + _crash(time[first : last + 1], rates[first : last + 1], lost[first : last + 1], rule)
        reasons = [text for text in reasons if not text.startswith("on the ground from")]
        reasons.append(
            f"crash: tilt {np.degrees(tilt[event]):.0f} deg, {acceleration[event]:.0f} m/s^2 beyond gravity at "
            f"{time[event]:.2f} s; rates leave their envelope after {time[last]:.2f} s"
        )

    plane = force[first : last + 1, :2]
    width = round(rule.hold_time * rate)
    if plane.shape[0] > 4 * width:
        mean = uniform_filter1d(plane - np.median(plane, axis=0), width, axis=0, mode="nearest")
        pulled = np.linalg.norm(mean, axis=1)
        slow = uniform_filter1d(speed[first : last + 1], width, mode="nearest") < rule.hold_speed
        for start, stop in _runs((pulled > rule.hold_force) & slow):
            # Only at the end and for longer than one averaging window: a gust or a lever arm does not last.
            if stop == plane.shape[0] and stop - start > width:
                last = max(first, first + start - round(rule.margin * rate))
                mid = slice(start, stop)
                reasons.append(
                    f"held from {time[last]:.2f} s: mean in-plane specific force ({np.mean(plane[mid, 0]):.2f}, "
                    f"{np.mean(plane[mid, 1]):.2f}) m/s^2 at {np.mean(speed[first:][mid]):.2f} m/s; free hover has "
                    f"({np.median(plane[:start, 0]):.2f}, {np.median(plane[:start, 1]):.2f})"
                )
    at_start = flight.start if first == 0 else float(time[first])
    at_stop = flight.stop if last == time.size - 1 else float(time[last])
    return FlyingInterval(at_start, at_stop, tuple(reasons) or ("flying throughout",))


def cut(flight: Flight, start: float, stop: float, *, reasons: tuple[str, ...] | list[str] = ()) -> Flight:
    """The part from `start` to `stop` [s] with the reasons in its history (one step, as `trim_ground` writes it)."""
    if not stop > start:
        raise FlightError(
            f"nothing of the flight is free flight ({'; '.join(reasons)}).",
            where=flight.provenance.source or None,
            hint="Look at the record; keep it all with trim_ground=False.",
        )
    details: dict[str, Any] = {
        "start": start,
        "stop": stop,
        "removed_seconds": round(flight.duration - (stop - start), 3),
        "reasons": list(reasons),
    }
    return replace(flight.between(start, stop), history=flight.history).done("trim_ground", **details)


def trim_ground(flight: Flight, *, rule: GroundRule | None = None) -> Flight:
    """Only the flying interval; the history tells where it is and why."""
    flying = flying_interval(flight, rule=rule)
    return cut(flight, flying.start, flying.stop, reasons=flying.reasons)
