"""The single-rotor helicopter: main rotor with tip-path plane, tail rotor, tails, fuselage, and what drives them.

After Bhandari et al. (2005), with what that paper leaves for later: the nonlinear equations behind its stability
derivatives, the stabilizer bar and forward flight. Signs and symbols: `physics.blade_element`. A rotor that
turns clockwise from above is the mirror image: lateral quantities go in and come out multiplied by `rotation`.
"""

from __future__ import annotations

from typing import NamedTuple

from swashplate.models.conventional import drive
from swashplate.models.conventional.airframe import airframe
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.models.conventional.main_rotor import Contribution, MainRotor, main_rotor
from swashplate.physics import bell_hiller, ground_contact
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.bell_hiller import Bar
from swashplate.physics.engine import EngineLag, RotorSpeed
from swashplate.physics.environment import Environment
from swashplate.physics.flapping import Flapping
from swashplate.physics.frames import Vector, local_to_body
from swashplate.physics.ground_contact import Grip
from swashplate.physics.inflow import Inflow
from swashplate.physics.rigid_body import Inertia, RigidBody, gravity, rigid_body_rates

_SLOWEST = 0.1
"""Share of the governed speed below which coefficients no longer change, and loads fade with the speed squared."""


class Controls(NamedTuple):
    """Main rotor collective, longitudinal (forward positive) and lateral (right positive) cyclic, tail collective."""

    theta0: Scalar
    B1: Scalar
    A1: Scalar
    theta0T: Scalar


class EngineControls(NamedTuple):
    """The same and the throttle: 1 for governed flight, 0 for autorotation."""

    theta0: Scalar
    B1: Scalar
    A1: Scalar
    theta0T: Scalar
    throttle: Scalar


class YawGyro(NamedTuple):
    """The yaw gyro's filtered yaw rate [rad/s]."""

    r_gyro: Scalar


class ServoPositions(NamedTuple):
    """Where the servos stand, in the units of the controls [rad]."""

    theta0_servo: Scalar
    B1_servo: Scalar
    A1_servo: Scalar
    theta0T_servo: Scalar


class Delays(NamedTuple):
    """The delayed commands' states: place [rad] and rate [rad/s] of each (`actuators.delayed`)."""

    theta0_late: Scalar
    B1_late: Scalar
    A1_late: Scalar
    theta0T_late: Scalar
    theta0_late_rate: Scalar
    B1_late_rate: Scalar
    A1_late_rate: Scalar
    theta0T_late_rate: Scalar


class HelicopterState(NamedTuple):
    """Rigid body and tip-path plane, and the optional parts: None where they are left out."""

    body: RigidBody
    disc: Flapping
    bar: Bar | None
    inflow: Inflow | None
    rotor: RotorSpeed | None
    gyro: YawGyro | None
    servos: ServoPositions | None
    delays: Delays | None
    engine: EngineLag | None
    grip: Grip | None


class HelicopterLoads(NamedTuple):
    """What acts on the fuselage by contributor, and how the moving parts move."""

    main_rotor: Contribution
    tail_rotor: Contribution
    tailplane: Contribution
    fin: Contribution
    fuselage: Contribution
    ground: Contribution | None
    disc: Flapping
    bar: Bar | None
    inflow: Inflow | None
    rotor: RotorSpeed | None
    gyro: YawGyro | None
    servos: ServoPositions | None
    delays: Delays | None
    engine: EngineLag | None
    grip: Grip | None
    induced: Scalar
    power: Scalar
    main: MainRotor

    def contributions(self) -> dict[str, Contribution]:
        """The contributors that there are, by name."""
        named = {name: getattr(self, name) for name in CONTRIBUTORS}
        return {name: part for name, part in named.items() if part is not None}


CONTRIBUTORS = ("main_rotor", "tail_rotor", "tailplane", "fin", "fuselage", "ground")


