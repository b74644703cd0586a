"""Motor, gear and rotor as a first-order lag (Fankhauser et al., sec. III-C3)."""

from __future__ import annotations

from swashplate.physics.backend import Scalar


def steady_speed(motor: Scalar, voltage: Scalar, *, k: Scalar, o: Scalar, k_voltage: Scalar, nominal: Scalar) -> Scalar:
    """Rotor speed [rad/s] that a motor command and a battery voltage hold (Fankhauser et al., eq. 22)."""
    return k * motor + o + k_voltage * (voltage - nominal)


def drive_train_rate(omega: Scalar, steady: Scalar, tau_drive: Scalar) -> Scalar:
    """Rotor acceleration [rad/s^2] towards the steady speed (Fankhauser et al., eq. 15)."""
    return (steady - omega) / tau_drive
