"""Roll of many aircraft at once: loops of all speeds, filters, delays and noises, in gusts, excited or not.

Each flight knows what moved its command: the loop is linear, so its part from outside is what a flight without gusts
and noise from the same seeds does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import butter, lfilter

from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Event, Provenance

RATE = 400.0
"""Hz: of the simulation."""
LOGGED = (10.0, 25.0, 50.0, 100.0, 200.0, 400.0)
SHAPES = ("sweep", "3-2-1-1", "doublets", "steps", "by hand", "multisine")
GRAVITY = 9.81


@dataclass(frozen=True)
class Case:
    """One flight; lengths in s, rad and 1.

    Attributes:
        seed: of gusts, noise and shapes. shape: of the excitation, "" for none. place: where it enters: "open" (no
            loop), "mixer", "rate" or "attitude" (set-points).
        size: of the excitation. plant: roll acceleration per command, damping, lag, delay. gust: its acceleration
            (rms, fading time) and that of the speed to the side (rms). gains: rate loop P, I, D, attitude loop, speed
            loop. every: steps of the simulation per step of the loop. corner: of the gyro's filter [Hz]. gyro: its
            noise. pilot: gain and delay of a hand that holds the attitude. log: Hz. autopilot: whether its set-points
            are logged. sensor: noise of a sensor of its own that the log has, over the motion, and how much of it is
            slow; None: the loop's own gyro is logged. speed: whether the speed to the side is logged.
    """

    seed: int
    shape: str = ""
    place: str = "open"
    size: float = 0.0
    plant: tuple[float, float, float, float] = (40.0, 3.0, 0.04, 0.02)
    gust: tuple[float, float, float] = (1.0, 0.5, 0.0)
    gains: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    every: int = 1
    corner: float = 40.0
    gyro: float = 1e-3
    pilot: tuple[float, float] = (0.0, 0.25)
    log: float = 100.0
    autopilot: bool = False
    sensor: tuple[float, float] | None = None
    speed: bool = False
    seconds: float = field(default=40.0)


def drawn(seed: int, *, answer: bool, autopilot: bool) -> Case:
    """A flight drawn at random: without excitation under a loop where `answer`, else excited, one of three openly."""
    random = np.random.default_rng([seed, 5])
    log_uniform = lambda low, high: float(np.exp(random.uniform(np.log(low), np.log(high))))  # noqa: E731
    power, damping, lag, late = (
        log_uniform(10, 150),
        log_uniform(0.3, 8),
        random.uniform(0.02, 0.08),
        random.uniform(0, 0.04),
    )
    case = Case(
        seed,
        plant=(power, damping, lag, late),
        gust=(log_uniform(0.2, 2.5), log_uniform(0.2, 2.0), 0.0),
        corner=float(random.choice([20.0, 40.0, 90.0])),
        gyro=log_uniform(2e-4, 4e-3),
        log=float(random.choice(LOGGED)),
        autopilot=autopilot,
        sensor=None if autopilot or random.random() < 0.6 else (random.uniform(0.02, 0.1), random.uniform(0.0, 1.0)),
    )
    shape = "" if answer else str(random.choice(SHAPES))
    if not answer and not autopilot and random.random() < 0.6:
        hand = (random.uniform(0.0, 0.5) * (damping + 1.0) / power, random.uniform(0.2, 0.35))
        size = random.uniform(0.2, 0.8) * (damping + 0.5) / power
        return replace(case, shape=shape, size=size, pilot=hand if shape == "by hand" else (0.0, 0.25))
    fastest = 0.6 / (lag + late + 0.01)  # rad/s: 35 degrees of lag
    cross = max(0.8, fastest * (random.uniform(0.25, 0.9) if random.random() < 0.5 else random.uniform(0.05, 0.2)))
    kind = str(random.choice(["P", "PI", "PID"]))
    p = float(np.hypot(cross, damping)) / power
    attitude = cross * random.uniform(0.15, 0.35) if kind == "P" or autopilot or random.random() < 0.7 else 0.0
    holds = attitude > 0.0 and random.random() < 0.4
    gains = (
        p,
        p * cross * random.uniform(0.1, 0.4) if "I" in kind else 0.0,
        p / cross * random.uniform(0.05, 0.25) if "D" in kind else 0.0,
        attitude,
        random.uniform(0.1, 0.25) * attitude / GRAVITY if holds else 0.0,
    )
    gust = (*case.gust[:2], random.uniform(0.1, 1.0) if holds else 0.0)
    place = str(random.choice(["mixer", "rate", "attitude"] if attitude else ["mixer", "rate"])) if shape else "open"
    sizes = {"open": 0.0, "rate": random.uniform(0.3, 1.0), "attitude": random.uniform(0.1, 0.4)}
    size = sizes.get(place, random.uniform(0.2, 0.8) * float(np.hypot(p * power, 1.0)) / power)
    every = int(random.choice([1, 1, 2, 4, 8]))
    return replace(case, shape=shape, place=place, size=size, gains=gains, gust=gust, every=every, speed=holds)


@dataclass(frozen=True)
class Flown:
    """A flight, and the share of its command's variance that came from outside."""

    case: Case
    flight: Flight
    outside: float


