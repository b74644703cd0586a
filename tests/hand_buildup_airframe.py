"""What tail rotor, tails and fuselage add to the build-up of derivatives: `airframe`, differentiated by hand."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hand_buildup_main_rotor import changes
from hand_disc_differential import inflow_change
from swashplate.arrays import Array
from swashplate.models.conventional.derivative_table import COLUMNS
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.physics import inflow, tail_rotor, tail_surfaces
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Vector

_XP = FloatBackend()
_PI = 3.141592653589793


class Wake(NamedTuple):
    """Induced velocities [m/s] at the trim, and their changes by column."""

    main: float
    main_change: Array
    tail: float
    tail_change: Array


def _about_cg(arm: Vector, force: Vector) -> list[float]:
    return [*force, *arm.cross(force)]


def tail_rotor_slopes(
    air: Vector, rates: Vector, pitch: float, omega: float, par: Any, density: float, options: HelicopterOptions
) -> tuple[Array, float, Array]:
    """Forces and moments (6, 10), induced velocity and its change (Padfield 2007, sec. 3.2.2 and 4.3.2)."""
    sense, at = options.sense, Vector(-par.tail_arm, 0.0, -par.tail_height)
    tip, slope = par.tail_gear * omega * par.tail_radius, par.tail_lift_slope
    solidity = par.tail_blades * par.tail_chord / (_PI * par.tail_radius)
    cc, sc = float(np.cos(par.tail_cant)), float(np.sin(par.tail_cant))

    def disc_flow(there: Vector) -> tuple[float, float, float]:
        """Along x, across it in the disc, and against the thrust."""
        return there.x, there.z * cc + sense * there.y * sc, sense * there.y * cc - there.z * sc

    x, y, against = disc_flow(air + rates.cross(at))
    mu2, mu_z = (x**2 + y**2) / tip**2, -against / tip
    scale = 0.5 * slope * solidity
    feed = tail_rotor.coning_feedback(
        density=density,
        radius=par.tail_radius,
        chord=par.tail_chord,
        lift_slope=slope,
        delta3=par.tail_delta3,
        blade_inertia=par.tail_blade_inertia,
        flap_frequency=par.tail_flap_frequency,
    )
    twist = par.tail_twist
    kept = 1.0 / (1.0 - feed * (1.0 + mu2))
    by_pitch, coned = 1.0 / 3.0 + 0.5 * mu2, 0.8 + 2.0 / 3.0 * mu2
    by_flow = 0.5 + by_pitch * kept * feed * 4.0 / 3.0
    by_twist = 0.25 * (1.0 + mu2) + by_pitch * kept * feed * coned
    loss = scale * by_flow
    free = scale * (by_pitch * kept * pitch + by_twist * twist + by_flow * mu_z)
    lam0 = inflow.momentum_inflow(free, loss, mu_z, mu2, _XP)
    unblocked = tail_rotor.fin_blockage(par.fin_area, par.tail_radius, par.fin_blockage)
    pressure = unblocked * density * _PI * par.tail_radius**2 * tip**2
    loads, induced = np.zeros((6, len(COLUMNS))), np.zeros(len(COLUMNS))
    for i, change in enumerate(changes()):
        dx, dy, dagainst = disc_flow(change.velocity + change.rates.cross(at))
        dmu2 = 2.0 * (x * dx + y * dy) / tip**2
        dmu_z = -dagainst / tip
        dkept = kept * kept * feed * dmu2
        dheld = 0.5 * dmu2 * kept + by_pitch * dkept
        dby_flow = dheld * feed * 4.0 / 3.0
        dby_twist = 0.25 * dmu2 + feed * (dheld * coned + by_pitch * kept * 2.0 / 3.0 * dmu2)
        dfree = scale * (
            by_pitch * kept * change.theta0T
            + dheld * pitch
            + dby_twist * twist
            + by_flow * dmu_z
            + dby_flow * (mu_z - lam0)
        )
        dlam0 = inflow_change(lam0, dfree, loss, mu_z, mu2, dmu_z, dmu2, _XP)
        dthrust = pressure * (dfree - loss * dlam0)
        loads[:, i] = _about_cg(at, Vector(0.0, sense * cc * dthrust, -sc * dthrust))
        induced[i] = dlam0 * tip
    return loads, lam0 * tip, induced


class _Surface:
    """Slopes of `tail_surfaces.inclined_force` by the speeds along and across."""

    def __init__(
        self, along: float, across: float, incidence: float, *, area: float, slope: float, density: float
    ) -> None:
        self._ci, self._si = float(np.cos(incidence)), float(np.sin(incidence))
        chordwise, normal = along * self._ci - across * self._si, across * self._ci + along * self._si
        ahead = float(np.hypot(chordwise, tail_surfaces.ROUNDED))
        linear, most = (slope * ahead + abs(normal)) * normal, ahead**2 + normal**2
        pressure = -0.5 * density * area
        if abs(linear) >= most:  # stalled: the dynamic pressure itself
            sign = 1.0 if linear > 0.0 else -1.0
            self._by = (pressure * sign * 2.0 * chordwise, pressure * sign * 2.0 * normal)
        else:
            self._by = (pressure * slope * chordwise / ahead * normal, pressure * (slope * ahead + 2.0 * abs(normal)))

    def change(self, along: float, across: float) -> tuple[float, float]:
        """Changes of the forces along and across [N] for changes of these speeds."""
        chordwise, normal = along * self._ci - across * self._si, across * self._ci + along * self._si
        force = self._by[0] * chordwise + self._by[1] * normal
        return force * self._si, force * self._ci


def tailplane_slopes(air: Vector, rates: Vector, wake: Wake, par: Any, density: float) -> Array:
    rim = par.tail_arm - par.rotor_radius
    near, far, drop = rim - par.tail_radius, rim + par.tail_radius, par.tailplane_drop
    most = par.tailplane_wake
    shown = tail_surfaces.wake_on_tailplane(air.x, air.z, wake.main, near=near, far=far, drop=drop, most=most, xp=_XP)
    along, across = air.x, air.z + par.tailplane_arm * rates.y - shown
    surface = _Surface(
        along,
        across,
        par.tailplane_incidence,
        area=par.tailplane_area,
        slope=par.tailplane_lift_slope,
        density=density,
    )
    down = max(wake.main - air.z, 1e-3)
    swept = (air.x / down * drop - near) / (far - near)
    share = most * min(1.0, max(0.0, swept))
    loads = np.zeros((6, len(COLUMNS)))
    for i, change in enumerate(changes()):
        v = change.velocity
        dshare = 0.0
        if 0.0 < swept < 1.0:
            ddown = wake.main_change[i] - v.z
            dshare = most * drop / (far - near) * (v.x - air.x / down * ddown) / down
        dacross = v.z + par.tailplane_arm * change.rates.y - share * wake.main_change[i] - dshare * wake.main
        dX, dZ = surface.change(v.x, dacross)
        loads[:, i] = _about_cg(Vector(-par.tailplane_arm, 0.0, 0.0), Vector(dX, 0.0, dZ))
    return loads


def fin_slopes(air: Vector, rates: Vector, wake: Wake, par: Any, density: float, options: HelicopterOptions) -> Array:
    blown = options.sense * par.fin_wake
    across = air.y - par.fin_arm * rates.z + par.fin_height * rates.x + blown * wake.tail
    incidence = -options.sense * par.fin_incidence
    surface = _Surface(air.x, across, incidence, area=par.fin_area, slope=par.fin_lift_slope, density=density)
    loads = np.zeros((6, len(COLUMNS)))
    for i, change in enumerate(changes()):
        v, turn = change.velocity, change.rates
        dacross = v.y - par.fin_arm * turn.z + par.fin_height * turn.x + blown * wake.tail_change[i]
        dX, dY = surface.change(v.x, dacross)
        loads[:, i] = _about_cg(Vector(-par.fin_arm, 0.0, -par.fin_height), Vector(dX, dY, 0.0))
    return loads


def fuselage_slopes(air: Vector, wake: Wake, par: Any, density: float) -> Array:
    areas = (par.fuselage_area_x, par.fuselage_area_y, par.fuselage_area_z)
    seen = (air.x, air.y, air.z - par.fuselage_wake * wake.main)
    speed = float(np.sqrt(sum(s * s for s in seen) + 1e-9))
    loads = np.zeros((6, len(COLUMNS)))
    for i, change in enumerate(changes()):
        moved = (change.velocity.x, change.velocity.y, change.velocity.z - par.fuselage_wake * wake.main_change[i])
        dspeed = sum(s * d for s, d in zip(seen, moved, strict=True)) / speed
        loads[:3, i] = [
            -0.5 * density * area * (dspeed * s + speed * d) for area, s, d in zip(areas, seen, moved, strict=True)
        ]
        (u, v, w), (du, dv, dw) = seen, moved
        nose_up = par.fuselage_pitch_volume * (u * dw + w * du) + 2.0 * par.fuselage_pitch_zero * u * du
        loads[4:, i] = [0.5 * density * nose_up, -0.5 * density * par.fuselage_yaw_volume * (u * dv + v * du)]
    return loads
