"""The main rotor of a single-rotor helicopter in body axes: from what the hub does to its loads on the fuselage."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.physics import blade_element, flapping, ground_effect, inflow
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.flapping import Flapping
from swashplate.physics.frames import Vector
from swashplate.physics.inflow import Inflow

_PI = 3.141592653589793


class Contribution(NamedTuple):
    """Force [N] and moment about the CG [N m] of one part, body axes."""

    force: Vector
    moment: Vector


class MainRotor(NamedTuple):
    """The main rotor's loads on the fuselage, torque [N m], and the rates of disc [rad/s] and inflow [1/s]."""

    acting: Contribution
    torque: Scalar
    disc: Flapping
    inflow: Inflow | None
    induced: Scalar


def main_rotor(
    air: Vector,
    rates: Vector,
    tilt: Flapping,
    induced: Inflow | None,
    blades: tuple[Scalar, Scalar, Scalar],
    omega: Scalar,
    par: Named,
    density: Scalar,
    xp: Backend,
    options: HelicopterOptions,
    height: Scalar,
) -> MainRotor:
    """The main rotor in body axes (blade elements, momentum theory, first-order tip-path plane).

    Args:
        air: velocity of the CG through the air, body axes [m/s].
        rates: body rates [rad/s].
        tilt: of the tip-path plane.
        induced: dynamic inflow states, or None for momentum theory at every instant.
        blades: theta0, A1, B1 at the blades [rad].
        omega: rotor speed against the fuselage [rad/s].
        par, density: the card's numbers, the air.
        height: of the hub above the ground [m]; it counts with ground effect only.
    """
    sense = options.sense
    hub = Vector(par.hub_x, par.hub_y, -par.hub_height)
    ct, st = xp.cos(par.shaft_tilt), xp.sin(par.shaft_tilt)
    if options.yaw_at_blades:
        omega = omega - sense * (rates.z * ct - rates.x * st)
    felt = rates if options.yaw_at_hub else Vector(rates.x, rates.y, 0.0)
    at_hub = air + felt.cross(hub)
    tip = omega * par.rotor_radius
    mu_x = (at_hub.x * ct + at_hub.z * st) / tip
    mu_y = sense * at_hub.y / tip
    mu_z = (at_hub.z * ct - at_hub.x * st) / tip
    p, q = sense * (felt.x * ct + felt.z * st), felt.y
    theta0, A1, B1 = blades
    cp, sp = xp.cos(par.cyclic_phase), xp.sin(par.cyclic_phase)
    A1, B1 = sense * A1 * cp - B1 * sp, B1 * cp + sense * A1 * sp
    solidity = par.rotor_blades * par.rotor_chord / (_PI * par.rotor_radius)
    slope = par.rotor_lift_slope
    mu2 = mu_x * mu_x + mu_y * mu_y
    flap = Flapping(tilt.a1, sense * tilt.b1)
    blade = blade_element.WHOLE
    if options.tip_loss:
        blade = blade_element.span(par.rotor_tip_loss, par.rotor_root_cutout)
    # Moments of a shorter blade are those of a whole one with this lift slope (m3 is 1/4 there).
    flap_slope = slope if blade is blade_element.WHOLE else slope * 4.0 * blade.m3
    disc = blade_element.Disc(
        mu_x, mu_y, mu_z, 0.0, 0.0, 0.0, p / omega, q / omega, theta0, par.rotor_twist, A1, B1, 0.0, flap.a1, flap.b1
    )

    held = flapping.hinge(
        blade_inertia=par.blade_inertia,
        blades=par.rotor_blades,
        hub_stiffness=par.hub_stiffness,
        hinge_offset=par.hinge_offset,
        omega=omega,
        density=density,
        lift_slope=flap_slope,
        chord=par.rotor_chord,
        radius=par.rotor_radius,
        first_moment=par.blade_first_moment,
    )
    if options.stiff_blades:
        held = held._replace(stiffness_pace=flapping.regressing_pace(held.excess, xp))
    flaps = None  # by which flapping changes the blades' pitch
    if options.delta3:
        flaps = par.rotor_delta3
        disc = disc._replace(A1=A1 + flaps * flap.a1, B1=B1 + flaps * flap.b1)

    # Inflow: mean and gradient.
    if induced is None:
        free = blade_element.thrust_coefficient(disc, solidity, slope, blade)
        loss = 0.5 * slope * solidity * blade.m1
        if flaps is not None:  # pitch by coning, which falls with the inflow: C_T stays linear in it
            still_air, more = (_coned(disc._replace(lam0=lam), blade, held, par, flaps, options) for lam in (0.0, 1.0))
            free = blade_element.thrust_coefficient(still_air, solidity, slope, blade)
            loss = free - blade_element.thrust_coefficient(more, solidity, slope, blade)
        lam0 = inflow.momentum_inflow(free, loss, mu_z, mu2, xp)
        if options.ground_effect != "none":
            loss = loss * _near_ground(height, mu2, lam0, par, options, xp)
            lam0 = inflow.momentum_inflow(free, loss, mu_z, mu2, xp)
        flow = Inflow(lam0, 0.0, 0.0)
    else:
        flow = Inflow(induced.lam0, induced.lam_c, sense * induced.lam_s)
    skew = inflow.wake_skew(flow.lam0, mu_x, mu_y, mu_z, xp)
    through, through2, _ = inflow.mass_flow(flow.lam0, mu_z, mu2, xp)
    gradient_through = inflow.gradient_flow(flow.lam0, mu_z, mu2, through)
    if options.inflow == "glauert":
        flow = inflow.glauert_gradient(flow.lam0, skew)
    momentum = flow
    if options.ground_effect != "none":
        near = _near_ground(height, mu2, flow.lam0, par, options, xp)
        flow = Inflow(near * flow.lam0, near * flow.lam_c, near * flow.lam_s)
    disc = disc._replace(lam0=flow.lam0, lam_c=flow.lam_c, lam_s=flow.lam_s)

    # Flapping: coning, then the tip-path plane's rates in space.
    disc = _coned(disc, blade, held, par, flaps, options)
    bending = flapping.faded_wake_distortion(par.wake_distortion, mu2, par.wake_distortion_fade, xp)
    # Dynamic inflow has the wake's lag in its states.
    kept = 0.0 if options.inflow == "pitt-peters" else bending * flapping.wake_follows(held.excess, through2, xp)
    lag = (xp.cos(par.phase_lag), xp.sin(par.phase_lag)) if options.phase_lag else None
    tilted = disc._replace(a1=held.damping * flap.a1, b1=held.damping * flap.b1)
    still = _moments(tilted._replace(p=0.0, q=0.0), blade)
    plane_p, plane_q = flapping.plane_rates(
        flap,
        still,
        held,
        (p / omega, q / omega),
        wake_distortion=kept,
        phase_lag=lag,
    )
    disc_rates = Flapping(omega * plane_q - q, sense * (omega * plane_p - p))

    # Loads with everything that the blades now see.
    lam_c, lam_s = flow.lam_c + kept * plane_q, flow.lam_s + kept * plane_p
    moving = disc._replace(p=plane_p, q=plane_q, lam_c=lam_c, lam_s=lam_s)
    inflow_rates = None
    CT = blade_element.thrust_coefficient(moving, solidity, slope, blade)
    form = blade_element.thrust_tilt_loads if options.in_plane == "thrust-tilt" else blade_element.disc_loads
    coefficients = form(moving, solidity, slope, par.rotor_drag + par.rotor_drag_thrust * CT * CT, blade)
    if induced is not None:
        loading = blade_element.FlapMoments(still.mean, still.cos + 0.25 * plane_q, still.sin + 0.25 * plane_p)
        change = inflow.pitt_peters_rates(
            momentum,
            CT,
            loading,
            (plane_p, plane_q),
            skew,
            (through, gradient_through),
            wake_distortion=bending,
            solidity=solidity,
            lift_slope=flap_slope,
        )
        inflow_rates = Inflow(omega * change.lam0, omega * change.lam_c, sense * omega * change.lam_s)
    pressure = density * _PI * par.rotor_radius * par.rotor_radius * tip * tip
    thrust, ahead = pressure * coefficients.CT, pressure * coefficients.CX
    torque = pressure * par.rotor_radius * coefficients.CQ
    if options.induced_factor:
        torque = torque + pressure * par.rotor_radius * (par.rotor_induced_factor - 1.0) * flow.lam0 * CT
    if options.precession_torque:
        polar = par.rotor_blades * par.blade_inertia
        torque = torque - flapping.precession_torque(flap, p, q, inertia=polar, omega=omega)
    force = Vector(ahead * ct + thrust * st, sense * pressure * coefficients.CY, ahead * st - thrust * ct)
    roll, yaw = held.moment * tilt.b1, sense * torque
    moment = hub.cross(force) + Vector(roll * ct - yaw * st, held.moment * tilt.a1, roll * st + yaw * ct)
    return MainRotor(Contribution(force, moment), torque, disc_rates, inflow_rates, flow.lam0 * tip)


