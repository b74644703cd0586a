"""A rate loop with a known step response, flown with sticks in gusts: for what is read from ordinary flights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance

RATE = 400.0


@dataclass(frozen=True)
class Loop:
    """P and I on the error of a rate, an effectiveness with a lag, and pure delay.

    Attributes:
        p, i: gains; effect: rad/s^2 of a command of 1; damping: 1/s; lag, delay: [s].
    """

    p: float = 0.11
    i: float = 0.15
    effect: float = 160.0
    damping: float = 2.0
    lag: float = 0.03
    delay: float = 0.02

    def flown(self, target: Array, gust: Array, noise: Array) -> tuple[Array, Array]:
        """Motion as it is measured [rad/s] and command, for a target and disturbing accelerations; all shape (n,)."""
        h, wait = 1.0 / RATE, round(self.delay * RATE)
        rate = total = moved = 0.0
        motion, command = np.zeros(target.size), np.zeros(target.size)
        for k in range(target.size):
            motion[k] = rate + noise[k]
            error = target[k] - motion[k]
            total += h * error
            command[k] = np.clip(self.p * error + self.i * total, -1.0, 1.0)
            acts = command[k - wait] if k >= wait else 0.0
            moved += h * (acts - moved) / self.lag
            rate += h * (self.effect * moved - self.damping * rate + gust[k])
        return motion, command

    def truth(self) -> tuple[Array, Array]:
        """Time [s] and response to a step of the target, without gusts."""
        n = round(1.0 * RATE)
        quiet = np.zeros(n)
        return np.arange(n) / RATE, self.flown(0.01 * np.ones(n), quiet, quiet)[0] / 0.01


def sticks(seed: int, seconds: float, *, size: float = 1.0) -> Array:
    """What a pilot asks for [rad/s]: held for 0.2 to 1.5 s, moved within a tenth of a second, shape (n,)."""
    rng, n = np.random.default_rng(seed), round(seconds * RATE)
    asked, at = np.zeros(n), 0
    while at < n:
        held = round(RATE * rng.uniform(0.2, 1.5))
        asked[at : at + held] = size * rng.standard_normal() * (rng.random() < 0.7)
        at += held
    kernel = np.hanning(round(0.12 * RATE))
    return np.convolve(asked, kernel / kernel.sum(), mode="same")


def gusts(seed: int, seconds: float, *, size: float = 2.0) -> Array:
    """Accelerations of gusts of a second [rad/s^2], shape (n,)."""
    rng, n = np.random.default_rng(1000 + seed), round(seconds * RATE)
    drive, out, value = rng.standard_normal(n) * np.sqrt(2.0 / RATE), np.zeros(n), 0.0
    for k in range(n):
        value += -value / RATE + size * drive[k]
        out[k] = value
    return out


def flight(
    loop: Loop, seed: int, *, seconds: float = 60.0, size: float = 1.0, gust: float = 2.0, noise: float = 0.02
) -> Flight:
    """A flight of one roll loop by hand, logged at 400 Hz."""
    target = sticks(seed, seconds, size=size)
    rng = np.random.default_rng(2000 + seed)
    motion, command = loop.flown(target, gusts(seed, seconds, size=gust), noise * rng.standard_normal(target.size))
    time = np.arange(target.size) / RATE
    channels = {"p": motion, "p_demand": target, "mixer_roll": command}
    return Flight({"rates": stream(time, channels)}, Provenance(source="flown by hand", simulated=True))
