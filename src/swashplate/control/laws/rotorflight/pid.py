"""Rotorflight's rate controller (pid.c, mode 3, in the air and spooled up), one step, in its axes and units.

Rates in deg/s: roll right, pitch nose down, yaw nose left positive. Commands: 1 is 12 degrees of cyclic or collective.
Each axis sums P, I, D, F (the demand), B (its derivative) and O, an integral that the collective scales. Beside them
stand cyclic cross-coupling of demands and precompensation of the tail by collective, cyclic and rotor speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from swashplate.control.laws.rotorflight.filters import high_pass, low_pass, one_pole, slope, two_poles
from swashplate.control.laws.rotorflight.parameters import AXES, CROSS_COUPLING, SCALES
from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.physics.backend import Scalar

ERROR_DECAY = ((12, 13, 14, 15, 17, 20, 23, 28, 36, 49, 78, 187, 250, 250, 250, 250), (12,) * 16)
OFFSET_DECAY = (
    (250, 250, 250, 250, 250, 30, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    (12, 12, 10, 8, 6, 4, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2),
)
OFFSET_BLEED = (
    (0, 0, 0, 0, 0, 0, 2, 4, 30, 250, 250, 250, 250, 250, 250, 250),
    (0, 0, 0, 0, 0, 0, 15, 40, 100, 150, 200, 250, 250, 250, 250, 250),
)
OFFSET_CHARGE = (0, 100, 100, 100, 100, 100, 95, 90, 82, 76, 72, 68, 65, 62, 60, 58)
OFFSET_FLOOD = (0, 0, 0, 20, 50, 100, 180, 220, 220, 220, 220, 220, 220, 220, 220, 220)
"""Tables over 0 to 15 degrees of collective (bleeding: over 0 to 300 deg/s of demand): rates and limits."""
_UNLIMITED, _RATE_MODE = 3600.0, 0.2
MEMORY: Mapping[str, int] = {
    "rate": 6, "slope": 6, "boost": 6, "relax": 3, "error": 3, "offset": 2, "crossed": 4, "precomp": 2,
    "speed": 2, "speed_slope": 2, "flood": 1,
}  # fmt: skip
"""What it carries, with sizes."""


class Deflections(NamedTuple):
    """What the mixer did in the step before.

    Attributes:
        collective, cyclic: deflections, the second without sign.
        saturated: 1 where an axis was cut in the last steps, (3,).
    """

    collective: Operand
    cyclic: Operand
    saturated: Operand


def table(x: Scalar, points: tuple[int, ...], xp: ArrayFunctions) -> Operand:
    """Between the points of a table over 0 to 1; beyond it the last piece goes on, never below zero."""
    bins = len(points) - 1
    steps = np.diff(points)
    value = points[0] + sum(steps[i] * xp.clip(x * bins - i, 0.0, 1.0) for i in range(bins - 1))
    return xp.maximum(value + steps[-1] * xp.maximum(x * bins - (bins - 1), 0.0), 0.0)


def _within(value: Operand, limit: Operand, xp: ArrayFunctions) -> Operand:
    return xp.clip(value, -limit, limit)


def _of(k: Mapping[str, Operand], name: str, xp: ArrayFunctions) -> Operand:
    """A gain by axis, as commands per degree and second; of an axis without one 0."""
    return xp.stack([k.get(f"{axis}_{name}", 0.0) * scale for axis, scale in zip(AXES, SCALES[name], strict=True)])


def _by_axis(k: Mapping[str, Operand], pattern: str, xp: ArrayFunctions) -> Operand:
    return xp.stack([k[pattern.format(axis)] for axis in AXES])


def _turned(pair: Symbols, angle: Scalar) -> Operand:
    """Roll and pitch of what is kept, carried along as the nose turns left by a small angle [rad]."""
    t = 0.5 * angle * angle
    c, s = t * (1.0 - t / 6.0), angle * (1.0 - t / 3.0)
    x, y = pair[0], pair[1]
    return x - (x * c - y * s), y - (y * c + x * s)


def pid_step(
    m: Mapping[str, Operand],
    gyro: Symbols,
    demand: Symbols,
    mixed: Deflections,
    headspeed: Scalar,
    k: Mapping[str, Operand],
    sense: Scalar,
    dt: Scalar,
    xp: ArrayFunctions,
) -> tuple[Operand, dict[str, Operand]]:
    """Commands of roll, pitch and yaw, shape (3,), and what is carried on.

    Args:
        m: what is carried, by the names of `MEMORY`.
        gyro, demand: rates, their demands [deg/s], shape (3,).
        mixed: of the step before.
        headspeed: [rpm].
        k: parameters by name. sense: 1 for a rotor that turns counter-clockwise, -1 for a clockwise one.
        dt: [s].
    """
    gains = {name[0]: _of(k, name, xp) for name in SCALES}
    error, offset = list(m["error"]), list(m["offset"])
    turn = xp.radians(gyro[2]) * dt
    error[:2], offset[:2] = _turned(m["error"], turn), _turned(m["offset"], turn)
    error, offset = xp.stack(error), xp.stack(offset)
    after: dict[str, Operand] = {}

    rate, kept = low_pass(m["rate"].reshape(2, 3), gyro, _by_axis(k, "{}_gyro_cutoff", xp), dt, xp)
    after["rate"] = kept.ravel()
    missing = demand - rate
    # Between -10 and 10 deg/s the two stop gains of yaw go over into each other.
    stops = 0.01 * xp.stack([k["yaw_ccw_stop_gain"], k["yaw_cw_stop_gain"]])
    stop = stops[0] + (stops[1] - stops[0]) * xp.clip((missing[2] + 10.0) / 20.0, 0.0, 1.0)
    p = gains["p"] * missing * xp.stack([1.0 + 0.0 * stop, 1.0 + 0.0 * stop, stop])
    falling, kept = slope(m["slope"].reshape(2, 3), -rate, _by_axis(k, "{}_d_cutoff", xp), dt, xp)
    after["slope"] = kept.ravel()
    rising, kept = slope(m["boost"].reshape(2, 3), demand, _by_axis(k, "{}_b_cutoff", xp), dt, xp)
    after["boost"] = kept.ravel()

    after["relax"] = one_pole(m["relax"], demand, _by_axis(k, "iterm_relax_cutoff_{}", xp), dt, xp)
    calm = xp.maximum(0.0, 1.0 - xp.abs(demand - after["relax"]) / _by_axis(k, "iterm_relax_level_{}", xp))
    relaxes = xp.greater(k["iterm_relax_type"] + np.array([0.0, 0.0, -1.0]), 0.5)
    summed = missing * xp.where(relaxes, calm, 1.0)
    cut = xp.greater(mixed.saturated, 0.5)
    stuck = cut & xp.greater(error * summed, 0.0)
    limit = _by_axis(k, "error_limit_{}", xp)
    error = _within(error + xp.where(stuck, 0.0, summed * dt), limit, xp)
    integral = gains["i"] * error
    collective = mixed.collective
    curve, side = 0.8 * xp.abs(collective), xp.where(xp.greater(0.0, collective), -1.0, 1.0)
    error = error - _decayed(error, k, gains["i"][2], curve, xp) * dt

    charge = side * table(curve, OFFSET_CHARGE, xp) / 100.0
    stuck = cut[:2] & xp.greater(offset * summed[:2] * collective, 0.0)
    most = xp.stack([k[f"offset_limit_{axis}"] for axis in AXES[:2]])
    offset = _within(offset + xp.where(stuck, 0.0, summed[:2] * dt * charge), most, xp)
    held = gains["o"][:2] * offset * collective
    leak = offset * table(curve, OFFSET_DECAY[0], xp) * 0.04
    offset = offset - _within(leak, table(curve, OFFSET_DECAY[1], xp), xp) * dt

    share = xp.where(
        xp.greater(gains["o"][:2], 0.0) & xp.greater(gains["i"][:2], 0.0),
        gains["o"][:2] / xp.maximum(gains["i"][:2], 1e-12),
        0.0,
    )
    cyclic, offset = _bled(error[:2], offset, demand, share, collective, dt, xp)
    after["flood"] = one_pole(m["flood"], collective + 0.0 * m["flood"], k["offset_flood_relax_cutoff"], dt, xp)
    level = xp.clip(k["offset_flood_relax_level"], 10.0, 250.0)
    quiet = xp.maximum(0.0, 1.0 - xp.abs(collective - after["flood"][0]) / level)
    cyclic, offset = _flooded(cyclic, offset, share, most, collective, curve, quiet * dt, xp)
    after["error"], after["offset"] = xp.concatenate([cyclic, error[2:]]), offset

    crossed, kept = high_pass(
        m["crossed"].reshape(2, 2), demand[:2], 0.1 * k["cyclic_cross_coupling_cutoff"] * np.ones(2), dt, xp
    )
    after["crossed"] = kept.ravel()
    to_roll = -CROSS_COUPLING * sense * k["cyclic_cross_coupling_gain"]
    to_pitch = to_roll * k["cyclic_cross_coupling_ratio"] / -100.0
    precomp = _precompensated(m, after, demand, mixed, headspeed, k, sense, dt, xp)
    added = xp.stack(
        [
            crossed[1] * to_roll + held[0],
            crossed[0] * to_pitch + held[1] + collective * k["pitch_collective_ff_gain"] / 500.0,
            precomp,
        ]
    )
    return p + integral + gains["d"] * falling + gains["f"] * demand + gains["b"] * rising + added, after


def _inverse(time: Scalar, xp: ArrayFunctions) -> Operand:
    """10 over a time, none of 0."""
    return xp.where(xp.greater(time, 0.0), 10.0 / xp.maximum(time, 1e-9), 0.0)


def _decayed(
    error: Symbols, k: Mapping[str, Operand], yaw_integral: Scalar, curve: Scalar, xp: ArrayFunctions
) -> Operand:
    """By how much errors decay [deg/s], (3,): roll's and pitch's faster with more collective."""
    fast = _inverse(k["error_decay_time_cyclic"], xp) * table(curve, ERROR_DECAY[0], xp) * 0.08
    limit = xp.where(xp.greater(k["error_decay_limit_cyclic"], 0.0), k["error_decay_limit_cyclic"], _UNLIMITED)
    limit = limit * table(curve, ERROR_DECAY[1], xp) * 0.08
    turning = _inverse(k["error_decay_time_yaw"], xp)
    turning = xp.where(xp.greater(yaw_integral, 0.0), turning, xp.maximum(turning, _RATE_MODE))
    most = xp.where(xp.greater(k["error_decay_limit_yaw"], 0.0), k["error_decay_limit_yaw"], _UNLIMITED)
    rates, limits = xp.stack([fast, fast, turning]), xp.stack([limit, limit, most])
    return _within(error * rates, limits, xp)


def _bled(
    error: Symbols, offset: Symbols, demand: Symbols, share: Symbols, collective: Scalar, dt: Scalar, xp: ArrayFunctions
) -> tuple[Operand, Operand]:
    """While roll and pitch are demanded, what of the offset lies along the demand goes back into the error."""
    roll, pitch = demand[0], demand[1]
    square = roll * roll + pitch * pitch
    along = xp.where(square > 1.0, (roll * offset[0] + pitch * offset[1]) / xp.maximum(square, 1.0), 0.0)
    size = xp.sqrt(square + 1e-18) / 300.0
    fast, limit = table(size, OFFSET_BLEED[0], xp) * 0.04, table(size, OFFSET_BLEED[1], xp)
    bled = _within(demand[:2] * along * fast, limit, xp) * dt
    return error + bled * share * collective, offset - bled


def _flooded(
    error: Symbols,
    offset: Symbols,
    share: Symbols,
    most: Symbols,
    collective: Scalar,
    curve: Scalar,
    quiet: Scalar,
    xp: ArrayFunctions,
) -> tuple[Operand, Operand]:
    """While the collective rests, the error flows into the offset, without a step of the command."""
    side = xp.where(xp.greater(0.0, error), -1.0, 1.0) * xp.where(xp.greater(0.0, collective), -1.0, 1.0)
    wanted = side * table(curve, OFFSET_FLOOD, xp) * 0.08 * quiet
    gained = _within(offset + wanted, most, xp) - offset
    scale = collective * share
    taken = gained * scale
    all_of_it = xp.greater(xp.abs(taken), xp.abs(error))
    safe = xp.where(xp.greater(xp.abs(scale), 0.0), scale, 1.0)
    gained, taken = xp.where(all_of_it, error / safe, gained), xp.where(all_of_it, error, taken)
    used = xp.greater(share, 0.0)
    return error - xp.where(used, taken, 0.0), offset + xp.where(used, gained, 0.0)


def _precompensated(
    m: Mapping[str, Operand],
    after: dict[str, Operand],
    demand: Symbols,
    mixed: Deflections,
    headspeed: Scalar,
    k: Mapping[str, Operand],
    sense: Scalar,
    dt: Scalar,
    xp: ArrayFunctions,
) -> Operand:
    """Of the tail, against the torque of drag and of a rotor that speeds up."""
    after["speed"] = two_poles(m["speed"], (headspeed + sense * demand[2] / 6.0) / 3000.0, 20.0, dt, xp)
    change, after["speed_slope"] = slope(
        m["speed_slope"], after["speed"][0], 0.1 * k["yaw_inertia_precomp_cutoff"], dt, xp
    )
    deflection = xp.abs(mixed.collective) * 0.01 * k["yaw_collective_ff_gain"]
    deflection = deflection + mixed.cyclic * 0.01 * k["yaw_cyclic_ff_gain"]
    drag, after["precomp"] = low_pass(m["precomp"], deflection * deflection, k["yaw_precomp_cutoff"], dt, xp)
    return (drag + change * k["yaw_inertia_precomp_gain"] / 200.0) * sense
