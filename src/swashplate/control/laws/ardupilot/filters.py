"""ArduPilot's filters, one step each, as JAX traces them: one pole, two poles, notches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from swashplate.jax_on_demand import jax, jnp
from swashplate.physics.backend import Scalar

HARMONICS = (1.0, 2.0)
"""Of the gyros' notch: INS_HNTCH_HMNCS 3, the default."""


def reached_by(now: Scalar, wanted: Scalar, hertz: Scalar, dt: Scalar) -> Any:
    """One pole: a step of `dt` [s] from a value to what is wanted; 0 Hz is no filter."""
    slow = 1.0 / (2.0 * math.pi * jnp.maximum(hertz, 1e-6))
    return now + jnp.where(hertz > 0.0, dt / (dt + slow), 1.0) * (wanted - now)


def one_pole(now: Scalar, wanted: Scalar, hertz: Scalar, dt: Scalar, begun: Scalar) -> Any:
    """The same, which takes over the first value as it is."""
    return jnp.where(begun > 0.5, reached_by(now, wanted, hertz, dt), wanted)


def low_pass(stages: jax.Array, value: jax.Array, hertz: Scalar, dt: Scalar) -> tuple[Any, Any]:
    """Butterworth's two poles (LowPassFilter2p) on n signals: filtered, and what each keeps, shape (n, 2)."""
    turn = jnp.tan(math.pi * jnp.clip(hertz * dt, 1e-6, 0.49))
    root = 2.0 * math.cos(math.pi / 4.0)
    c = 1.0 + root * turn + turn**2
    b, a1, a2 = turn**2 / c, 2.0 * (turn**2 - 1.0) / c, (1.0 - root * turn + turn**2) / c
    fresh = value - a1 * stages[:, 0] - a2 * stages[:, 1]
    filtered = b * (fresh + 2.0 * stages[:, 0] + stages[:, 1])
    passed = hertz > 0.0
    return jnp.where(passed, filtered, value), jnp.stack([fresh, stages[:, 0]], axis=1)


def notch(memory: jax.Array, value: jax.Array, k: Mapping[str, Any], dt: Scalar) -> tuple[Any, Any]:
    """The gyros' notch at a fixed frequency and twice it: filtered, and its memory, shapes (3,) and (12,)."""
    on = k["INS_HNTCH_ENABLE"] > 0.5
    deep = 10.0 ** (-k["INS_HNTCH_ATT"] / 40.0)
    stages, kept = memory.reshape(len(HARMONICS), 3, 2), []
    for harmonic, stage in zip(HARMONICS, stages, strict=True):
        centre = harmonic * k["INS_HNTCH_FREQ"]
        octaves = 2.0 * jnp.log2(centre / jnp.maximum(centre - 0.5 * harmonic * k["INS_HNTCH_BW"], 0.05 * centre))
        quality = jnp.sqrt(2.0**octaves) / (2.0**octaves - 1.0)
        angle = 2.0 * math.pi * jnp.clip(centre * dt, 1e-6, 0.49)
        alpha = jnp.sin(angle) / (2.0 * quality)
        b0, b2, middle = 1.0 + alpha * deep**2, 1.0 - alpha * deep**2, -2.0 * jnp.cos(angle)
        a0, a2 = 1.0 + alpha, 1.0 - alpha
        fresh = value - (middle * stage[:, 0] + a2 * stage[:, 1]) / a0
        filtered = (b0 * fresh + middle * stage[:, 0] + b2 * stage[:, 1]) / a0
        value = jnp.where(on, filtered, value)
        kept.append(jnp.stack([fresh, stage[:, 0]], axis=1))
    return value, jnp.stack(kept).ravel()