def loads(
    state: HelicopterState, inputs: Named, par: Named, env: Environment, xp: Backend, *, options: HelicopterOptions
) -> HelicopterLoads:
    """Forces and moments on the fuselage by contributor, without gravity, and the rates of everything that moves."""
    body = state.body
    sense, density = options.sense, env.air_density
    air = body.velocity + local_to_body(env.wind, body.attitude, xp).scaled(-1.0)
    p, q, r = body.rates

    # Controls: delay, servos, yaw gyro, stabilizer bar.
    sticks = Controls(inputs.theta0, inputs.B1, inputs.A1, inputs.theta0T)
    servo_rates, delay_rates = None, None
    if state.delays is not None:
        delay_rates, sticks = drive.delayed_commands(state.delays, sticks, par.servo_delay)
    if state.servos is not None:
        stops = (
            (par.collective_low, par.collective_high),
            (-par.cyclic_limit, par.cyclic_limit),
            (-par.cyclic_limit, par.cyclic_limit),
            (par.tail_low, par.tail_high),
        )
        servo_rates = drive.servo_rates(state.servos, sticks, stops, par, xp)
        sticks = Controls(*state.servos)
    tail_pitch, gyro_rates = sticks.theta0T, None
    if state.gyro is not None:
        tail_pitch = tail_pitch + sense * par.gyro_gain * state.gyro.r_gyro
        gyro_rates = YawGyro((r - state.gyro.r_gyro) / par.gyro_time)
    turning = par.rotor_speed if state.rotor is None else state.rotor.omega
    omega, blowing, fading = turning, 1.0, 1.0
    if state.rotor is not None:
        omega = xp.maximum(turning, _SLOWEST * par.rotor_speed)
        blowing = xp.minimum(1.0, turning / omega)  # rotors at rest have no wake
        fading = blowing * blowing
    A1, B1, bar_rates = sticks.A1, sticks.B1, None
    if state.bar is not None:
        lock = bell_hiller.bar_lock_number(
            density=density,
            lift_slope=par.bar_lift_slope,
            chord=par.bar_chord,
            inner=par.bar_inner,
            outer=par.bar_outer,
            inertia=par.bar_inertia,
        )
        bar_rates = bell_hiller.bar_rates(state.bar, p, q, A1, B1, lock=lock, omega=omega, cyclic=par.bar_cyclic)
        A1, B1 = bell_hiller.mixed_cyclic(A1, B1, state.bar, par.bar_gain)

    # Main rotor.
    height = par.hub_height * xp.cos(body.phi) * xp.cos(body.theta) - body.z
    rotor = main_rotor(
        air, body.rates, state.disc, state.inflow, (sticks.theta0, A1, B1), omega, par, density, xp, options, height
    )
    lifted = rotor.acting
    if state.rotor is not None:
        lifted = Contribution(lifted.force.scaled(fading), lifted.moment.scaled(fading))

    frame = airframe(
        air,
        body.rates,
        tail_pitch,
        blowing * rotor.induced,
        omega,
        (blowing, fading),
        par,
        density,
        xp,
        sense,
        sticks.theta0 if options.stabilator else None,
        tail_in_wake=options.tail_in_wake,
        cross_flow=options.cross_flow,
    )

    # Rotor speed, and the shaft's reaction on the fuselage beyond the rotors' own drag.
    load = fading * (rotor.torque + par.tail_gear * frame.tail_torque)
    rotor_rates, lag = None, None
    if state.rotor is not None:
        throttle = inputs.throttle if options.throttle else 1.0
        rotor_rates, lag = drive.shaft_rates(state.rotor, state.engine, load, throttle, par, xp)
        # Spinning up pushes back on the fuselage, as the drag torque does; yaw follows the engine's torque.
        back = sense * par.rotor_inertia * rotor_rates.omega
        tilt = Vector(-xp.sin(par.shaft_tilt) * back, 0.0, xp.cos(par.shaft_tilt) * back)
        lifted = Contribution(lifted.force, lifted.moment + tilt)
    touching, bending = None, None
    if options.ground:
        force, moment, bending = ground_contact.skid_loads(body, ground_contact.Skids.of(par), xp, state.grip)
        touching = Contribution(force, moment)
    return HelicopterLoads(
        lifted,
        frame.tail_rotor,
        frame.tailplane,
        frame.fin,
        frame.fuselage,
        touching,
        rotor.disc,
        bar_rates,
        rotor.inflow,
        rotor_rates,
        gyro_rates,
        servo_rates,
        delay_rates,
        lag,
        bending,
        rotor.induced,
        load * turning,
        rotor,
    )


def _sum(acting: HelicopterLoads) -> Contribution:
    force, moment = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    for part in acting.contributions().values():
        force, moment = force + part.force, moment + part.moment
    return Contribution(force, moment)


def derivatives(
    state: HelicopterState, inputs: Named, par: Named, env: Environment, xp: Backend, *, options: HelicopterOptions
) -> HelicopterState:
    """Time derivative of the whole state (Bhandari et al. 2005, eqs 1 to 6, with the components of `physics`)."""
    acting = loads(state, inputs, par, env, xp, options=options)
    total = _sum(acting)
    inertia = Inertia(par.mass, par.inertia_xx, par.inertia_yy, par.inertia_zz, par.inertia_xz)
    force = total.force + gravity(par.mass, env.gravity, state.body.attitude, xp)
    return HelicopterState(
        rigid_body_rates(state.body, force, total.moment, inertia, xp),
        acting.disc,
        acting.bar,
        acting.inflow,
        acting.rotor,
        acting.gyro,
        acting.servos,
        acting.delays,
        acting.engine,
        acting.grip,
    )


def specific_force(
    state: HelicopterState, inputs: Named, par: Named, env: Environment, xp: Backend, *, options: HelicopterOptions
) -> Vector:
    """What an accelerometer at the CG reads [m/s^2]: every force but gravity, per mass."""
    return _sum(loads(state, inputs, par, env, xp, options=options)).force.scaled(1.0 / par.mass)
