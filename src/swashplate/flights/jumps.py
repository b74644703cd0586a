"""Samples that no motion of the aircraft explains, counted for `inspect`; conditioning removes such samples.

A change between two samples stands out where it is far outside the scatter of all changes and of its neighbours.
Takeoffs, steps and touch-downs stand out too, so what stands out is told only where it cannot be motion:

* a place, a velocity or an attitude, where it takes an acceleration that no aircraft survives;
* anything, where the next samples take it back, and the inertial sensors felt nothing of it; but no command of a loop
  and no term of its law where the mode changes, when another loop takes over.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.conditioning.attitude import quaternion_from_euler
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION, QUATERNION, RATES, VARIANTS, VELOCITY

OUTLIER = 12.0
"""Robust standard deviations of the sample-to-sample change from which on it stands out."""
_BLOCK = 1 << 16  # samples that are turned at a time: a long log has no room for the quaternions of all
_NEAR = 25  # changes on each side that are its neighbours
_UNUSUAL = 4.0  # robust standard deviations of the neighbours; a sweep's own changes reach one
_MAD_TO_SIGMA = 1.4826  # of a normal distribution: 1 / Phi^-1(3/4)
_Q95_TO_SIGMA = 1.0 / 1.95996  # of a normal distribution: 1 / Phi^-1(0.975)
_SLIGHT = 1e-3  # of the channel's span; a smaller change is no jump, however still the channel is otherwise
_IMPOSSIBLE = 200.0  # m/s^2, twenty times gravity: more than a crash shows over two samples
_IMPOSSIBLE_TURN = 1000.0  # rad/s^2: small aerobatic helicopters reach 150
_BRIEF = 2  # samples: what lasts longer is no spike
_TAKEN_BACK = 0.3  # of a spike: what may be left of it behind it
_BEYOND = 2.0  # ranges of the samples around it that a spike reaches
_TOGETHER = 0.05  # s, and one and a half steps: jumps of other channels that are the same event
_SWITCHED = 0.25  # s after a change of mode: another loop takes over with a command of its own
_INERTIAL = (*RATES, "ax", "ay", "az")
_OTHERS = ("_imu2", "_imu3")
"""Ends of the channels of other sensors than the first."""
_FELT = 2
"""Other channels of the inertial sensors that jump with one of them where the aircraft is shaken: two quantities, or
one that two sensors feel, as at a touch-down."""
_DERIVATIVES: Mapping[str, int] = {
    **dict.fromkeys((*VELOCITY, "vx", "vy", "vz"), 1),
    **dict.fromkeys((*POSITION, *ATTITUDE, "attitude"), 2),
}
"""How often a channel is differentiated until it is an acceleration."""
Changes = tuple[Array, Array]
"""Stamps [s], shape (n,), and what changes between them, shape (components, n - 1)."""


def attitudes(flight: Flight) -> dict[str, tuple[str, ...]]:
    """The channels that are one attitude together, by the name under which its jumps are told."""
    groups = {"attitude": QUATERNION}
    ends = ("", *(f"_{variant}" for variant in VARIANTS if variant != "demand"))
    groups |= {f"angles{end}": tuple(f"{name}{end}" for name in ATTITUDE) for end in ends}
    complete = {name: group for name, group in groups.items() if all(channel in flight for channel in group)}
    return {name: group for name, group in complete.items() if len({flight.stream_of(each) for each in group}) == 1}


def jumps(flight: Flight, beside: Flight | None = None) -> dict[str, int]:
    """How many jumps a channel or an attitude has, of those that have some. A spike is two: there and back.

    Args:
        beside: whose inertial sensors tell of a shaken aircraft too, where `flight` is a part of it.
    """
    groups = attitudes(flight)
    grouped = {channel for group in groups.values() for channel in group}
    names = [*groups, *(name for name in flight.channels if name not in grouped)]
    inertial = {name: flight for name in names if _base(name) in _INERTIAL}
    if beside is not None:
        inertial |= {n: beside for n in beside.channels if _base(n) in _INERTIAL and n not in names}
    felt = {}
    for name, source in inertial.items():
        time, rows = _steps(source, name)
        if (out := _outstanding(rows)).any():
            felt[name] = time[1:][out]
    counts = {}
    for name in names:  # one at a time: a long log has no room for the changes of all
        changes = _turns(flight, groups[name]) if name in groups else _steps(flight, name)
        out = _outstanding(changes[1])
        if out.any():
            jumped = out & _impossible(changes, "attitude" if name in groups else _base(name))
            if name not in groups:
                of_law = name.startswith(("mixer_", "pid_")) or name.endswith("_demand")
                jumped |= _spikes(name, changes, out, felt, _changes_of_mode(flight) if of_law else np.empty(0))
            if count := int(np.sum(jumped)):
                counts[name] = count
    return counts


def _changes_of_mode(flight: Flight) -> Array:
    return np.array([event.time for event in flight.provenance.events if event.kind == "mode"])


def _base(name: str) -> str:
    """A channel's name without what says which sensor or message it is from."""
    first, _, variant = name.rpartition("_")
    return first if variant in VARIANTS and variant != "demand" else name


def _steps(flight: Flight, name: str) -> Changes:
    """The changes of a channel's finite samples."""
    time, values = flight.time(name), flight.values(name)
    good = np.isfinite(values)
    changes = np.diff(values[good])
    if _base(name) in ATTITUDE:  # a whole turn is no jump
        changes = np.remainder(changes + np.pi, 2.0 * np.pi) - np.pi
    return time[good], changes[None, :]


