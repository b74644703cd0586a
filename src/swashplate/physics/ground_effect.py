"""Thrust of a rotor near the ground."""

from __future__ import annotations


def thrust_gain(height: float, *, radius: float) -> float:
    """Thrust near the ground over thrust in free air, at the same power, in hover.

    Args:
        height: of the rotor above the ground [m], at least half the radius.
        radius: of the rotor [m].

    Source: Cheeseman and Bennett (1955), ARC R&M 3021: T / T_free = 1 / (1 - (R / 4z)^2), an image source's inflow. It
    is for one rotor; for a coaxial pair take the lower one's height.
    """
    ratio = radius / (4.0 * max(height, 0.5 * radius))
    return 1.0 / (1.0 - ratio * ratio)
