"""Height and heading of a coaxial helicopter on its two motors.

Height is held by a PI controller with climb-rate damping whose thrust is raised by what the lean takes from it
(Fankhauser et al., sec. V, coupling effect 1), heading by a PI controller with rate damping. Wanted thrust and yaw
torque become rotor speeds by the exact inverse of the two rotors' thrust and torque laws (eqs 3, 4), and motor commands
by that of the drive train with the measured battery voltage (eq. 22).
"""

from __future__ import annotations

from typing import NamedTuple

from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.rigid_body import RigidBody

_LEAST_VERTICAL = 0.5
"""cos(phi) cos(theta) below which the thrust is no longer raised: 60 deg of lean."""


class HeightYawGains(NamedTuple):
    """Numbers of the two controllers.

    Attributes:
        height, climb, height_integral: wanted acceleration per height error [1/s^2], climb rate [1/s] and
            integral [1/s^3].
        yaw, yaw_rate, yaw_integral: the same for the heading.
        tilt_feedforward: 1 raises the thrust by 1 / (cos phi cos theta), 0 does not.
        least_load, greatest_load: bounds of the wanted thrust in weights.
        greatest_yaw: bound of the wanted angular acceleration [rad/s^2].
        soft_start: rate at which the motors' upper limit rises from zero [1/s]; 0 for none.
    """

    height: float = 2.0
    climb: float = 3.0
    height_integral: float = 0.4
    yaw: float = 6.0
    yaw_rate: float = 4.0
    yaw_integral: float = 2.0
    tilt_feedforward: float = 1.0
    least_load: float = 0.5
    greatest_load: float = 1.5
    greatest_yaw: float = 12.0
    soft_start: float = 0.0


class CoaxialRotors(NamedTuple):
    """What the inverse needs of a card; `k_voltage` = 0 leaves the battery uncompensated."""

    weight: float
    mass: float
    inertia_zz: float
    k_thrust_lower: float
    k_thrust_upper: float
    k_torque_lower: float
    k_torque_upper: float
    k_drive_lower: float
    o_drive_lower: float
    k_drive_upper: float
    o_drive_upper: float
    k_voltage: float
    voltage_nominal: float


class HeightYawMemory(NamedTuple):
    """Integrals of height and heading error [m s, rad s], and how far the motors may go (soft start)."""

    height: Scalar
    heading: Scalar
    spool: Scalar


class Motors(NamedTuple):
    """Motor commands 0 to 1."""

    lower: Scalar
    upper: Scalar


def coaxial_rotors(vehicle: Vehicle, *, gravity: float, battery: bool = True) -> CoaxialRotors:
    """The inverse's numbers from a card; without `battery` the voltage is taken for nominal."""
    card = vehicle.card.values()
    given = {name: card[name] for name in CoaxialRotors._fields if name in card}
    return CoaxialRotors(**given, weight=card["mass"] * gravity, k_voltage=card["k_drive_voltage"] if battery else 0.0)


def motors_for(thrust: Scalar, torque: Scalar, voltage: Scalar, rotors: Named, xp: Backend) -> Motors:
    """Steady motor commands for a thrust [N] and a yaw torque [N m, nose right], without limits.

    From T = kT_lw Om_lw^2 + kT_up Om_up^2 and N = kQ_up Om_up^2 - kQ_lw Om_lw^2 (eqs 3, 4) and eq. 22.
    """
    r = rotors
    determinant = r.k_thrust_lower * r.k_torque_upper + r.k_thrust_upper * r.k_torque_lower
    lower = (r.k_torque_upper * thrust - r.k_thrust_upper * torque) / determinant
    upper = (r.k_torque_lower * thrust + r.k_thrust_lower * torque) / determinant
    lost = r.k_voltage * (voltage - r.voltage_nominal)
    return Motors(
        (xp.sqrt(xp.maximum(lower, 0.0)) - r.o_drive_lower - lost) / r.k_drive_lower,
        (xp.sqrt(xp.maximum(upper, 0.0)) - r.o_drive_upper - lost) / r.k_drive_upper,
    )


