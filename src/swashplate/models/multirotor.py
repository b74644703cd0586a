"""Equations of a multirotor: fixed-pitch rotors on arms, each on its motor, one battery, one rigid body.

The parts are those of the coaxial helicopter: rotor and drive train (Fankhauser et al., eqs 3 to 5, 15 and 22), drag,
rigid body. Three terms of a rotor's blades in its own air are added, linear about hover: thrust falls with the flow
through the disc, a force lies against the flow across it (rotor drag: Martin and Salauen 2010; Foerster 2015), and a
moment tilts the hub away from that flow (flap-back of stiff blades: Pounds, Mahony and Corke 2010). Because each rotor
meets the air where it is, they damp roll, pitch and heave without coefficients for that.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from swashplate.physics import drive_train, fuselage, rotor
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.frames import Vector, local_to_body
from swashplate.physics.rigid_body import Inertia, RigidBody, gravity, rigid_body_rates

LEAST_VOLTAGE = 0.2
"""Share of the battery's open-circuit voltage that its terminals keep: below it no current law holds."""


class Battery(NamedTuple):
    """What the terminals have lost to the internal resistance [V]."""

    voltage_sag: Scalar


class MotorWarmth(NamedTuple):
    """How warm the motors' windings are: 0 as before the start, 1 as in a long hover."""

    warmth: Scalar


class MultirotorState(NamedTuple):
    """Rigid body, rotor speeds (a named tuple omega_1 ...), the battery (None where its voltage is measured) and the
    motors (None where they are as strong cold as warm)."""

    body: RigidBody
    drive: Any
    battery: Battery | None
    motors: MotorWarmth | None = None


class MultirotorLoads(NamedTuple):
    """What acts on the body, in body axes, and how the moving parts move."""

    force: Vector
    moment: Vector
    drive: Any
    battery: Battery | None
    motors: MotorWarmth | None


def place(par: Named, number: int) -> Vector:
    """A rotor's place from the centre of gravity [m], numbered from 1."""
    return Vector(*(getattr(par, f"rotor_{number}_{axis}") for axis in "xyz"))


def steady_speed(par: Named, command: Scalar, voltage: Scalar) -> Scalar:
    """Speed [rad/s] that a command holds: eq. 22 with a command that is a share of the battery's voltage."""
    nominal = par.voltage_nominal
    share = command * voltage / nominal
    return drive_train.steady_speed(
        share, voltage, k=par.k_drive, o=par.o_drive, k_voltage=par.k_drive_voltage, nominal=nominal
    )


def faster_when_cold(par: Named, motors: MotorWarmth) -> Scalar:
    """Speed [rad/s] that motors add to `steady_speed` as long as they are not warm."""
    return par.o_cold * (1.0 - motors.warmth)


def warming(par: Named, motors: MotorWarmth, thrust: Scalar) -> Scalar:
    """Rate of the warmth [1/s] towards the square of the thrust over the weight.

    Current is torque, torque goes with thrust, and its square heats the windings. Their resistance rises by 0.4 % a
    kelvin (copper), and the speed that a voltage holds falls: linear about hover here, one warmth for all motors.
    """
    load = thrust / (par.mass * LABORATORY_GRAVITY)
    return (load * load - motors.warmth) / par.tau_warm


def speed_rates(
    par: Named, speeds: Any, commands: Named, voltage: Scalar, motors: MotorWarmth | None = None
) -> list[Scalar]:
    """Accelerations of the rotors [rad/s^2]: eq. 15, and slower for what all do alike.

    While rotors speed up together, their motors draw the current of it through one battery, whose voltage falls for as
    long; of one against another the currents cancel. With motors of resistance Rm, n of them at a duty d on a battery
    of resistance R, the time constant of what is common is longer by n d^2 R / Rm, as a share: `tau_shared` [s]. A
    log of ten voltages a second shows the lower voltage of a new steady state, and not this.
    """
    away = [steady_speed(par, command, voltage) - omega for omega, command in zip(speeds, commands, strict=True)]
    if motors is not None:
        cold = faster_when_cold(par, motors)
        away = [one + cold for one in away]
    common = sum(away) / len(away)
    together = common / (par.tau_drive + par.tau_shared)
    return [drive_train.drive_train_rate(common, one, par.tau_drive) + together for one in away]


