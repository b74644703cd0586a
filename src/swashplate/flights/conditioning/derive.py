"""Body velocities, rates and specific force from position and attitude.

The differentiator is a local polynomial (Savitzky and Golay 1964) of degree four through five samples: its gain is
0.998 at 8 Hz and 0.98 at 15 Hz of 100 Hz, so that what is derived has been filtered exactly as what it comes from.
"""

from __future__ import annotations

import math

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import attitude_of, to_body, with_euler
from swashplate.flights.conditioning.filters import by_segment, uniform_rate
from swashplate.flights.flight import Flight
from swashplate.flights.schema import POSITION, RATES, VELOCITY

GRAVITY = 9.80665  # m/s^2, standard; position data cannot tell it from a vertical bias
_POINTS, _DEGREE = 5, 4


def _weights(order: int) -> Array:
    """The derivative at each of five points one apart, of the polynomial through them, from the values there (5, 5)."""
    place = np.arange(_POINTS, dtype=np.float64)
    powers = np.vander(place, increasing=True)
    derived = np.zeros_like(powers)
    factor = np.array([math.perm(k, order) for k in range(order, _POINTS)], dtype=np.float64)
    derived[:, order:] = factor * powers[:, : _POINTS - order]
    return np.asarray(derived @ np.linalg.inv(powers), dtype=np.float64)


_WEIGHTS = {order: _weights(order) for order in (1, 2)}


def differentiate(values: Array, *, rate: float, order: int = 1) -> Array:
    """Time derivative of a uniform record, shape (n,) or (n, m), along the first axis; one-sided at the ends.

    Args:
        values: at least five samples.
        rate: [Hz].
        order: 1 or 2.
    """
    if values.shape[0] < _POINTS:
        raise FlightError(f"{values.shape[0]} samples cannot be differentiated, expected at least {_POINTS}.")
    at = np.asarray(values, dtype=np.float64)
    weights = _WEIGHTS[order] * rate**order
    half, last = _POINTS // 2, at.shape[0] - _POINTS + 1
    inner = sum(weight * at[k : k + last] for k, weight in enumerate(weights[half]))
    ends = weights[:half] @ at[:_POINTS], weights[half + 1 :] @ at[-_POINTS:]
    return np.concatenate([ends[0], inner, ends[1]])


def body_rates(quaternion: Array, *, rate: float) -> Array:
    """p, q, r [rad/s], shape (n, 3), from continuous unit quaternions: omega = 2 q* qdot (Stevens and Lewis 2003)."""
    dot = differentiate(quaternion, rate=rate)
    w, v = quaternion[:, :1], quaternion[:, 1:]
    return np.asarray(2.0 * (w * dot[:, 1:] - v * dot[:, :1] - np.cross(v, dot[:, 1:])), dtype=np.float64)


def derive(flight: Flight, *, gravity: float | None = None) -> Flight:
    """The flight with phi theta psi, u v w, p q r and the specific force ax ay az of the tracked point.

    Channels that the log already has (gyroscopes, accelerometers) stay; the history says which were derived.

    Args:
        flight: one uniform stream with position and attitude (or attitude alone: then only angles and rates).
        gravity: [m/s^2]; where it is None the flight's own, and standard gravity where that is not known. The history
            says which.

    Raises:
        FlightError: no attitude, or a segment below five samples.
    """
    rate = uniform_rate(flight)
    like = flight.channels[0]
    taken = next((one for one in (gravity, flight.gravity) if one is not None), GRAVITY)
    assumed = flight.gravity is None and taken == GRAVITY
    names: list[str] = []
    q = attitude_of(flight)
    out = with_euler(flight)
    derived: dict[str, Array] = {}
    omega = by_segment(flight, q, lambda part: _padded(part, rate))
    derived.update(zip(RATES, omega[:, :3].T, strict=True))
    if all(name in flight for name in POSITION):
        position = flight.array(POSITION)
        velocity = by_segment(flight, position, lambda part: differentiate(part, rate=rate))
        acceleration = by_segment(flight, position, lambda part: differentiate(part, rate=rate, order=2))
        force = to_body(q, acceleration - np.array([0.0, 0.0, taken]))
        derived.update(zip(VELOCITY, to_body(q, velocity).T, strict=True))
        derived.update(zip(("ax", "ay", "az"), force.T, strict=True))
    for name, values in derived.items():
        if name not in flight:
            out = out.with_channel(name, values, like=like)
            names.append(name)
    return out.done("derive", gravity=taken, assumed=assumed, derived=names, points=_POINTS, degree=_DEGREE)


def _padded(quaternion: Array, rate: float) -> Array:
    """Body rates in the first three of four columns: `by_segment` keeps the width."""
    return np.column_stack([body_rates(quaternion, rate=rate), np.zeros(quaternion.shape[0])])