def _moments(disc: blade_element.Disc, blade: blade_element.Span) -> blade_element.FlapMoments:
    """Flap moments over those of a whole blade at the same slope (`flap_slope` has the rest)."""
    moments = blade_element.flap_moments(disc, blade)
    if blade is blade_element.WHOLE:
        return moments
    return blade_element.FlapMoments(*(0.25 * part / blade.m3 for part in moments))


def _coned(
    disc: blade_element.Disc,
    blade: blade_element.Span,
    held: flapping.Hinge,
    par: Named,
    flaps: Scalar | None,
    options: HelicopterOptions,
) -> blade_element.Disc:
    """The disc with its coning, and with the pitch that coning adds or takes where flapping changes pitch."""
    if not options.coning:
        return disc._replace(a0=par.precone)
    moment = _moments(disc, blade).mean
    if flaps is None:
        return disc._replace(a0=flapping.coning(moment, held, par.precone, free=1.0))
    # The moment is linear in the collective: a0 = g (M + M' k (a0 - precone)), coning beyond the precone moves pitch.
    gain = 0.5 * held.lock / (1.0 + held.excess)
    slope = _moments(disc._replace(theta0=disc.theta0 + 1.0), blade).mean - moment
    a0 = gain * (moment - slope * flaps * par.precone) / (1.0 - gain * slope * flaps)
    return disc._replace(a0=a0, theta0=disc.theta0 + flaps * (a0 - par.precone))


def _near_ground(
    height: Scalar, mu2: Scalar, lam0: Scalar, par: Named, options: HelicopterOptions, xp: Backend
) -> Scalar:
    return ground_effect.induced_share(height, mu2, lam0, radius=par.rotor_radius, form=options.ground_effect, xp=xp)
