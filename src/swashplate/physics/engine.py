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


def wanted_share(state: RotorSpeed, *, wanted: Scalar, gain: Scalar, xp: Backend) -> Scalar:
    """The share of the engine's power that the governor asks for, 0 to 1.

    Args:
        state: speed and integral.
        wanted: governed speed [rad/s].
        gain: share of the power per relative speed error.
    """
    share = state.governor + gain * (1.0 - state.omega / wanted)
    return xp.minimum(1.0, xp.maximum(0.0, share))


def engine_torque(state: RotorSpeed, share: Scalar, *, wanted: Scalar, power: Scalar, xp: Backend) -> Scalar:
    """Torque on the main shaft [N m] of a share of the largest power [W], never negative."""
    # An engine gives its torque, not its power, to a rotor that stands still.
    return share * power / xp.maximum(state.omega, 0.3 * wanted)


def rotor_speed_rates(
    state: RotorSpeed,
    torque: Scalar,
    load: Scalar,
    *,
    wanted: Scalar,
    inertia: Scalar,
    integral_gain: Scalar,
    xp: Backend,
) -> RotorSpeed:
    """Rates [rad/s^2, 1/s] under the engine's `torque` and the `load` of both rotors at the main shaft [N m]."""
    error = 1.0 - state.omega / wanted
    full, empty = state.governor >= 1.0, state.governor <= 0.0
    moving = integral_gain * error
    held = xp.where(full, xp.minimum(moving, 0.0), xp.where(empty, xp.maximum(moving, 0.0), moving))
    return RotorSpeed((torque - load) / inertia, held)
