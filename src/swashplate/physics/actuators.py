"""Servos: a pure delay, and a lag with a rate limit and stops."""

from __future__ import annotations

from swashplate.physics.backend import Backend, Scalar


def servo_rate(
    position: Scalar, command: Scalar, *, time_constant: Scalar, fastest: Scalar, low: Scalar, high: Scalar, xp: Backend
) -> Scalar:
    """Speed of a servo towards a command that its stops [low, high] cut, at most `fastest` (units of it per second)."""
    wanted = xp.minimum(high, xp.maximum(low, command))
    return xp.maximum(-fastest, xp.minimum(fastest, (wanted - position) / time_constant))


def delayed(place: Scalar, rate: Scalar, *, delay: Scalar) -> Scalar:
    """A command `delay` seconds late, by the Pade approximant with one zero and two poles.

    exp(-s T) = (1 - s T/3) / (1 + 2 s T/3 + s^2 T^2/6): nothing of a step comes through at once, and the phase is right
    within 0.5 deg up to a frequency of 1/T rad/s (Golub and Van Loan 2013, sec. 9.3.1).
    """
    return place - delay / 3.0 * rate


def delay_rates(place: Scalar, rate: Scalar, command: Scalar, *, delay: Scalar) -> tuple[Scalar, Scalar]:
    """Rates of the two states of `delayed`."""
    return rate, (6.0 * (command - place) / delay - 4.0 * rate) / delay