def fly(cases: Sequence[Case]) -> list[Flown]:
    """All flights side by side; all must be of one length."""
    asked = [_asked(case) for case in cases]
    flown = _simulated(cases, asked, disturbed=True)
    alone = _simulated(cases, asked, disturbed=False)
    made = []
    for i, case in enumerate(cases):
        share = float(np.var(alone["command"][:, i]) / max(np.var(flown["command"][:, i]), 1e-30))
        signals = {name: values[:, i] for name, values in flown.items()}
        made.append(Flown(case, _logged(case, signals, asked[i]), share))
    return made


def _smooth(random: np.random.Generator, count: int, corner: float) -> Array:
    b, a = butter(2, corner, fs=RATE)
    noise = lfilter(b, a, random.standard_normal(count + 2000))[2000:]
    return np.asarray(noise / noise.std())


def _fading(random: np.random.Generator, count: int, over: float) -> Array:
    keep = np.exp(-1.0 / (RATE * over))
    return np.asarray(lfilter([1.0], [1.0, -keep], np.sqrt(1.0 - keep**2) * random.standard_normal(count)))


def _asked(case: Case) -> Array:
    """What is asked from outside, shape (n,)."""
    random = np.random.default_rng([case.seed, 6])
    n = round(case.seconds * RATE)
    time = np.arange(n) / RATE
    if not case.shape:
        return np.zeros(n)
    if case.shape == "sweep":
        low, high = random.uniform(0.1, 0.4), random.uniform(4.0, 10.0)
        done = np.clip((time - 2.0) / (case.seconds - 4.0), 0.0, 1.0)
        frequency = low + (high - low) * np.expm1(4.0 * done) / np.expm1(4.0)
        fade = np.clip((time - 2.0) / 2.0, 0.0, 1.0) * np.clip(case.seconds - 1.0 - time, 0.0, 1.0)
        return case.size * fade * np.sin(2.0 * np.pi * np.cumsum(frequency) / RATE)
    if case.shape == "by hand":
        rests = np.convolve(_smooth(random, n, 0.1) < -0.5, np.ones(120) / 120.0, mode="same")
        return case.size * 0.6 * _smooth(random, n, random.uniform(0.5, 2.5)) * (1.0 - rests)
    if case.shape == "multisine":
        lines = np.arange(2, round(6.0 * case.seconds), 3) / case.seconds
        waves = np.sin(2.0 * np.pi * np.outer(time, lines) + random.uniform(0.0, 2.0 * np.pi, lines.size)).sum(axis=1)
        return np.asarray(case.size * waves / np.abs(waves).max())
    made, at, step = np.zeros(n), random.uniform(2.0, 4.0), random.uniform(0.25, 1.0)
    while at < case.seconds - 8.0 * step:
        parts = {"3-2-1-1": [(3, 1), (2, -1), (1, 1), (1, -1)], "doublets": [(1, 1), (1, -1)]}.get(
            case.shape, [(random.uniform(0.5, 3.0), random.uniform(-1.0, 1.0)) for _ in range(5)]
        )
        for length, value in parts:
            made[(time >= at) & (time < at + length * step)] = value
            at += length * step
        at += random.uniform(3.0, 8.0)
    width = max(1, round(random.uniform(0.0, 0.06) * RATE))
    return np.asarray(case.size * np.convolve(made, np.ones(width) / width, mode="same"))


