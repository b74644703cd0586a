"""Rotorflight's mixer: limits of commands, the ring of the cyclic, servos of its swashplates, the governor (mixer.c).

A swashplate's type is how its servos stand: "120", "135" and "140" share the collective, "thru" and "90L" have a servo
for each command (H1), "90V" two at 45 degrees beside a collective that the rotor head has.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.arrays import Array
from swashplate.control.laws.rotorflight.filters import slope, two_poles
from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.physics.backend import Scalar

LIMIT = 1.25
"""Of every command: 15 degrees of cyclic or collective, where 12 are one."""
SATURATED = 5.0
"""Steps for which an axis that was cut counts as cut."""
_ROOT = 0.8660254
SWASHPLATES: Mapping[str, Array] = {
    "120": np.array([[0.0, -1.0, 0.5], [_ROOT, 0.5, 0.5], [-_ROOT, 0.5, 0.5]]),
    "135": np.array([[0.0, -1.0, 0.5], [1.0, 1.0, 0.5], [-1.0, 1.0, 0.5]]),
    "140": np.array([[0.0, -1.0, 0.5], [_ROOT, 1.0, 0.5], [-_ROOT, 1.0, 0.5]]),
    "90L": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "90V": np.array([[0.70710678, 0.70710678, 0.0], [-0.70710678, 0.70710678, 0.0]]),
    "thru": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
"""Servos by roll, pitch and collective."""
GOVERNOR: Mapping[str, int] = {"rpm": 2, "rpm_slope": 2, "rpm_sum": 1, "load": 2}
"""What the governor carries, with sizes."""


def commands_of(kind: str, servos: Array) -> Array:
    """Roll, pitch and collective that put servos where they are; the collective is 0 where no servo moves it."""
    return np.asarray(np.linalg.pinv(SWASHPLATES[kind]) @ servos)


def limited(
    commands: Symbols, collective: Scalar, ring: Scalar, xp: ArrayFunctions
) -> tuple[Operand, Operand, Operand]:
    """Commands (3,) and collective within their limits and the ring, and which of the three were cut (0 or 1).

    Args:
        commands: of roll, pitch and yaw. collective: deflection.
        ring: 100 limits the cyclic to a circle, 0 to nothing.
    """
    within = xp.clip(commands, -LIMIT, LIMIT)
    cut = xp.greater(xp.abs(commands), LIMIT)
    radius = LIMIT * xp.where(ring > 0.0, 2.0**0.5 - ring * 0.01 * (2.0**0.5 - 1.0), 1e9)
    beyond = xp.sqrt(within[0] * within[0] + within[1] * within[1] + 1e-18) / radius
    cyclic = within[:2] / xp.maximum(beyond, 1.0)
    rings = beyond > 1.0
    cut = xp.where(cut, 1.0, 0.0)
    ringed = xp.where(rings, 1.0, 0.0)
    cut = xp.stack([xp.maximum(cut[0], ringed), xp.maximum(cut[1], ringed), cut[2]])
    return xp.concatenate([cyclic, within[2:]]), xp.clip(collective, -LIMIT, LIMIT), cut


def governed(
    m: Mapping[str, Operand],
    after: dict[str, Operand],
    headspeed: Scalar,
    commands: Symbols,
    collective: Scalar,
    cyclic: Scalar,
    k: Mapping[str, Operand],
    dt: Scalar,
    xp: ArrayFunctions,
) -> Operand:
    """The throttle of the governor in flight (governor.c), 0 to 1; 1 where no head speed is asked for.

    Args:
        m: what is carried, by the names of `GOVERNOR`. after: gets what is carried on.
        headspeed: [rpm]. commands, collective, cyclic: this step's deflections.
        k: parameters by name. dt: [s].
    """
    wanted = k["gov_headspeed"]
    after["rpm"] = two_poles(m["rpm"], headspeed, k["gov_rpm_filter"], dt, xp)
    error = (wanted - after["rpm"][0]) / xp.maximum(wanted, 100.0)
    change, after["rpm_slope"] = slope(m["rpm_slope"], error, 0.1 * k["gov_d_filter"], dt, xp)
    gain = 0.01 * k["gov_gain"]

    def within(value: Operand, limit: str) -> Operand:
        return xp.clip(value, -0.01 * k[limit], 0.01 * k[limit])

    p = within(gain * 0.1 * k["gov_p_gain"] * error, "gov_p_limit")
    total = within(m["rpm_sum"][0], "gov_i_limit")
    step = gain * 0.1 * k["gov_i_gain"] * error * dt
    d = within(gain * 0.001 * k["gov_d_gain"] * change, "gov_d_limit")
    load = 0.01 * k["gov_collective_weight"] * xp.maximum(xp.abs(collective), 1e-9) ** (0.1 * k["gov_collective_curve"])
    load = load + 0.01 * k["gov_cyclic_weight"] * cyclic + 0.01 * k["gov_yaw_weight"] * xp.abs(commands[2])
    after["load"] = two_poles(m["load"], gain * 0.01 * k["gov_f_gain"] * load, k["gov_ff_filter"], dt, xp)
    f = xp.clip(after["load"][0], 0.0, 0.01 * k["gov_f_limit"])
    throttle = p + total + step + d + f
    low, high = 0.01 * k["gov_min_throttle"], 0.01 * k["gov_max_throttle"]
    counts = (xp.greater(throttle, low) | xp.greater(step, 0.0)) & (xp.greater(high, throttle) | xp.greater(0.0, step))
    after["rpm_sum"] = (total + xp.where(counts, step, 0.0)) + 0.0 * m["rpm_sum"]
    return xp.where(wanted > 0.0, xp.clip(throttle, low, high), 1.0)
