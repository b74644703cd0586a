"""ArduPilot's filters, one step each, on arrays: one pole, two poles, notches."""

from __future__ import annotations

import math
from collections.abc import Mapping

from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.physics.backend import Scalar

HARMONICS = (1.0, 2.0)
"""Of the gyros' notch: INS_HNTCH_HMNCS 3, the default."""


def reached_by(now: Scalar, wanted: Scalar, hertz: Scalar, dt: Scalar, xp: ArrayFunctions) -> Operand:
    """One pole: a step of `dt` [s] from a value to what is wanted; 0 Hz is no filter."""
    slow = 1.0 / (2.0 * math.pi * xp.maximum(hertz, 1e-6))
    return now + xp.where(xp.greater(hertz, 0.0), dt / (dt + slow), 1.0) * (wanted - now)


def one_pole(now: Scalar, wanted: Scalar, hertz: Scalar, dt: Scalar, begun: Scalar, xp: ArrayFunctions) -> Operand:
    """The same, which takes over the first value as it is."""
    return xp.where(xp.greater(begun, 0.5), reached_by(now, wanted, hertz, dt, xp), wanted)


def low_pass(stages: Symbols, value: Symbols, hertz: Scalar, dt: Scalar, xp: ArrayFunctions) -> tuple[Operand, Operand]:
    """Butterworth's two poles (LowPassFilter2p) on n signals: filtered, and what each keeps, shape (n, 2)."""
    turn = xp.tan(math.pi * xp.clip(hertz * dt, 1e-6, 0.49))
    root = 2.0 * math.cos(math.pi / 4.0)
    c = 1.0 + root * turn + turn**2
    b, a1, a2 = turn**2 / c, 2.0 * (turn**2 - 1.0) / c, (1.0 - root * turn + turn**2) / c
    fresh = value - a1 * stages[:, 0] - a2 * stages[:, 1]
    filtered = b * (fresh + 2.0 * stages[:, 0] + stages[:, 1])
    passed = hertz > 0.0
    return xp.where(passed, filtered, value), xp.stack([fresh, stages[:, 0]], axis=1)


def notch(
    memory: Symbols, value: Symbols, k: Mapping[str, Operand], dt: Scalar, xp: ArrayFunctions
) -> tuple[Operand, Operand]:
    """The gyros' notch at a fixed frequency and twice it: filtered, and its memory, shapes (3,) and (12,)."""
    on = k["INS_HNTCH_ENABLE"] > 0.5
    deep = 10.0 ** (-k["INS_HNTCH_ATT"] / 40.0)
    stages, kept = memory.reshape(len(HARMONICS), 3, 2), []
    for harmonic, stage in zip(HARMONICS, stages, strict=True):
        centre = harmonic * k["INS_HNTCH_FREQ"]
        octaves = 2.0 * xp.log2(centre / xp.maximum(centre - 0.5 * harmonic * k["INS_HNTCH_BW"], 0.05 * centre))
        quality = xp.sqrt(2.0**octaves) / (2.0**octaves - 1.0)
        angle = 2.0 * math.pi * xp.clip(centre * dt, 1e-6, 0.49)
        alpha = xp.sin(angle) / (2.0 * quality)
        b0, b2, middle = 1.0 + alpha * deep**2, 1.0 - alpha * deep**2, -2.0 * xp.cos(angle)
        a0, a2 = 1.0 + alpha, 1.0 - alpha
        fresh = value - (middle * stage[:, 0] + a2 * stage[:, 1]) / a0
        filtered = (b0 * fresh + middle * stage[:, 0] + b2 * stage[:, 1]) / a0
        value = xp.where(on, filtered, value)
        kept.append(xp.stack([fresh, stage[:, 0]], axis=1))
    return value, xp.stack(kept).ravel()
