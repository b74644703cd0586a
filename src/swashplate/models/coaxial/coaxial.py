"""A coaxial helicopter with collective and cyclic pitch on both rotors: two main rotors in each other's flow.

Each rotor is the single-rotor helicopter's (`conventional.main_rotor`: blade elements, tip-path plane, Pitt and Peters'
inflow states), one turning each way at one speed. What the other's wake brings to a disc is air that comes down through
it (`coaxial_wake.wake_shares`), so that momentum theory counts it as a climb: T = 2 rho A v |v + given + climb|. Yaw is
by differential collective: the rotor with more pitch takes more torque, and turns the body against its own sense.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from swashplate.models.coaxial.coaxial_options import CoaxialOptions
from swashplate.models.coaxial.coaxial_parameters import one_rotor
from swashplate.models.conventional import drive
from swashplate.models.conventional.main_rotor import Contribution, MainRotor, main_rotor
from swashplate.physics import coaxial_wake, fuselage, ground_contact, ground_effect
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.coaxial_wake import Induced, WakeShares
from swashplate.physics.engine import EngineLag, RotorSpeed
from swashplate.physics.environment import Environment
from swashplate.physics.flapping import Flapping
from swashplate.physics.frames import Vector, local_to_body
from swashplate.physics.ground_contact import Grip
from swashplate.physics.inflow import Inflow
from swashplate.physics.rigid_body import Inertia, RigidBody, gravity, rigid_body_rates

_SLOWEST = 0.1
"""Share of the governed speed below which coefficients no longer change, and loads fade with the speed squared."""


class FourCommands(NamedTuple):
    """Mean collective, longitudinal (forward positive) and lateral (right positive) cyclic, and half of the rotors'
    difference in collective (nose right positive) [rad]."""

    theta0: Scalar
    B1: Scalar
    A1: Scalar
    theta0d: Scalar


class SixCommands(NamedTuple):
    """The same, and half of the swashplates' difference in cyclic, upper less lower [rad]."""

    theta0: Scalar
    B1: Scalar
    A1: Scalar
    theta0d: Scalar
    B1d: Scalar
    A1d: Scalar


class CoaxialState(NamedTuple):
    """Rigid body, tip-path planes and inflow of both rotors, and the optional parts: None where they are left out."""

    body: RigidBody
    upper: Flapping
    lower: Flapping
    inflow_upper: Inflow
    inflow_lower: Inflow
    rotor: RotorSpeed | None
    servos: Any
    delays: Any
    engine: EngineLag | None
    grip: Grip | None


class RotorsInWake(NamedTuple):
    """Both rotors with the loads that they pass on [N, N m], the air that each gets from the other, and the shares."""

    upper: MainRotor
    lower: MainRotor
    given_upper: Scalar
    given_lower: Scalar
    shares: WakeShares


class TwinRotorLoads(NamedTuple):
    """What acts on the fuselage by contributor, and how the moving parts move; `power` of both rotors [W]."""

    upper_rotor: Contribution
    lower_rotor: Contribution
    fuselage: Contribution
    ground: Contribution | None
    rotors: RotorsInWake
    rotor: RotorSpeed | None
    servos: Any
    delays: Any
    engine: EngineLag | None
    grip: Grip | None
    power: Scalar

    def total(self) -> Contribution:
        """All contributors together."""
        parts = (self.upper_rotor, self.lower_rotor, self.fuselage, self.ground)
        force, moment = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
        for part in parts:
            if part is not None:
                force, moment = force + part.force, moment + part.moment
        return Contribution(force, moment)


def blade_pitches(sticks: Named, sense: float) -> tuple[tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar]]:
    """(theta0, A1, B1) at the upper and the lower swashplate [rad]; theta0d turns the nose right for either sense.

    Args:
        sticks: theta0, B1, A1, theta0d, and B1d, A1d where there are any.
        sense: +1 for an upper rotor that turns counter-clockwise.
    """
    more = sense * sticks.theta0d
    a1d, b1d = getattr(sticks, "A1d", 0.0), getattr(sticks, "B1d", 0.0)
    return (
        (sticks.theta0 + more, sticks.A1 + a1d, sticks.B1 + b1d),
        (sticks.theta0 - more, sticks.A1 - a1d, sticks.B1 - b1d),
    )


def _rotors(
    state: CoaxialState,
    air: Vector,
    sticks: Named,
    omega: Scalar,
    blowing: Scalar,
    par: Named,
    density: Scalar,
    xp: Backend,
    options: CoaxialOptions,
) -> RotorsInWake:
    """Both rotors; `blowing` is the share of their wakes that is there while they start."""
    body, radius = state.body, par.rotor_radius
    tip = blowing * omega * radius
    self_induced = Induced(state.inflow_upper.lam0 * tip, state.inflow_lower.lam0 * tip)
    across2 = air.x * air.x + air.y * air.y
    shares = coaxial_wake.wake_shares(
        -air.z,
        across2,
        self_induced,
        separation=par.hub_height_upper - par.hub_height_lower,
        radius=radius,
        form=options.interference,
        xp=xp,
    )
    upright = xp.cos(body.phi) * xp.cos(body.theta)
    pitches = blade_pitches(sticks, options.upper.sense)
    heights = (par.hub_height_upper, par.hub_height_lower)
    given = (shares.on_upper * self_induced.induced_lower, shares.on_lower * self_induced.induced_upper)
    rotors, felt = [], []
    for i, (disc, flow, switches) in enumerate(
        (
            (state.upper, state.inflow_upper, options.upper),
            (state.lower, state.inflow_lower, options.lower),
        )
    ):
        above = heights[i] * upright - body.z
        near = ground_effect.induced_share(
            above, across2, self_induced[i] + given[i], radius=radius, form=switches.ground_effect, xp=xp
        )
        felt.append(near * given[i])
        through = Vector(air.x, air.y, air.z - felt[i])
        numbers = one_rotor(par, heights[i])
        rotors.append(
            main_rotor(through, body.rates, disc, flow, pitches[i], omega, numbers, density, xp, switches, above)
        )
    return RotorsInWake(rotors[0], rotors[1], felt[0], felt[1], shares)