def _turns(flight: Flight, group: tuple[str, ...]) -> Changes:
    """The rotation from sample to sample [rad] about three axes, blind to flips of sign and to whole turns."""
    table, time = flight.array(group), flight.time(group[0])
    good = np.isfinite(table).all(axis=1)
    if not good.all():
        time, table = time[good], table[good]
    turned = np.empty((3, max(time.size - 1, 0)))
    for begin in range(0, turned.shape[1], _BLOCK):
        turned[:, begin : begin + _BLOCK] = _turned(group, table[begin : begin + _BLOCK + 1])
    return time, turned


def _turned(group: tuple[str, ...], table: Array) -> Array:
    """The rotations between samples of an attitude, shape (n, 3 or 4), about three axes [rad], shape (3, n - 1)."""
    quaternion = (table if group == QUATERNION else quaternion_from_euler(table)).T
    (w0, x0, y0, z0), (w1, x1, y1, z1) = quaternion[:, :-1], quaternion[:, 1:]
    sign = np.sign(w0 * w1 + x0 * x1 + y0 * y1 + z0 * z1)
    # Vector part of conj(q0) * q1, which is half the rotation vector where the step is small.
    turned = (
        sign * (w0 * x1 - x0 * w1 - y0 * z1 + z0 * y1),
        sign * (w0 * y1 - y0 * w1 - z0 * x1 + x0 * z1),
        sign * (w0 * z1 - z0 * w1 - x0 * y1 + y0 * x1),
    )
    return 2.0 * np.stack(turned)


def _outstanding(rows: Array) -> NDArray[np.bool_]:
    """Which changes stand out in any of their rows."""
    return np.asarray(np.any([_stands_out(row) for row in rows], axis=0))


def _stands_out(changes: Array) -> NDArray[np.bool_]:
    """Changes between samples that are far outside the scatter of all changes (Hampel's identifier on differences).

    The scatter is the larger of what half and what 95 % of the changes give: a channel that is held between the updates
    of a slower clock (and moves there by rounding only) is judged by its updates. One that hardly ever moves is not
    judged, and a change that is slight beside the channel's span is no jump. Nor is one that is usual among its
    neighbours: a sweep's changes grow with its frequency, all of them.
    """
    if not changes.size:
        return np.zeros(0, dtype=np.bool_)
    off = np.abs(changes - np.median(changes))
    sigma = max(_MAD_TO_SIGMA * float(np.median(off)), _Q95_TO_SIGMA * float(np.quantile(off, 0.95)))
    span = float(np.ptp(np.cumsum(changes)))
    if not sigma > np.finfo(np.float64).eps * span:
        return np.zeros(changes.shape, dtype=np.bool_)
    out = np.asarray(off > max(OUTLIER * sigma, _SLIGHT * span))
    for i in np.flatnonzero(out).tolist():
        out[i] = off[i] > _UNUSUAL * _MAD_TO_SIGMA * np.median(off[max(0, i - _NEAR) : i + _NEAR + 1])
    return out


def _impossible(changes: Changes, kind: str) -> NDArray[np.bool_]:
    """Changes that take an impossible acceleration, over their own step and beyond the motion around them."""
    time, rows = changes
    order = _DERIVATIVES.get(kind)
    if order is None:
        return np.zeros(rows.shape[1], dtype=np.bool_)
    steps = np.diff(time)
    steps = np.maximum(steps, np.median(steps))  # stamps that bunch are no acceleration
    most = _IMPOSSIBLE_TURN if kind in ("attitude", *ATTITUDE) else _IMPOSSIBLE
    beyond = np.zeros(rows.shape[1], dtype=np.bool_)
    for row in rows:  # one at a time, as the channels
        speed = row / steps
        if order == 2:
            from scipy.ndimage import median_filter  # a quarter of a second that a flight without jumps need not wait

            speed -= median_filter(speed, size=5, mode="nearest")
            speed /= steps
        beyond |= np.abs(speed) > most
    return beyond


def _spikes(
    name: str, changes: Changes, out: NDArray[np.bool_], felt: Mapping[str, Array], switched: Array
) -> NDArray[np.bool_]:
    """Jumps that one of the next samples takes back, far out of the samples around them, and that were not felt.

    None begins right after one of the times `switched`.
    """
    time, (row,) = changes
    values = np.concatenate([[0.0], np.cumsum(row)])
    spikes = np.zeros(out.shape, dtype=np.bool_)
    for k in np.flatnonzero(out).tolist():
        if np.any((time[k + 1] >= switched) & (time[k + 1] <= switched + _SWITCHED)):
            continue
        for back in range(k + 1, min(k + _BRIEF, row.size - 1) + 1):
            left = abs(float(np.sum(row[k : back + 1])))
            if out[back] and row[k] * row[back] < 0.0 and left < _TAKEN_BACK * abs(row[k]):
                around = np.concatenate([values[max(0, k - _NEAR) : k + 1], values[back + 1 : back + 1 + _NEAR]])
                low, high = np.quantile(around, (0.05, 0.95))
                # A change is known at its later sample, and a channel of another rate knows of it up to a step away.
                reach = max(_TOGETHER, 1.5 * float(time[back + 1] - time[k]))
                if abs(row[k]) > _BEYOND * (high - low) and not _shaken(name, float(time[k + 1]), reach, felt):
                    spikes[[k, back]] = True
                break
    return spikes


def _shaken(name: str, at: float, reach: float, felt: Mapping[str, Array]) -> bool:
    """Whether the inertial sensors jump with a channel: any for a command, another sensor or two others for theirs."""
    base = _base(name)
    together = [other for other, times in felt.items() if np.any(np.abs(times - at) <= reach)]
    if base not in _INERTIAL:
        return bool(together)
    again = any(_base(other) == base and other.endswith(_OTHERS) != name.endswith(_OTHERS) for other in together)
    return again or sum(_base(other) != base for other in together) >= _FELT
