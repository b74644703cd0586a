"""Stability and control derivatives of a single-rotor helicopter from closed forms, contributor by contributor.

The build-up of Bhandari et al. (2005), sec. IV: each derivative from geometry, aerodynamics and mass, without numerical
or automatic differentiation. Their eq. 8, X_u = -rho A_b (Omega R)^2 d(C_H/sigma)/da1 da1/du, is one product of many
here: all couplings, the wake's gradient and distortion and the profile drag are kept, in hover and in forward flight.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from swashplate.errors import SwashError
from swashplate.physics import blade_element, flapping, inflow, tail_rotor, tail_surfaces
from swashplate.physics.backend import FloatBackend
from swashplate.physics.blade_element import Disc
from swashplate.physics.disc_differential import disc_differential, inflow_change, skew_change
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector, local_to_body
from swashplate.vehicles.conventional import HelicopterState
from swashplate.vehicles.derivatives import COLUMNS, Array, DerivativeTable
from swashplate.vehicles.helicopter_options import HelicopterOptions
from swashplate.vehicles.structure import rebuild
from swashplate.vehicles.vehicle import Vehicle

_XP = FloatBackend()
_PI = 3.141592653589793
_NONE = Disc(*(0.0,) * len(Disc._fields))


class _Change(NamedTuple):
    """One unit of one column: what happens to the motion, the rates and the controls at the blades."""

    velocity: Vector
    rates: Vector
    theta0: float
    A1: float
    B1: float
    theta0T: float


class _Wake(NamedTuple):
    """Induced velocities [m/s] at the trim, and their changes by column."""

    main: float
    main_change: Array
    tail: float
    tail_change: Array


def _changes() -> list[_Change]:
    unit = np.eye(len(COLUMNS))
    return [_Change(Vector(*e[:3]), Vector(*e[3:6]), e[6], e[8], e[7], e[9]) for e in unit.tolist()]


def build_up(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> DerivativeTable:
    """All derivatives of forces and moments about a steady flight.

    Args:
        vehicle: a conventional helicopter with inflow "glauert" or "uniform" and no aerodynamic phase lag.
        x, u: state and input rows of a trim; bar, servos, gyro and rotor speed stay as they are there.
        environment: wind and air.

    Raises:
        SwashError: for another vehicle or other options.
    """
    options = (
        getattr(vehicle.derivatives, "keywords", {}).get("options")
        if isinstance(vehicle.derivatives, partial)
        else None
    )
    if not isinstance(options, HelicopterOptions):
        raise SwashError(
            "has no build-up of its derivatives.", where=vehicle.name, hint="It needs a single-rotor card."
        )
    if options.inflow not in ("glauert", "uniform") or options.phase_lag:
        raise SwashError(
            f"inflow '{options.inflow}' or a phase lag has no closed-form build-up.",
            where=vehicle.name,
            hint="Use inflow 'glauert' or 'uniform', or automatic differentiation.",
        )
    state: HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
    par, density = vehicle.values(), float(environment.air_density)
    body = state.body
    air = body.velocity + local_to_body(environment.wind, body.attitude, _XP).scaled(-1.0)
    omega = par.rotor_speed if state.rotor is None else state.rotor.omega
    sticks = state.servos if state.servos is not None else tuple(float(value) for value in u[:4])
    theta0, B1, A1, theta0T = sticks
    if state.bar is not None:
        A1, B1 = A1 + par.bar_gain * state.bar.d, B1 - par.bar_gain * state.bar.c
    if state.gyro is not None:
        theta0T = theta0T + options.sense * par.gyro_gain * state.gyro.r_gyro
    rotor, tilt, main, main_change = _main_rotor(
        air, body.rates, state.disc, (theta0, A1, B1), omega, par, density, options
    )
    tail, tail_induced, tail_change = _tail_rotor(air, body.rates, theta0T, omega, par, density, options)
    wake = _Wake(main, main_change, tail_induced, tail_change)
    parts = {
        "main_rotor": rotor,
        "tail_rotor": tail,
        "tailplane": _tailplane(air, body.rates, wake, par, density),
        "fin": _fin(air, body.rates, wake, par, density, options),
        "fuselage": _fuselage(air, wake, par, density),
    }
    scale = np.array([par.mass] * 3 + [par.inertia_xx, par.inertia_yy, par.inertia_zz])[:, None]
    return DerivativeTable({name: part / scale for name, part in parts.items()}, tilt, "build-up")


def _about_cg(arm: Vector, force: Vector) -> list[float]:
    return [*force, *arm.cross(force)]


def _main_rotor(
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
    tip = omega * par.rotor_radius
    solidity = par.rotor_blades * par.rotor_chord / (_PI * par.rotor_radius)

    def flow(velocity: Vector, turning: Vector) -> tuple[float, float, float, float, float]:
        """Velocity of the hub and rates of the shaft, dimensionless, counter-clockwise axes; linear."""
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
    )
    cone_gain = 0.5 * held.lock / (1.0 + held.excess) if options.coning else 0.0
    cone = cone_gain * blade_element.flap_moments(seen).mean if options.coning else par.precone
    seen = seen._replace(a0=cone)
    still = seen._replace(p=0.0, q=0.0)
    k_r = flapping.faded_wake_distortion(par.wake_distortion, mu2, par.wake_distortion_fade, _XP)
    moving = seen._replace(lam_c=seen.lam_c + k_r * q, lam_s=seen.lam_s + k_r * p)
    CT = blade_element.thrust_coefficient(moving, solidity, slope)
    drag = par.rotor_drag + par.rotor_drag_thrust * CT * CT
    trimmed = blade_element.disc_loads(moving, solidity, slope, drag)
    inertia, stiffness = 16.0 / held.lock, 8.0 * held.excess / held.lock
    pressure = density * _PI * par.rotor_radius * par.rotor_radius * tip * tip
    differential = partial(disc_differential, solidity=solidity, lift_slope=slope)

    # The flapping equations' own slopes: 4 dM by a1 and b1, with the springs.
    by_a1, _ = differential(still, _NONE._replace(a1=1.0), drag=drag, drag_change=0.0)
    by_b1, _ = differential(still, _NONE._replace(b1=1.0), drag=drag, drag_change=0.0)
    matrix = np.array([[stiffness + 4.0 * by_a1.cos, 4.0 * by_b1.cos], [4.0 * by_a1.sin, stiffness + 4.0 * by_b1.sin]])

    loads, tilts, induced = np.zeros((6, len(COLUMNS))), np.zeros((2, len(COLUMNS))), np.zeros(len(COLUMNS))
    for i, change in enumerate(_changes()):
        dx, dy, dz, dp, dq = flow(change.velocity, change.rates)
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
        dcone = cone_gain * moments.mean
        # Flapping: S a1 + 4 M_c = -(1 - K_R) q - (16/gamma) p and its fellow, with the disc following the body.
        rest = max(0.0, 1.0 - mu2 / par.wake_distortion_fade**2)
        dk_r = -2.0 * par.wake_distortion * rest * dmu2 / par.wake_distortion_fade**2
        forced, _ = differential(still, e._replace(p=0.0, q=0.0, a0=dcone), drag=drag, drag_change=0.0)
        right = np.array(
            [
                -(1.0 - k_r) * dq + dk_r * q - inertia * dp - 4.0 * forced.cos,
                -(1.0 - k_r) * dp + dk_r * p + inertia * dq - 4.0 * forced.sin,
            ]
        )
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
        thrust, ahead = pressure * change_of.CT, pressure * dCX
        yaw = sense * pressure * par.rotor_radius * change_of.CQ
        force = Vector(ahead * ct + thrust * st, sense * pressure * dCY, ahead * st - thrust * ct)
        roll = held.moment * sense * db1
        couple = Vector(roll * ct - yaw * st, held.moment * da1, roll * st + yaw * ct)
        loads[:, i] = [*force, *(hub.cross(force) + couple)]
        tilts[:, i], induced[i] = (da1, sense * db1), dlam0 * tip
    return loads, tilts, lam0 * tip, induced


def _tail_rotor(
    air: Vector, rates: Vector, pitch: float, omega: float, par: Any, density: float, options: HelicopterOptions
) -> tuple[Array, float, Array]:
    """Forces and moments (6, 10), induced velocity and its change (Padfield 2007, sec. 3.2.2 and 4.3.2)."""
    sense, at = options.sense, Vector(-par.tail_arm, 0.0, -par.tail_height)
    tip, slope = par.tail_gear * omega * par.tail_radius, par.tail_lift_slope
    solidity = par.tail_blades * par.tail_chord / (_PI * par.tail_radius)
    there = air + rates.cross(at)
    mu2, mu_z = (there.x**2 + there.z**2) / tip**2, -sense * there.y / tip
    scale = 0.5 * slope * solidity
    feed = par.tail_delta3 * density * slope * par.tail_chord * par.tail_radius**4 / (8.0 * par.tail_blade_inertia)
    kept = 1.0 / (1.0 - feed * (1.0 + mu2))
    by_pitch = 1.0 / 3.0 + 0.5 * mu2
    by_flow = 0.5 + by_pitch * kept * feed * 4.0 / 3.0
    loss = scale * by_flow
    lam0 = inflow.momentum_inflow(scale * (by_pitch * kept * pitch + by_flow * mu_z), loss, mu_z, mu2, _XP)
    unblocked = tail_rotor.fin_blockage(par.fin_area, par.tail_radius, par.fin_blockage)
    pressure = sense * unblocked * density * _PI * par.tail_radius**2 * tip**2
    loads, induced = np.zeros((6, len(COLUMNS))), np.zeros(len(COLUMNS))
    for i, change in enumerate(_changes()):
        moved = change.velocity + change.rates.cross(at)
        dmu2 = 2.0 * (there.x * moved.x + there.z * moved.z) / tip**2
        dmu_z = -sense * moved.y / tip
        dkept = kept * kept * feed * dmu2
        dby_flow = (0.5 * dmu2 * kept + by_pitch * dkept) * feed * 4.0 / 3.0
        free = scale * (
            by_pitch * kept * change.theta0T
            + (0.5 * dmu2 * kept + by_pitch * dkept) * pitch
            + by_flow * dmu_z
            + dby_flow * (mu_z - lam0)
        )
        dlam0 = inflow_change(lam0, free, loss, mu_z, mu2, dmu_z, dmu2, _XP)
        loads[:, i] = _about_cg(at, Vector(0.0, pressure * (free - loss * dlam0), 0.0))
        induced[i] = dlam0 * tip
    return loads, lam0 * tip, induced


def _surface(along: float, across: float, area: float, slope: float, density: float) -> tuple[float, float]:
    """Slopes of `tail_surfaces.lifting_force` by the speeds along and across."""
    ahead = float(np.hypot(along, tail_surfaces.ROUNDED))
    linear, most = (slope * ahead + abs(across)) * across, ahead**2 + across**2
    pressure = -0.5 * density * area
    if abs(linear) >= most:  # stalled: the dynamic pressure itself
        sign = 1.0 if linear > 0.0 else -1.0
        return pressure * sign * 2.0 * along, pressure * sign * 2.0 * across
    return pressure * slope * along / ahead * across, pressure * (slope * ahead + 2.0 * abs(across))


def _tailplane(air: Vector, rates: Vector, wake: _Wake, par: Any, density: float) -> Array:
    rim = par.tail_arm - par.rotor_radius
    near, far, drop = rim - par.tail_radius, rim + par.tail_radius, par.tail_height
    shown = tail_surfaces.wake_on_tailplane(air.x, air.z, wake.main, near=near, far=far, drop=drop, xp=_XP)
    along, across = air.x, air.z + par.tailplane_arm * rates.y - shown
    by_along, by_across = _surface(along, across, par.tailplane_area, par.tailplane_lift_slope, density)
    down = max(wake.main - air.z, 1e-3)
    swept = (air.x / down * drop - near) / (far - near)
    share = 1.5 * min(1.0, max(0.0, swept))
    loads = np.zeros((6, len(COLUMNS)))
    for i, change in enumerate(_changes()):
        v = change.velocity
        dshare = 0.0
        if 0.0 < swept < 1.0:
            ddown = wake.main_change[i] - v.z
            dshare = 1.5 * drop / (far - near) * (v.x - air.x / down * ddown) / down
        dacross = v.z + par.tailplane_arm * change.rates.y - share * wake.main_change[i] - dshare * wake.main
        dZ = by_along * v.x + by_across * dacross
        loads[:, i] = _about_cg(Vector(-par.tailplane_arm, 0.0, 0.0), Vector(0.0, 0.0, dZ))
    return loads


def _fin(air: Vector, rates: Vector, wake: _Wake, par: Any, density: float, options: HelicopterOptions) -> Array:
    blown = options.sense * par.fin_wake
    across = air.y - par.fin_arm * rates.z + par.fin_height * rates.x + blown * wake.tail
    by_along, by_across = _surface(air.x, across, par.fin_area, par.fin_lift_slope, density)
    loads = np.zeros((6, len(COLUMNS)))
    for i, change in enumerate(_changes()):
        v, turn = change.velocity, change.rates
        dacross = v.y - par.fin_arm * turn.z + par.fin_height * turn.x + blown * wake.tail_change[i]
        dY = by_along * v.x + by_across * dacross
        loads[:, i] = _about_cg(Vector(-par.fin_arm, 0.0, -par.fin_height), Vector(0.0, dY, 0.0))
    return loads


def _fuselage(air: Vector, wake: _Wake, par: Any, density: float) -> Array:
    areas = (par.fuselage_area_x, par.fuselage_area_y, par.fuselage_area_z)
    seen = (air.x, air.y, air.z - wake.main)
    speed = float(np.sqrt(sum(s * s for s in seen) + 1e-9))
    loads = np.zeros((6, len(COLUMNS)))
    for i, change in enumerate(_changes()):
        moved = (change.velocity.x, change.velocity.y, change.velocity.z - wake.main_change[i])
        dspeed = sum(s * d for s, d in zip(seen, moved, strict=True)) / speed
        loads[:3, i] = [
            -0.5 * density * area * (dspeed * s + speed * d) for area, s, d in zip(areas, seen, moved, strict=True)
        ]
    return loads
