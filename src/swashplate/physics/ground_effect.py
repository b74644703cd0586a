"""A rotor near the ground: its thrust at the same power, and what is left of its induced flow."""

from __future__ import annotations

from swashplate.physics.backend import Backend, Scalar

FORMS = ("none", "cheeseman-bennett", "hayden")
_NEAREST = 0.5
"""Height over radius below which neither form holds; nearer than this, they stay at their value there."""
_TINY = 1e-12


def thrust_gain(height: float, *, radius: float) -> float:
    """Thrust near the ground over thrust in free air, at the same power, in hover.

    Args:
        height: of the rotor above the ground [m], at least half the radius.
        radius: of the rotor [m].

    Source: Cheeseman and Bennett (1955), ARC R&M 3021: T / T_free = 1 / (1 - (R / 4z)^2), an image source's inflow. It
    is for one rotor; for a coaxial pair take the lower one's height.
    """
    ratio = radius / (4.0 * max(height, _NEAREST * radius))
    return 1.0 / (1.0 - ratio * ratio)


def induced_share(
    height: Scalar, across2: Scalar, induced: Scalar, *, radius: Scalar, form: str, xp: Backend
) -> Scalar:
    """Induced velocity near the ground over that in free air, at the same thrust; 1 far away and in fast flight.

    "cheeseman-bennett" is (1 - (R / 4z)^2)^(3/2), with which the thrust at the same induced power is `thrust_gain`
    (1955); "hayden" is the fit to flights of many helicopters 1 / (0.9926 + 0.0379 (2R / z)^2), at most 1 (Hayden
    1976). Both fade with the speed V across the disc by Cheeseman and Bennett's 1 / (1 + (V / v)^2), the wake being
    blown away.

    Args:
        height: of the rotor above the ground [m].
        across2: V^2, the square of the air's speed along the disc [m^2/s^2].
        induced: v, the induced velocity in free air [m/s].
        radius: of the rotor [m].
        form: one of `FORMS`.
        xp: the operations.
    """
    if form == "none":
        return 1.0
    ratio = radius / xp.maximum(height, _NEAREST * radius)
    if form == "hayden":
        hover = xp.minimum(1.0, 1.0 / (0.9926 + 0.1516 * ratio * ratio))
    else:
        kept = 1.0 - 0.0625 * ratio * ratio
        hover = kept * xp.sqrt(kept)
    squared = induced * induced + _TINY
    return 1.0 - (1.0 - hover) * squared / (squared + across2)