def shaft_power(par: Named, speeds: Any, density_ratio: Scalar) -> Scalar:
    """Power that the rotors take in hover and near it [W]: torque times speed, all rotors."""
    return sum(
        getattr(par, f"gain_{i}") * rotor.drag_torque(par.k_torque, omega, density_ratio) * omega
        for i, omega in enumerate(speeds, start=1)
    )


def sag_rate(par: Named, sag: Scalar, speeds: Any, env: Environment, xp: Backend) -> Scalar:
    """Rate of the lost voltage [V/s] towards R I, with the current I that the rotors' power asks of the terminals."""
    terminal = xp.maximum(env.voltage - sag, LEAST_VOLTAGE * env.voltage)
    power = shaft_power(par, speeds, env.air_density / par.air_density)
    return (par.battery_resistance * power / (par.drive_efficiency * terminal) - sag) / par.tau_battery


def loads(
    state: MultirotorState, inputs: Named, par: Named, env: Environment, xp: Backend, *, senses: tuple[float, ...]
) -> MultirotorLoads:
    """Force [N] and moment [N m] on the body without gravity, and the rates of rotors and battery.

    Args:
        senses: of each rotor about body z (down): +1 clockwise seen from above, -1 counter-clockwise.
    """
    body, drive, battery, motors = state
    density = env.air_density / par.air_density
    air = body.velocity + local_to_body(env.wind, body.attitude, xp).scaled(-1.0)
    voltage = env.voltage
    if battery is not None:
        voltage = xp.maximum(env.voltage - battery.voltage_sag, LEAST_VOLTAGE * env.voltage)
    force = fuselage.drag_force(
        air, drag_x=par.drag_x, drag_y=par.drag_y, drag_z=par.drag_z, damping_w=0.0, xp=xp
    ).scaled(density)
    moment = fuselage.yaw_damping_moment(body.r, par.damping_r)
    rates, lift = speed_rates(par, drive, inputs, voltage, motors), 0.0
    for i, (omega, rate, sense) in enumerate(zip(drive, rates, senses, strict=True), start=1):
        gain, arm = getattr(par, f"gain_{i}"), place(par, i)
        flow = air + body.rates.cross(arm)
        across, through = par.rotor_drag * density * omega, par.thrust_damping * density * omega
        back = par.flap_back * density * omega
        thrust = gain * rotor.thrust(par.k_thrust, omega, density)
        pull = Vector(-across * flow.x, -across * flow.y, -thrust - through * flow.z)
        torque = gain * rotor.drag_torque(par.k_torque, omega, density)
        force, lift = force + pull, lift + thrust
        moment = (
            moment
            + arm.cross(pull)
            + Vector(-back * flow.y, back * flow.x, 0.0)
            + rotor.yaw_moment(torque, par.inertia_drive, rate, sense)
            + rotor.gyroscopic_moment(body.rates, par.inertia_drive, omega, sense)
        )
    lost = None if battery is None else Battery(sag_rate(par, battery.voltage_sag, drive, env, xp))
    warmer = None if motors is None else MotorWarmth(warming(par, motors, lift))
    return MultirotorLoads(force, moment, type(drive)(*rates), lost, warmer)


def derivatives(
    state: MultirotorState, inputs: Named, par: Named, env: Environment, xp: Backend, *, senses: tuple[float, ...]
) -> MultirotorState:
    """Time derivative of the whole state."""
    acting = loads(state, inputs, par, env, xp, senses=senses)
    force = acting.force + gravity(par.mass, env.gravity, state.body.attitude, xp)
    inertia = Inertia(par.mass, par.inertia_xx, par.inertia_yy, par.inertia_zz)
    return MultirotorState(
        rigid_body_rates(state.body, force, acting.moment, inertia, xp), acting.drive, acting.battery, acting.motors
    )


def specific_force(
    state: MultirotorState, inputs: Named, par: Named, env: Environment, xp: Backend, *, senses: tuple[float, ...]
) -> Vector:
    """What an accelerometer at the CG reads [m/s^2]: every force but gravity, per mass."""
    return loads(state, inputs, par, env, xp, senses=senses).force.scaled(1.0 / par.mass)
