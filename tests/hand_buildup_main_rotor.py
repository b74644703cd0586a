"""The main rotor's part of the build-up of derivatives: each column through inflow, flapping and loads, by hand."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from hand_disc_differential import disc_differential, flow_change, inflow_change, skew_change
from swashplate.arrays import Array
from swashplate.models.conventional.derivative_table import COLUMNS
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.physics import blade_element, flapping, inflow
from swashplate.physics.backend import FloatBackend
from swashplate.physics.blade_element import Disc
from swashplate.physics.frames import Vector

_XP = FloatBackend()
_PI = 3.141592653589793
_NONE = Disc(*(0.0,) * len(Disc._fields))


class Change(NamedTuple):
    """One unit of one column: what happens to the motion, the rates and the controls at the blades."""

    velocity: Vector
    rates: Vector
    theta0: float
    A1: float
    B1: float
    theta0T: float


def changes() -> list[Change]:
    """One change for each column of a derivative table."""
    unit = np.eye(len(COLUMNS))
    return [Change(Vector(*e[:3]), Vector(*e[3:6]), e[6], e[8], e[7], e[9]) for e in unit.tolist()]


def main_rotor_slopes(
    air: Vector,
    rates: Vector,
    disc: flapping.Flapping,
    blades: tuple[float, float, float],
    omega: float,
    par: Any,
    density: float,
    options: HelicopterOptions,
) -> tuple[Array, Array, float, Array]:
    """Forces and moments by column (6, 10), flapping (2, 10), induced velocity [m/s] and its change (10,)."""
    sense, slope = options.sense, par.rotor_lift_slope
    hub = Vector(par.hub_x, par.hub_y, -par.hub_height)
    ct, st = _XP.cos(par.shaft_tilt), _XP.sin(par.shaft_tilt)
    cp, sp = _XP.cos(par.cyclic_phase), _XP.sin(par.cyclic_phase)
    solidity = par.rotor_blades * par.rotor_chord / (_PI * par.rotor_radius)

    if options.yaw_at_blades:
        omega = omega - sense * (rates.z * ct - rates.x * st)
    tip = omega * par.rotor_radius

    def flow(velocity: Vector, turning: Vector) -> tuple[float, float, float, float, float]:
        """Velocity of the hub and rates of the shaft, dimensionless, counter-clockwise axes; linear."""
        if not options.yaw_at_hub:
            turning = Vector(turning.x, turning.y, 0.0)
        there = velocity + turning.cross(hub)
        return (
            (there.x * ct + there.z * st) / tip,
            sense * there.y / tip,
            (there.z * ct - there.x * st) / tip,
            sense * (turning.x * ct + turning.z * st) / omega,
            turning.y / omega,
        )

    def pitch(A1: float, B1: float) -> tuple[float, float]:
        return sense * A1 * cp - B1 * sp, B1 * cp + sense * A1 * sp

    # The trim.
    theta0, A1, B1 = blades
    x, y, z, p, q = flow(air, rates)
    A1, B1 = pitch(A1, B1)
    own = flapping.Flapping(disc.a1, sense * disc.b1)
    seen = Disc(x, y, z, 0.0, 0.0, 0.0, p, q, theta0, par.rotor_twist, A1, B1, 0.0, own.a1, own.b1)
    mu2, loss = x * x + y * y, 0.25 * slope * solidity
    lam0 = inflow.momentum_inflow(blade_element.thrust_coefficient(seen, solidity, slope), loss, z, mu2, _XP)
    skew = inflow.wake_skew(lam0, x, y, z, _XP)
    graded = 1.0 if options.inflow == "glauert" else 0.0
    seen = seen._replace(lam0=lam0, lam_c=graded * lam0 * skew[0], lam_s=-graded * lam0 * skew[1])
    held = flapping.hinge(
        blade_inertia=par.blade_inertia,
        blades=par.rotor_blades,
        hub_stiffness=par.hub_stiffness,
        hinge_offset=par.hinge_offset,
        omega=omega,
        density=density,
        lift_slope=slope,
        chord=par.rotor_chord,
        radius=par.rotor_radius,
        first_moment=par.blade_first_moment,
    )
    cone_gain = 0.5 * held.lock / (1.0 + held.excess) if options.coning else 0.0
    cone = cone_gain * blade_element.flap_moments(seen).mean if options.coning else par.precone
    seen = seen._replace(a0=cone)
    still = seen._replace(p=0.0, q=0.0, a1=held.damping * own.a1, b1=held.damping * own.b1)
    sprung = held.excess - held.offset
    in_hover = flapping.faded_wake_distortion(par.wake_distortion, mu2, par.wake_distortion_fade, _XP)
    _, v2, _ = inflow.mass_flow(lam0, z, mu2, _XP)
    follows, late = flapping.wake_follows(held.excess, v2, _XP), flapping.wake_lateness(held.excess, v2)
    k_r = in_hover * follows
    moving = seen._replace(lam_c=seen.lam_c + k_r * q, lam_s=seen.lam_s + k_r * p)
    CT = blade_element.thrust_coefficient(moving, solidity, slope)
    drag = par.rotor_drag + par.rotor_drag_thrust * CT * CT
    form = blade_element.thrust_tilt_loads if options.in_plane == "thrust-tilt" else blade_element.disc_loads
    trimmed = form(moving, solidity, slope, drag)
    inertia, stiffness = 16.0 / held.lock * (1.0 + held.offset), 8.0 * held.excess / held.lock
    pressure = density * _PI * par.rotor_radius * par.rotor_radius * tip * tip
    differential = partial(disc_differential, solidity=solidity, lift_slope=slope)

    # The flapping equations' own slopes: 4 dM by a1 and b1, with the springs.
    by_a1, _ = differential(still, _NONE._replace(a1=1.0), drag=drag, drag_change=0.0)
    by_b1, _ = differential(still, _NONE._replace(b1=1.0), drag=drag, drag_change=0.0)
    free = 4.0 * held.damping * np.array([[by_a1.cos, by_b1.cos], [by_a1.sin, by_b1.sin]])
    matrix = stiffness * np.eye(2) + free

    loads, tilts, induced = np.zeros((6, len(COLUMNS))), np.zeros((2, len(COLUMNS))), np.zeros(len(COLUMNS))
    for i, change in enumerate(changes()):
        quicker = 0.0
        if options.yaw_at_blades:  # the blades' speed changes, and all that it made dimensionless
            quicker = -sense * (change.rates.z * ct - change.rates.x * st) / omega
        moved = flow(change.velocity, change.rates)
        dx, dy, dz, dp, dq = (d - quicker * at for d, at in zip(moved, (x, y, z, p, q), strict=True))
        dA1, dB1 = pitch(change.A1, change.B1)
        dmu2 = 2.0 * (x * dx + y * dy)
        # Inflow: momentum against blade elements, then its gradient.
        e = Disc(dx, dy, dz, 0.0, 0.0, 0.0, dp, dq, change.theta0, 0.0, dA1, dB1, 0.0, 0.0, 0.0)
        _, free = differential(seen._replace(lam_c=0.0, lam_s=0.0), e, drag=drag, drag_change=0.0)
        dlam0 = inflow_change(lam0, free.CT, loss, z, mu2, dz, dmu2, _XP)
        dsx, dsy = skew_change(lam0, x, y, z, (dlam0, dx, dy, dz), _XP)
        e = e._replace(
            lam0=dlam0,
            lam_c=graded * (dlam0 * skew[0] + lam0 * dsx),
            lam_s=-graded * (dlam0 * skew[1] + lam0 * dsy),
        )
        moments, _ = differential(seen, e, drag=drag, drag_change=0.0)
        softer = -2.0 * sprung * quicker  # change of the excess
        dcone = cone_gain * moments.mean - (cone * softer / (1.0 + held.excess) if options.coning else 0.0)
        # Flapping: S a1 + 4 M_c = -(1 - K_R) q - (16/gamma) p and its fellow, with the disc following the body.
        rest = max(0.0, 1.0 - mu2 / par.wake_distortion_fade**2)
        dk_r = -2.0 * par.wake_distortion * rest * dmu2 / par.wake_distortion_fade**2 * follows
        if late > 1.0:
            dlate = late * (2.0 * softer / held.excess - flow_change(lam0, z, mu2, (dlam0, dz, dmu2), _XP) / v2)
            dk_r -= in_hover * follows**3 * (late - 1.0) * dlate
        forced, _ = differential(still, e._replace(p=0.0, q=0.0, a0=dcone), drag=drag, drag_change=0.0)
        right = np.array(
            [
                -(1.0 - k_r) * dq + dk_r * q - inertia * dp - 4.0 * forced.cos,
                -(1.0 - k_r) * dp + dk_r * p + inertia * dq - 4.0 * forced.sin,
            ]
        )
        right -= 8.0 * softer / held.lock * np.array([own.a1, own.b1])
        da1, db1 = np.linalg.solve(matrix, right).tolist()
        # Loads.
        e = e._replace(
            a0=dcone, a1=da1, b1=db1, lam_c=e.lam_c + k_r * dq + dk_r * q, lam_s=e.lam_s + k_r * dp + dk_r * p
        )
        _, first = differential(moving, e, drag=drag, drag_change=0.0)
        thicker = 2.0 * par.rotor_drag_thrust * CT * first.CT
        _, change_of = differential(moving, e, drag=drag, drag_change=thicker)
        dCX, dCY = change_of.CX, change_of.CY
        if options.in_plane == "thrust-tilt":
            side, dside = 0.25 * solidity * drag, 0.25 * solidity * thicker
            dCX = -trimmed.CT * da1 - change_of.CT * own.a1 - side * dx - dside * x
            dCY = trimmed.CT * db1 + change_of.CT * own.b1 - side * dy - dside * y
        dCT, dCQ = change_of.CT + 2.0 * quicker * trimmed.CT, change_of.CQ + 2.0 * quicker * trimmed.CQ
        dCX, dCY = dCX + 2.0 * quicker * trimmed.CX, dCY + 2.0 * quicker * trimmed.CY
        thrust, ahead, yaw = pressure * dCT, pressure * dCX, sense * pressure * par.rotor_radius * dCQ
        if options.precession_torque:
            turned = 2.0 * quicker * (p * own.b1 + q * own.a1) + dp * own.b1 + p * db1 + dq * own.a1 + q * da1
            yaw -= sense * par.rotor_blades * par.blade_inertia * omega * omega * turned
        force = Vector(ahead * ct + thrust * st, sense * pressure * dCY, ahead * st - thrust * ct)
        stiffer = 2.0 * quicker * (held.moment - par.hub_stiffness)
        roll, nose = sense * (held.moment * db1 + stiffer * own.b1), held.moment * da1 + stiffer * own.a1
        couple = Vector(roll * ct - yaw * st, nose, roll * st + yaw * ct)
        loads[:, i] = [*force, *(hub.cross(force) + couple)]
        tilts[:, i], induced[i] = (da1, sense * db1), (dlam0 + quicker * lam0) * tip
    return loads, tilts, lam0 * tip, induced
