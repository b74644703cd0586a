"""Flights made by formula, for the tests of conditioning: every truth is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import chirp
from scipy.spatial.transform import Rotation

from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance

Array = NDArray[np.float64]
G = 9.80665
POSITION_NOISE, ATTITUDE_NOISE, INPUT_NOISE = 2e-4, 3e-3, 4e-3  # m, rad, 1: what the CoaX's tracking shows


def jittered(duration: float, rate: float, rng: np.random.Generator, jitter: float = 0.1) -> Array:
    """Stamps at `rate` whose jitter is a part of the period."""
    n = int(duration * rate)
    return np.arange(n) / rate + rng.uniform(-jitter, jitter, n) / rate


def wobble(time: Array, rng: np.random.Generator, *, amplitude: float, low: float = 0.4, high: float = 4.0) -> Array:
    """A multisine with random phases."""
    frequency = np.linspace(low, high, 13)
    phase = rng.uniform(0, 2 * np.pi, frequency.size)
    return amplitude / np.sqrt(frequency.size) * np.sum(np.sin(2 * np.pi * np.outer(time, frequency) + phase), axis=1)


@dataclass(frozen=True)
class Motion:
    """The truth at fine steps: time, Euler angles (n, 3) and position of the centre of gravity (n, 3)."""

    time: Array
    euler: Array
    position: Array

    def rotation(self) -> Rotation:
        return Rotation.from_euler("ZYX", self.euler[:, ::-1])


def hover(duration: float, seed: int, *, percussion: float = 0.0, tilt: float = 0.06) -> Motion:
    """Hover with a thrust along the body's z and an in-plane force that goes with the angular acceleration."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, duration, 1e-3)
    euler = np.stack([wobble(time, rng, amplitude=a) for a in (tilt, tilt, 2 * tilt)], axis=-1)
    rate = np.gradient(euler, time, axis=0)
    bend = np.gradient(rate, time, axis=0)  # small angles: close enough to pdot, qdot for a nuisance
    force = np.stack([-percussion * bend[:, 1], percussion * bend[:, 0], np.full(time.size, -G)], axis=-1)
    force[:, 2] += wobble(time, rng, amplitude=0.2, high=1.0)
    local = Rotation.from_euler("ZYX", euler[:, ::-1]).apply(force) + np.array([0.0, 0.0, G])
    local -= local.mean(axis=0)
    velocity = cumulative_trapezoid(local, time, axis=0, initial=0.0)
    velocity -= velocity.mean(axis=0)
    return Motion(time, euler, cumulative_trapezoid(velocity, time, axis=0, initial=0.0))


def tracked(
    motion: Motion, seed: int, *, arm: tuple[float, float, float] = (0.0, 0.0, 0.0), noise: float = 1.0
) -> Flight:
    """What motion capture at 150 Hz sees of a point at `arm` from the centre of gravity, quaternion signs flipping."""
    rng = np.random.default_rng(seed + 1000)
    stamps = jittered(motion.time[-1] - 0.1, 150.0, rng) + 0.01
    euler = np.stack([np.interp(stamps, motion.time, e) for e in motion.euler.T], axis=-1)
    point = motion.position + motion.rotation().apply(arm)
    position = np.stack([np.interp(stamps, motion.time, x) for x in point.T], axis=-1)
    position += noise * POSITION_NOISE * rng.standard_normal(position.shape)
    euler += noise * ATTITUDE_NOISE * rng.standard_normal(euler.shape)
    q = np.roll(Rotation.from_euler("ZYX", euler[:, ::-1]).as_quat(), 1, axis=1) * rng.choice(
        [-1.0, 1.0], (stamps.size, 1)
    )
    pose = dict(zip(("x", "y", "z", "qw", "qx", "qy", "qz"), np.column_stack([position, q]).T, strict=True))
    return Flight({"motion": stream(stamps, pose)}, Provenance(source="hover by formula", simulated=True))


def sweep(duration: float, seed: int, *, noise: float = 1.0, rate: float = 150.0) -> Flight:
    """A pitch sweep 0.5 to 8 Hz: pose in one stream, inputs in another, as the CoaX's logs are."""
    rng = np.random.default_rng(seed)
    t = jittered(duration, rate, rng)
    wave = chirp(t, 0.5, duration, 8.0, phi=-90)
    euler = np.stack([0.02 * np.sin(1.3 * t), 0.1 * wave, 0.5 * np.sin(0.4 * t)], axis=-1)
    euler += noise * ATTITUDE_NOISE * rng.standard_normal(euler.shape)
    position = np.stack([0.2 * np.sin(0.7 * t), 0.1 * np.cos(0.9 * t), -1.0 - 0.3 * np.sin(1.2 * t)], axis=-1)
    position += noise * POSITION_NOISE * rng.standard_normal(position.shape)
    q = np.roll(Rotation.from_euler("ZYX", euler[:, ::-1]).as_quat(), 1, axis=1)
    pose = dict(zip(("x", "y", "z", "qw", "qx", "qy", "qz"), np.column_stack([position, q]).T, strict=True))
    n = noise * INPUT_NOISE * rng.standard_normal((4, t.size))
    inputs = {
        "motor_lower": 0.55 + n[0],
        "motor_upper": 0.52 + n[1],
        "servo_roll": np.where((t > 5) & (t < 6), 0.1, 0.0) + n[2],
        "servo_pitch": 0.2 * wave + n[3],
    }
    return Flight(
        {"motion": stream(t, pose), "inputs": stream(t + 1e-4, inputs)}, Provenance(source="sweep", simulated=True)
    )
