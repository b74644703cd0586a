"""The CoaX micro helicopter: 18 states, 4 inputs, in the order of the paper's block diagram.

Fankhauser, Bouabdallah, Leutenegger and Siegwart, "Modeling and Decoupling Control of the CoaX Micro Helicopter",
eqs 1 to 18 and Fig. 3. Every block of the figure is one function of `swashplate.physics`; this file only joins them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from swashplate.physics import drive_train, fuselage, rotor, stabilizer_bar, swashplate
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector, euler_rates, local_to_body
from swashplate.physics.rigid_body import Inertia, RigidBody, gravity, rigid_body_rates
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.stabilizer_bar import StabilizerBar

_SLOWEST = 0.1
"""Share of the full speed below which a rotor takes up less than a whole tilt."""
SENSE_LOWER, SENSE_UPPER = +1.0, -1.0
"""Sense of rotation about body z (down): the lower rotor turns clockwise seen from above."""

UNITS: dict[str, str] = {
    "mass": "kg",
    "inertia_xx": "kg m^2",
    "inertia_yy": "kg m^2",
    "inertia_zz": "kg m^2",
    "hub_height_upper": "m",
    "hub_height_lower": "m",
    "rotor_radius": "m",
    "air_density": "kg/m^3",
    "k_thrust_upper": "N s^2/rad^2",
    "k_thrust_lower": "N s^2/rad^2",
    "k_torque_upper": "N m s^2/rad^2",
    "k_torque_lower": "N m s^2/rad^2",
    "hub_stiffness_upper": "N m/rad",
    "hub_stiffness_lower": "N m/rad",
    "linkage_upper": "1",
    "linkage_lower": "rad",
    "tau_f_upper": "s",
    "tau_f_lower": "s",
    "k_zeta_upper": "s",
    "o_zeta_upper": "rad",
    "k_zeta_lower": "s",
    "o_zeta_lower": "rad",
    "a_alpha_u": "rad s^2/m^2",
    "a_alpha_v": "rad s^2/m^2",
    "a_alpha_p": "rad s^2",
    "a_beta_u": "rad s^2/m^2",
    "a_beta_v": "rad s^2/m^2",
    "a_beta_q": "rad s^2",
    "a_alpha_u_linear": "rad s/m",
    "a_alpha_v_linear": "rad s/m",
    "a_alpha_p_linear": "rad s",
    "a_beta_u_linear": "rad s/m",
    "a_beta_v_linear": "rad s/m",
    "a_beta_q_linear": "rad s",
    "tau_drive_upper": "s",
    "tau_drive_lower": "s",
    "k_drive_upper": "rad/s",
    "o_drive_upper": "rad/s",
    "k_drive_lower": "rad/s",
    "o_drive_lower": "rad/s",
    "k_drive_voltage": "rad/s/V",
    "voltage_nominal": "V",
    "inertia_drive_upper": "kg m^2",
    "inertia_drive_lower": "kg m^2",
    "drag_x": "kg/m",
    "drag_y": "kg/m",
    "drag_z": "kg/m",
    "damping_w": "N s/m",
    "damping_r": "N m s",
    "gyroscopic": "1",
    "bar_heading_transport": "1",
    "design_angle_upper": "rad",
    "design_angle_lower": "rad",
    "linkage_asymmetry_lower": "1",
    "phase_asymmetry_lower": "rad",
    "linkage_asymmetry_upper": "1",
}
"""Every parameter and its unit, in the order of the equations' tuple."""

CoaxParameters = NamedTuple("CoaxParameters", [(name, Any) for name in UNITS])  # pyrefly: ignore[bad-class-definition]


class CoaxState(NamedTuple):
    """Rigid body, lower tip-path plane, stabilizer bar (None where it is taken off) and the two rotor speeds."""

    body: RigidBody
    lower: TipPathPlane
    bar: StabilizerBar | None
    drive: Drive


