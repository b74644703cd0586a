"""Servos: a lag with a rate limit and stops."""

from __future__ import annotations

from swashplate.physics.backend import Backend, Scalar


def servo_rate(
    position: Scalar, command: Scalar, *, time_constant: Scalar, fastest: Scalar, low: Scalar, high: Scalar, xp: Backend
) -> Scalar:
    """Speed of a servo towards a command that its stops [low, high] cut, at most `fastest` (units of it per second)."""
    wanted = xp.minimum(high, xp.maximum(low, command))
    return xp.maximum(-fastest, xp.minimum(fastest, (wanted - position) / time_constant))
