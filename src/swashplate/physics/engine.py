"""Rotor speed: an engine under a governor through a free-wheel (Gavrilets, Mettler and Feron 2001, sec. 3.3)."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar


class RotorSpeed(NamedTuple):
    """Main rotor speed [rad/s] and the governor's integral, a share of the engine's power."""

    omega: Scalar
    governor: Scalar


class EngineLag(NamedTuple):
    """The share of its power that an engine gives, which comes later than the governor asks for it."""

    share: Scalar


_LEAK = 1e-3
"""How much slower than it moves an integral that stands leaks, so that a slope remains for Newton's method."""


def _asked(state: RotorSpeed, wanted: Scalar, gain: Scalar) -> tuple[Scalar, Scalar]:
    """The relative speed error, and the share that the governor asks for before its limits."""
    error = 1.0 - state.omega / wanted
    return error, state.governor + gain * error


def wanted_share(state: RotorSpeed, *, wanted: Scalar, gain: Scalar, xp: Backend) -> Scalar:
    """The share of the engine's power that the governor asks for, 0 to 1.

    Args:
        state: speed and integral.
        wanted: governed speed [rad/s].
        gain: share of the power per relative speed error.
    """
    return xp.minimum(1.0, xp.maximum(0.0, _asked(state, wanted, gain)[1]))


def engine_torque(state: RotorSpeed, share: Scalar, *, wanted: Scalar, power: Scalar, xp: Backend) -> Scalar:
    """Torque on the main shaft [N m] of a share of the largest power [W], never negative."""
    # An engine gives its torque, not its power, to a rotor that stands still.
    return share * power / xp.maximum(state.omega, 0.3 * wanted)


def rotor_speed_rates(
    state: RotorSpeed,
    torque: Scalar,
    load: Scalar,
    throttle: Scalar,
    *,
    wanted: Scalar,
    inertia: Scalar,
    gain: Scalar,
    integral_gain: Scalar,
    xp: Backend,
) -> RotorSpeed:
    """Rates [rad/s^2, 1/s] under the engine's `torque` and the `load` of both rotors at the main shaft [N m].

    The integral does not wind up: it stands while the governor already asks for all or nothing and the speed error
    would push it further, and as far as the throttle is closed (Astrom and Hagglund 2006, sec. 3.5).
    """
    error, share = _asked(state, wanted, gain)
    moving, leaking = throttle * integral_gain * error, -_LEAK * integral_gain * state.governor
    full, empty = share >= 1.0, share <= 0.0
    stopped = xp.where(full, xp.minimum(moving, leaking), xp.where(empty, xp.maximum(moving, leaking), moving))
    return RotorSpeed((torque - load) / inertia, stopped)