class Drive(NamedTuple):
    """Rotor speeds [rad/s]."""

    omega_lower: Scalar
    omega_upper: Scalar


class CoaxInputs(NamedTuple):
    """Motor commands 0 to 1 and servo commands -1 to 1 (roll: right positive, pitch: nose down positive)."""

    motor_lower: Scalar
    motor_upper: Scalar
    servo_roll: Scalar
    servo_pitch: Scalar


class CoaxialLoads(NamedTuple):
    """What acts on the fuselage, in body axes, how the moving parts move, and the thrusts of both rotors.

    Upper first: `planes`, the discs' tilts [rad], and `lift` [N] along their normals.
    """

    force: Vector
    moment: Vector
    lower: TipPathPlane
    bar: StabilizerBar | None
    drive: Drive
    planes: tuple[TipPathPlane, TipPathPlane]
    lift: tuple[Scalar, Scalar]


def _flap_response(par: Named) -> swashplate.FlapResponse:
    return swashplate.FlapResponse(*(getattr(par, name) for name in swashplate.FlapResponse._fields))


def _turning(omega: Scalar, full: Scalar, xp: Backend) -> Scalar:
    """Share of a tilt that a rotor takes up: 1 in flight, 0 at rest, where swashplate, bar and wind tilt no disc."""
    share = xp.minimum(1.0, xp.maximum(0.0, omega) / (_SLOWEST * full))  # eq. 22 is below zero for a motor off
    return share * share