def thrust_and_torque(motors: Motors, voltage: Scalar, rotors: Named, xp: Backend) -> tuple[Scalar, Scalar]:
    """Thrust [N] and yaw torque [N m] that motor commands hold (the forward direction of `motors_for`)."""
    r = rotors
    gained = r.k_voltage * (voltage - r.voltage_nominal)
    lower = xp.maximum(r.k_drive_lower * motors.lower + r.o_drive_lower + gained, 0.0)
    upper = xp.maximum(r.k_drive_upper * motors.upper + r.o_drive_upper + gained, 0.0)
    thrust = r.k_thrust_lower * lower * lower + r.k_thrust_upper * upper * upper
    return thrust, r.k_torque_upper * upper * upper - r.k_torque_lower * lower * lower


def _between(value: Scalar, low: Scalar, high: Scalar, xp: Backend) -> Scalar:
    return xp.minimum(xp.maximum(value, low), high)


def height_yaw_step(
    memory: HeightYawMemory,
    body: RigidBody,
    voltage: Scalar,
    *,
    z: Scalar,
    psi: Scalar,
    gains: Named,
    rotors: Named,
    dt: Scalar,
    xp: Backend,
) -> tuple[HeightYawMemory, Motors]:
    """One step of both controllers.

    Args:
        memory: integrals and soft start.
        body: measured; of it z, u, v, w, phi, theta, psi and r are used.
        voltage: the battery's [V].
        z, psi: height (down positive) [m] and heading [rad] to hold.
        gains, rotors: `HeightYawGains`, `CoaxialRotors`.
        dt: sample time [s].
        xp: the operations.

    The integrals are driven by the error less what the limits kept back (back-calculation), and rest during the soft
    start: they do not wind up.
    """
    g, r = gains, rotors
    c_phi, s_phi = xp.cos(body.phi), xp.sin(body.phi)
    c_theta, s_theta = xp.cos(body.theta), xp.sin(body.theta)
    vertical = xp.maximum(c_phi * c_theta, _LEAST_VERTICAL)
    vertical = 1.0 + g.tilt_feedforward * (vertical - 1.0)

    # Height: acceleration upwards, as thrust along the body's axis
    too_low = body.z - z
    upwards = s_theta * body.u - c_theta * (s_phi * body.v + c_phi * body.w)
    up = g.height * too_low - g.climb * upwards + g.height_integral * memory.height
    thrust = (r.weight + r.mass * up) / vertical

    # Heading: the shorter way round
    turn = xp.atan2(xp.sin(psi - body.psi), xp.cos(psi - body.psi))
    around = g.yaw * turn - g.yaw_rate * body.r + g.yaw_integral * memory.heading
    torque = r.inertia_zz * _between(around, -g.greatest_yaw, g.greatest_yaw, xp)

    # Motors within their limits, and what they then give
    wanted = motors_for(
        _between(thrust, g.least_load * r.weight, g.greatest_load * r.weight, xp), torque, voltage, r, xp
    )
    spool = xp.minimum(xp.where(g.soft_start > 0.0, memory.spool + g.soft_start * dt, 1.0), 1.0)
    motors = Motors(_between(wanted.lower, 0.0, spool, xp), _between(wanted.upper, 0.0, spool, xp))
    given_thrust, given_torque = thrust_and_torque(motors, voltage, r, xp)
    kept_up = given_thrust * vertical / r.mass - r.weight / r.mass - up
    kept_around = given_torque / r.inertia_zz - around

    running = xp.where(spool < 1.0, 0.0, dt)
    after = HeightYawMemory(
        memory.height + running * (too_low + kept_up / g.height),
        memory.heading + running * (turn + kept_around / g.yaw),
        spool,
    )
    return after, motors
