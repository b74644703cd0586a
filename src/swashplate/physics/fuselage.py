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


def slender_body_moment(
    air_velocity: Vector, downwash: Scalar, *, pitch: Scalar, yaw: Scalar, pitch_zero: Scalar, density: Scalar
) -> Vector:
    """Moment [N m] with which the air turns a slender body across its way (Munk 1924; Heffley and Mnich 1988).

    Munk's is a product of speeds, rho V (k2 - k1) u w for a body of volume V, and so smooth through hover and in every
    direction: M = rho/2 (pitch u w + pitch_zero u^2), N = -rho/2 yaw u v.

    Args:
        air_velocity, downwash: as in `flat_plate_drag`.
        pitch, yaw: [m^3], positive where they turn the body away from the air, as fuselages do: 2 V (k2 - k1), about
            twice the volume for a slender one.
        pitch_zero: [m^3], nose up, in air from straight ahead: camber, and drag that acts above or below the CG.
    """
    u, v, w = air_velocity
    half = 0.5 * density * u
    return Vector(0.0, half * (pitch * (w - downwash) + pitch_zero * u), -half * yaw * v)


def cross_flow_loads(
    air_velocity: Vector,
    downwash: Scalar,
    *,
    areas: Vector,
    pitch: Scalar,
    yaw: Scalar,
    pitch_zero: Scalar,
    density: Scalar,
    xp: Backend,
) -> tuple[Vector, Vector]:
    """Force [N] and moment [N m] of a long body whose numbers hold for air from ahead, in air from anywhere.

    Air that comes across a body separates from it and pushes it its own way (cross-flow principle, Allen and Perkins
    1951, NACA 1048). So the drag ahead has the speed ahead alone; a side speed turns the air of the downwash, which
    pushes with the area for air from below, not with the slope in air from ahead; and Munk's moments, which need
    attached flow, vanish across the body. The share of the slopes and moments is the square of the cosine of the angle
    between air and body. In air from ahead this is `flat_plate_drag` and `slender_body_moment`.

    Args: as of those two; areas.z is for air from below or above.
    """
    u, v, w = air_velocity
    through = w - downwash
    square = u * u + v * v + through * through + 1e-9
    ahead = u * u / square
    pressure = -0.5 * density * xp.sqrt(square)
    side = areas.z + ahead * (areas.y - areas.z)
    force = Vector(-0.5 * density * areas.x * xp.abs(u) * u, pressure * side * v, pressure * areas.z * through)
    moment = slender_body_moment(
        air_velocity, downwash, pitch=ahead * pitch, yaw=ahead * yaw, pitch_zero=pitch_zero, density=density
    )
    return force, moment
