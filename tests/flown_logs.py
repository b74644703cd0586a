"""Many logs of aircraft in gusts under rate and attitude loops, swept or not, right or with a fault.

Written from the equations of a rate axis (actuator's lag, damping, delay), without any part of the package: two axes,
of which roll is logged with its loop's gains, as an autopilot does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance

STEP, SECONDS = 1.0 / 400.0, 80.0
KINDS = ("good", "no sweep", "stick reversed", "gyro reversed", "degrees as radians")
"""What a log is: fit for gains, or with one fault."""


@dataclass(frozen=True)
class Flown:
    """One log and what is true of it.

    Attributes:
        flight: mixer_roll, p, in half of them phi, and where it was injected and logged, sid_target.
        kind: of `KINDS`. recorded: whether sid_target is there. rate: of the log [Hz].
    """

    flight: Flight
    kind: str
    recorded: bool
    rate: float


def _sweep(time: Array, low: float, high: float) -> Array:
    """A logarithmic sweep from 6 s to 6 s before the end, faded in and out."""
    own, last = time - 6.0, SECONDS - 12.0
    ratio = high / low
    phase = 2.0 * np.pi * low * last / np.log(ratio) * (ratio ** (np.clip(own, 0.0, last) / last) - 1.0)
    fade = np.clip(np.minimum(own, last - own) / 3.0, 0.0, 1.0)
    return np.asarray(np.sin(phase) * fade)


def logs(kinds: tuple[str, ...], *, seed: int) -> list[Flown]:
    """One log of each of these kinds, every aircraft, loop, gust, noise and logging rate drawn anew."""
    rng, n = np.random.default_rng(seed), len(kinds)
    swept = np.array([kind != "no sweep" for kind in kinds])
    rates = np.array([rng.choice([50.0, 100.0, 200.0] if s else [10.0, 25.0, 50.0, 100.0]) for s in swept])
    effect, damping = 10.0 ** rng.uniform(1.2, 2.2, n), rng.uniform(0.3, 10.0, n)
    lag, delay = rng.uniform(0.01, 0.05, n), rng.integers(2, 9, n)
    crossover = rng.uniform(0.15, 0.45, n) / (lag + delay * STEP)
    p_gain = np.hypot(crossover, damping) / effect
    i_gain, d_gain = p_gain * rng.uniform(0.2, 1.0, n), p_gain * lag * rng.uniform(0.0, 0.4, n)
    hold, coupled = crossover * rng.uniform(0.15, 0.3, n), rng.uniform(-0.2, 0.2, n)
    gust, noise = rng.uniform(0.05, 0.4, n), 10.0 ** rng.uniform(-3.0, -2.0, n)
    time = np.arange(round(SECONDS / STEP)) * STEP
    high = np.minimum(12.0, 0.2 * rates)
    size = rng.uniform(0.5, 1.0, n) / (effect / np.hypot(2.0 * np.pi, damping))
    chirp = np.stack([_sweep(time, 0.3, h) for h in high], axis=1) * size * swept
    wind = 0.3 * np.sqrt(STEP) * (gust * effect * size)[:, None]
    late, held = np.zeros((int(delay.max()) + 1, n, 2)), np.arange(n)
    y, p, phi, total, before, slope, blown = (np.zeros((n, 2)) for _ in range(7))
    told = np.zeros((time.size, n, 3))
    share, gains = 1.0 - np.exp(-2.0 * np.pi * 20.0 * STEP), (p_gain[:, None], i_gain[:, None], d_gain[:, None])
    for k in range(time.size):
        seen = p + noise[:, None] * rng.standard_normal((n, 2))
        error = -hold[:, None] * phi - seen
        total += STEP * error
        slope += share * ((error - before) / STEP - slope)
        before = error
        u = gains[0] * error + gains[1] * total + gains[2] * slope
        u[:, 0] += chirp[k]
        told[k] = np.stack([u[:, 0], seen[:, 0], phi[:, 0]], axis=1)
        late[k % len(late)] = u
        acting = late[(k - delay) % len(late), held]
        y += STEP * (acting - y) / lag[:, None]
        blown += wind * rng.standard_normal((n, 2)) - STEP * blown
        p += STEP * (effect[:, None] * (y + coupled[:, None] * y[:, ::-1]) - damping[:, None] * p + blown)
        phi += STEP * p
    made = []
    for i, kind in enumerate(kinds):
        every = round(1.0 / STEP / rates[i])
        u, seen, angle = told[::every, i].T
        recorded = bool(swept[i] and rng.random() < 0.5)
        turned = -1.0 if kind == "stick reversed" else 1.0
        wrong = {"gyro reversed": -1.0, "degrees as radians": 180.0 / np.pi}.get(kind, 1.0)
        columns = {"mixer_roll": turned * u, "p": wrong * seen}
        columns |= {"phi": angle} if rng.random() < 0.5 else {}
        columns |= {"sid_target": turned * chirp[::every, i]} if recorded else {}
        gained = {"P": p_gain[i], "I": i_gain[i], "D": d_gain[i], "FF": 0.0, "FLTT": 20.0, "FLTE": 0.0, "FLTD": 20.0}
        known = {f"ATC_RAT_RLL_{name}": float(value) for name, value in gained.items()}
        said = Provenance(f"log {i}", reader="ardupilot", firmware="ArduCopter V4.5.7", parameters=known)
        made.append(Flown(Flight({"log": stream(time[::every], columns)}, said), kind, recorded, float(rates[i])))
    return made
