"""Drag and damping of the fuselage (Fankhauser et al., eq. 7) with the vertical and yaw terms that the paper drops."""

from __future__ import annotations

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Vector


def drag_force(
    air_velocity: Vector, *, drag_x: Scalar, drag_y: Scalar, drag_z: Scalar, damping_w: Scalar, xp: Backend
) -> Vector:
    """Force against the motion through the air [N] (Fankhauser et al., eq. 7).

    `drag_*` [kg/m] is quadratic, `damping_w` [N s/m] linear. `drag_z` and `damping_w` (the loss of thrust in
    climb, lumped) are zero in the paper.
    """
    u, v, w = air_velocity
    return Vector(-drag_x * u * xp.abs(u), -drag_y * v * xp.abs(v), -drag_z * w * xp.abs(w) - damping_w * w)


def yaw_damping_moment(r: Scalar, damping_r: Scalar) -> Vector:
    """Moment against the yaw rate [N m], `damping_r` [N m s]; zero in the paper.

    Rotors held at a speed against the fuselage meet the air faster or slower by r: with T = k_Q Omega^2 on each this
    gives 2 (k_Q,up Omega_up + k_Q,lw Omega_lw), the value to start from.
    """
    return Vector(0.0, 0.0, -damping_r * r)


def flat_plate_drag(air_velocity: Vector, downwash: Scalar, *, areas: Vector, density: Scalar, xp: Backend) -> Vector:
    """Drag [N] of a fuselage by its equivalent flat plates [m^2], in the main rotor's wake (Gavrilets et al. 2001).

    `downwash` [m/s] is the rotor's induced velocity; the force acts at the CG.
    """
    u, v, w = air_velocity
    through = w - downwash
    speed = xp.sqrt(u * u + v * v + through * through + 1e-9)
    pressure = -0.5 * density * speed
    return Vector(pressure * areas.x * u, pressure * areas.y * v, pressure * areas.z * through)