def loads(
    state: CoaxialState, inputs: Named, par: Named, env: Environment, xp: Backend, *, options: CoaxialOptions
) -> TwinRotorLoads:
    """Forces and moments on the fuselage by contributor, without gravity, and the rates of everything that moves."""
    body, density, switches = state.body, env.air_density, options.upper
    air = body.velocity + local_to_body(env.wind, body.attitude, xp).scaled(-1.0)

    servo_rates, delay_rates = None, None
    kind = commands_of(options)
    sticks = kind(*(getattr(inputs, name) for name in kind._fields))
    if state.delays is not None:
        delay_rates, sticks = drive.delayed_commands(state.delays, sticks, par.servo_delay)
    if state.servos is not None:
        servo_rates = drive.servo_rates(state.servos, sticks, stops(par, len(sticks)), par, xp)
        sticks = kind(*state.servos)

    turning = par.rotor_speed if state.rotor is None else state.rotor.omega
    omega, blowing, fading = turning, 1.0, 1.0
    if state.rotor is not None:
        omega = xp.maximum(turning, _SLOWEST * par.rotor_speed)
        blowing = xp.minimum(1.0, turning / omega)  # rotors at rest have no wake
        fading = blowing * blowing
    rotors = _rotors(state, air, sticks, omega, blowing, par, density, xp, options)
    upper, lower = rotors.upper.acting, rotors.lower.acting
    if state.rotor is not None:
        upper = Contribution(upper.force.scaled(fading), upper.moment.scaled(fading))
        lower = Contribution(lower.force.scaled(fading), lower.moment.scaled(fading))

    # Both rotors gain speed alike and turn against each other: the shafts' reactions on the fuselage cancel.
    load = fading * (rotors.upper.torque + rotors.lower.torque)
    rotor_rates, lag = None, None
    if state.rotor is not None:
        throttle = inputs.throttle if switches.throttle else 1.0
        rotor_rates, lag = drive.shaft_rates(state.rotor, state.engine, load, throttle, par, xp)
    wake = par.fuselage_wake * blowing * (rotors.upper.induced + rotors.lower.induced)
    areas = Vector(par.fuselage_area_x, par.fuselage_area_y, par.fuselage_area_z)
    drag = fuselage.flat_plate_drag(air, wake, areas=areas, density=density, xp=xp)
    touching, bending = None, None
    if switches.ground:
        force, moment, bending = ground_contact.skid_loads(body, ground_contact.Skids.of(par), xp, state.grip)
        touching = Contribution(force, moment)
    return TwinRotorLoads(
        upper,
        lower,
        Contribution(drag, Vector(0.0, 0.0, 0.0)),
        touching,
        rotors,
        rotor_rates,
        servo_rates,
        delay_rates,
        lag,
        bending,
        load * turning,
    )


def stops(par: Named, count: int) -> list[tuple[Scalar, Scalar]]:
    """Lowest and highest theta0, B1, A1, theta0d and, of six commands, B1d and A1d [rad]."""
    cyclic = (-par.cyclic_limit, par.cyclic_limit)
    ends = [
        (par.collective_low, par.collective_high),
        cyclic,
        cyclic,
        (-par.differential_limit, par.differential_limit),
    ]
    return [*ends, *(cyclic for _ in range(count - len(ends)))]


def commands_of(options: CoaxialOptions) -> type[FourCommands] | type[SixCommands]:
    """The named tuple type of the commands at the blades."""
    return SixCommands if options.differential_cyclic else FourCommands


def derivatives(
    state: CoaxialState, inputs: Named, par: Named, env: Environment, xp: Backend, *, options: CoaxialOptions
) -> CoaxialState:
    """Time derivative of the whole state."""
    acting = loads(state, inputs, par, env, xp, options=options)
    total = acting.total()
    inertia = Inertia(par.mass, par.inertia_xx, par.inertia_yy, par.inertia_zz, par.inertia_xz)
    force = total.force + gravity(par.mass, env.gravity, state.body.attitude, xp)
    upper, lower = acting.rotors.upper, acting.rotors.lower
    assert upper.inflow is not None  # Pitt and Peters' states
    assert lower.inflow is not None
    return CoaxialState(
        rigid_body_rates(state.body, force, total.moment, inertia, xp),
        upper.disc,
        lower.disc,
        upper.inflow,
        lower.inflow,
        acting.rotor,
        acting.servos,
        acting.delays,
        acting.engine,
        acting.grip,
    )


def specific_force(
    state: CoaxialState, inputs: Named, par: Named, env: Environment, xp: Backend, *, options: CoaxialOptions
) -> Vector:
    """What an accelerometer at the CG reads [m/s^2]: every force but gravity, per mass."""
    return loads(state, inputs, par, env, xp, options=options).total().force.scaled(1.0 / par.mass)