def loads(
    state: CoaxState,
    inputs: CoaxInputs,
    par: Named,
    env: Environment,
    xp: Backend,
    *,
    mixing: str = "rotation",
) -> CoaxialLoads:
    """Force [N] and moment [N m] on the fuselage without gravity, and the rates of bar, lower rotor and drive trains.

    Bench and flight use this same function: the bench holds the body still.
    """
    body, lower, bar, drive = state
    density = env.air_density / par.air_density
    air = body.velocity + local_to_body(env.wind, body.attitude, xp).scaled(-1.0)

    # Drive trains (eqs 15, 22)
    steady_lower = drive_train.steady_speed(
        inputs.motor_lower,
        env.voltage,
        k=par.k_drive_lower,
        o=par.o_drive_lower,
        k_voltage=par.k_drive_voltage,
        nominal=par.voltage_nominal,
    )
    steady_upper = drive_train.steady_speed(
        inputs.motor_upper,
        env.voltage,
        k=par.k_drive_upper,
        o=par.o_drive_upper,
        k_voltage=par.k_drive_voltage,
        nominal=par.voltage_nominal,
    )
    drive_rates = Drive(
        drive_train.drive_train_rate(drive.omega_lower, steady_lower, par.tau_drive_lower),
        drive_train.drive_train_rate(drive.omega_upper, steady_upper, par.tau_drive_upper),
    )

    # Upper rotor and stabilizer bar (eqs 8 to 12)
    if bar is None:
        bar_rates, upper = None, TipPathPlane(0.0, 0.0)
    else:
        psi_dot = euler_rates(body.rates, body.attitude, xp).psi
        bar_rates = stabilizer_bar.stabilizer_bar_rates(
            bar,
            body.attitude,
            psi_dot,
            tau_f_upper=par.tau_f_upper,
            heading_transport=par.bar_heading_transport,
        )
        upper = stabilizer_bar.upper_tip_path_plane(
            bar,
            body.attitude,
            linkage=par.linkage_upper,
            lag=stabilizer_bar.phase_lag(par.k_zeta_upper, par.o_zeta_upper, drive.omega_upper),
            mixing=mixing,
            xp=xp,
            linkage_asymmetry=par.linkage_asymmetry_upper,
        )
        held = _turning(drive.omega_upper, par.k_drive_upper, xp)
        upper = TipPathPlane(held * upper.alpha, held * upper.beta)

    # Lower rotor and swashplate (eqs 13, 14, 21)
    commanded = swashplate.swashplate_tilt(
        inputs.servo_roll,
        inputs.servo_pitch,
        linkage=par.linkage_lower,
        lag=stabilizer_bar.phase_lag(par.k_zeta_lower, par.o_zeta_lower, drive.omega_lower),
        mixing=mixing,
        xp=xp,
        linkage_asymmetry=par.linkage_asymmetry_lower,
        phase_asymmetry=par.phase_asymmetry_lower,
    )
    held = _turning(drive.omega_lower, par.k_drive_lower, xp)

    # Forces and torques of the discs (eqs 1 to 7)
    lower_rates = swashplate.lower_rotor_rates(
        lower,
        commanded,
        air,
        body.rates,
        tau_f_lower=par.tau_f_lower,
        flap=_flap_response(par),
        turning=held,
        xp=xp,
    )
    normals = (rotor.thrust_direction(upper, xp), rotor.thrust_direction(lower, xp))
    lifts = (
        rotor.thrust(par.k_thrust_upper, drive.omega_upper, density),
        rotor.thrust(par.k_thrust_lower, drive.omega_lower, density),
    )
    torques = (
        rotor.drag_torque(par.k_torque_upper, drive.omega_upper, density),
        rotor.drag_torque(par.k_torque_lower, drive.omega_lower, density),
    )
    thrust_upper, thrust_lower = normals[0].scaled(lifts[0]), normals[1].scaled(lifts[1])
    on_hubs = (
        rotor.thrust_moment(thrust_upper, par.hub_height_upper),
        rotor.thrust_moment(thrust_lower, par.hub_height_lower),
        rotor.flapping_moment(par.hub_stiffness_upper, upper),
        rotor.flapping_moment(par.hub_stiffness_lower, lower),
    )
    drag = fuselage.drag_force(
        air, drag_x=par.drag_x, drag_y=par.drag_y, drag_z=par.drag_z, damping_w=par.damping_w, xp=xp
    ).scaled(density)
    shafts = (
        rotor.yaw_moment(torques[0], par.inertia_drive_upper, drive_rates.omega_upper, SENSE_UPPER),
        rotor.yaw_moment(torques[1], par.inertia_drive_lower, drive_rates.omega_lower, SENSE_LOWER),
    )
    others = (
        fuselage.yaw_damping_moment(body.r, par.damping_r),
        rotor.gyroscopic_moment(body.rates, par.gyroscopic * par.inertia_drive_upper, drive.omega_upper, SENSE_UPPER),
        rotor.gyroscopic_moment(body.rates, par.gyroscopic * par.inertia_drive_lower, drive.omega_lower, SENSE_LOWER),
    )
    moment = shafts[0]
    for part in (shafts[1], *on_hubs, *others):
        moment = moment + part
    return CoaxialLoads(
        thrust_upper + thrust_lower + drag, moment, lower_rates, bar_rates, drive_rates, (upper, lower), lifts
    )


def derivatives(
    state: CoaxState,
    inputs: CoaxInputs,
    par: Named,
    env: Environment,
    xp: Backend,
    *,
    mixing: str = "rotation",
) -> CoaxState:
    """Time derivative of the whole state (Fankhauser et al., eqs 1 to 17)."""
    acting = loads(state, inputs, par, env, xp, mixing=mixing)
    inertia = Inertia(par.mass, par.inertia_xx, par.inertia_yy, par.inertia_zz)
    force = acting.force + gravity(par.mass, env.gravity, state.body.attitude, xp)
    return CoaxState(
        rigid_body_rates(state.body, force, acting.moment, inertia, xp),
        acting.lower,
        acting.bar,
        acting.drive,
    )


def specific_force(
    state: CoaxState,
    inputs: CoaxInputs,
    par: Named,
    env: Environment,
    xp: Backend,
    *,
    mixing: str = "rotation",
) -> Vector:
    """What an accelerometer at the CG reads [m/s^2]: every force but gravity, per mass."""
    return loads(state, inputs, par, env, xp, mixing=mixing).force.scaled(1.0 / par.mass)