def _simulated(cases: Sequence[Case], asked: Sequence[Array], *, disturbed: bool) -> dict[str, Array]:
    """Command, filtered gyro, rate, attitude, rate's set-point, attitude's set-point and speed, shape (n, flights)."""
    n, many, dt = asked[0].size, len(cases), 1.0 / RATE
    gust, side, gyro = np.zeros((3, n, many))
    for i, case in enumerate(cases):
        if disturbed:
            random = np.random.default_rng([case.seed, 7])
            gust[:, i] = case.gust[0] * _fading(random, n, case.gust[1])
            side[:, i] = case.gust[2] * _fading(random, n, 2.0)
            gyro[:, i] = case.gyro * random.standard_normal(n)
    power, damping, lag, late = np.array([case.plant for case in cases]).T
    p_gain, i_gain, d_gain, attitude, hold = np.array([case.gains for case in cases]).T
    hand, wait = np.array([case.pilot for case in cases]).T
    every = np.array([case.every for case in cases])
    follow = 1.0 - np.exp(-2.0 * np.pi * np.array([case.corner for case in cases]) * dt)
    delay, wait, columns = np.round(late * RATE).astype(int), np.round(wait * RATE).astype(int), np.arange(many)
    into = {place: np.array([case.place == place for case in cases]) for place in ("open", "mixer", "rate", "attitude")}
    outside = np.stack(asked, axis=1)
    names = ("command", "gyro", "p", "phi", "p_demand", "phi_demand", "v")
    out = {name: np.zeros((n, many)) for name in names}
    p, phi, v, servo, integral, before, slow, filtered, steady = np.zeros((9, many))
    command, demand, wanted = np.zeros((3, many))
    for k in range(n):
        slow = slow + follow * (p + gyro[k] - slow)
        filtered = filtered + follow * (slow - filtered)
        now, step = k % every == 0, every * dt
        wanted_now = np.where(into["attitude"], outside[k], 0.0) - hold * v
        demand_now = attitude * (wanted_now - phi) + np.where(into["rate"], outside[k], 0.0)
        error = demand_now - filtered
        integral_now = integral + step * i_gain * error
        steady_now = steady + 0.5 * ((error - before) / step - steady)
        felt = np.maximum(k - wait, 0)
        hands = hand * (out["phi"][felt, columns] + 0.3 * out["p"][felt, columns])
        added = np.where(into["open"] | into["mixer"], outside[k], 0.0) - hands
        command_now = p_gain * error + integral_now + d_gain * steady_now + added
        integral, steady = np.where(now, integral_now, integral), np.where(now, steady_now, steady)
        before, demand = np.where(now, error, before), np.where(now, demand_now, demand)
        command, wanted = np.where(now, command_now, command), np.where(now, wanted_now, wanted)
        for name, value in zip(names, (command, filtered, p, phi, demand, wanted, v), strict=True):
            out[name][k] = value
        sent = out["command"][np.maximum(k - delay, 0), columns]
        servo = servo + dt * (sent - servo) / lag
        p = p + dt * (power * servo - damping * p + gust[k])
        phi = phi + dt * p
        v = v + dt * (GRAVITY * phi - 0.3 * v + side[k])
    return out


def _logged(case: Case, signals: dict[str, Array], asked: Array) -> Flight:
    """What the log holds of it, at its rate."""
    random = np.random.default_rng([case.seed, 8])
    n, thin = asked.size, round(RATE / case.log)
    rate = signals["gyro"]
    if case.sensor is not None:
        size, slow = case.sensor
        noise = np.sqrt(slow) * _fading(random, n, 0.3) + np.sqrt(1.0 - slow) * random.standard_normal(n)
        rate = signals["p"] + size * signals["p"].std() * noise
    name = "mixer_roll" if case.autopilot else "command"
    table = {name: signals["command"], "p": rate, "phi": signals["phi"] + 1e-3 * random.standard_normal(n)}
    if case.speed:
        table["v"] = signals["v"] + 0.05 * random.standard_normal(n)
    events: tuple[Event, ...] = ()
    if case.autopilot:
        table |= {"p_demand": signals["p_demand"], "phi_demand": signals["phi_demand"]}
        table["stick_roll"] = np.zeros(n) if case.place == "mixer" else asked / max(np.abs(asked).max(), 1e-9)
        if case.place == "mixer":
            law = {"start": 0.0, "stop": case.seconds, "seen": case.seconds, "start_hz": 0.1, "stop_hz": 10.0}
            events = (Event(0.0, "sweep", "roll mixer, 0.1-10 Hz", law),)
    time = np.arange(n)[::thin] / RATE
    logged = stream(time, {k: values[::thin] for k, values in table.items()}, {"command": "1", "stick_roll": "1"})
    provenance = Provenance(source=f"flight {case.seed}", simulated=True, events=events)
    return Flight({"log": logged}, provenance)
