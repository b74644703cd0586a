"""What the air does to a single-rotor helicopter behind and below its main rotor: tail rotor, tails and fuselage."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.models.conventional.main_rotor import Contribution
from swashplate.physics import fuselage, tail_rotor, tail_surfaces
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.frames import Vector


class Airframe(NamedTuple):
    """Loads by contributor, and the tail rotor's torque [N m] at its own shaft."""

    tail_rotor: Contribution
    tailplane: Contribution
    fin: Contribution
    fuselage: Contribution
    tail_torque: Scalar


def airframe(
    air: Vector,
    rates: Vector,
    tail_pitch: Scalar,
    wake: Scalar,
    omega: Scalar,
    awake: tuple[Scalar, Scalar],
    par: Named,
    density: Scalar,
    xp: Backend,
    sense: float,
    collective: Scalar | None = None,
    *,
    tail_in_wake: bool = False,
    cross_flow: bool = False,
) -> Airframe:
    """Tail rotor, horizontal tail, fin and fuselage in the wakes of the two rotors.

    Args:
        air: velocity of the CG through the air, body axes [m/s].
        rates: body rates [rad/s].
        tail_pitch: tail rotor collective [rad].
        wake: the main rotor's induced velocity [m/s].
        omega: main rotor speed [rad/s].
        awake: shares of the tail rotor's wake and thrust that are there while it starts; (1, 1) when it turns.
        par, density: the card's numbers, the air.
        sense: +1 for a counter-clockwise main rotor.
        collective: of the main rotor [rad], which an all-moving tail follows; None where the tail stands still.
        tail_in_wake: the main rotor's wake reaches the tail rotor too, as far below the hub as that stands.
        cross_flow: the fuselage's loads in air from anywhere are `fuselage.cross_flow_loads`.
    """
    blowing, fading = awake
    p, q, r = rates
    arm, height = par.tail_arm, par.tail_height
    there = Vector(air.x - height * q, air.y - arm * r + height * p, air.z + arm * q)
    rim = par.tail_arm - par.rotor_radius
    if tail_in_wake:
        swept = tail_surfaces.wake_on_tailplane(
            air.x,
            air.z,
            wake,
            near=rim - par.tail_radius,
            far=rim + par.tail_radius,
            drop=par.hub_height - height,
            most=par.tailplane_wake,
            xp=xp,
        )
        there = Vector(there.x, there.y, there.z - swept)
    cc, sc = xp.cos(par.tail_cant), xp.sin(par.tail_cant)
    against, up = sense * there.y * cc - there.z * sc, there.z * cc + sense * there.y * sc
    tail = tail_rotor.tail_rotor_loads(
        tail_pitch,
        there.x * there.x + up * up,
        -against,
        omega=par.tail_gear * omega,
        density=density,
        radius=par.tail_radius,
        chord=par.tail_chord,
        blades=par.tail_blades,
        lift_slope=par.tail_lift_slope,
        drag=par.tail_drag,
        delta3=par.tail_delta3,
        blade_inertia=par.tail_blade_inertia,
        flap_frequency=par.tail_flap_frequency,
        twist=par.tail_twist,
        xp=xp,
    )
    thrust = tail_rotor.fin_blockage(par.fin_area, par.tail_radius, par.fin_blockage) * fading * tail.thrust

    downwash = tail_surfaces.wake_on_tailplane(
        air.x,
        air.z,
        wake,
        near=rim - par.tail_radius,
        far=rim + par.tail_radius,
        drop=par.tailplane_drop,
        most=par.tailplane_wake,
        xp=xp,
    )
    incidence = par.tailplane_incidence
    if collective is not None:
        incidence = tail_surfaces.stabilator_incidence(
            air.x,
            collective,
            q,
            low=par.stabilator_low,
            high=par.stabilator_high,
            begin=par.stabilator_from,
            end=par.stabilator_to,
            by_collective=par.stabilator_collective,
            neutral=par.stabilator_neutral,
            by_pitch_rate=par.stabilator_pitch_rate,
            xp=xp,
        )
    tailplane = tail_surfaces.inclined_force(
        air.x,
        air.z + par.tailplane_arm * q - downwash,
        incidence,
        area=par.tailplane_area,
        lift_slope=par.tailplane_lift_slope,
        density=density,
        xp=xp,
    )
    fin = tail_surfaces.inclined_force(
        air.x,
        air.y - par.fin_arm * r + par.fin_height * p + sense * par.fin_wake * blowing * tail.induced,
        -sense * par.fin_incidence,
        area=par.fin_area,
        lift_slope=par.fin_lift_slope,
        density=density,
        xp=xp,
    )
    areas = Vector(par.fuselage_area_x, par.fuselage_area_y, par.fuselage_area_z)
    through = par.fuselage_wake * wake
    volumes = {
        "pitch": par.fuselage_pitch_volume,
        "yaw": par.fuselage_yaw_volume,
        "pitch_zero": par.fuselage_pitch_zero,
        "density": density,
    }
    if cross_flow:
        pushed, turned = fuselage.cross_flow_loads(air, through, areas=areas, xp=xp, **volumes)
    else:
        pushed = fuselage.flat_plate_drag(air, through, areas=areas, density=density, xp=xp)
        turned = fuselage.slender_body_moment(air, through, **volumes)
    side, lift = sense * cc * thrust, -sc * thrust
    # Velocity and moments at these places are written out: products with their zeros would cost a tenth of a step.
    return Airframe(
        Contribution(Vector(0.0, side, lift), Vector(height * side, arm * lift, -arm * side)),
        Contribution(Vector(tailplane[0], 0.0, tailplane[1]), Vector(0.0, par.tailplane_arm * tailplane[1], 0.0)),
        Contribution(
            Vector(fin[0], fin[1], 0.0),
            Vector(par.fin_height * fin[1], -par.fin_height * fin[0], -par.fin_arm * fin[1]),
        ),
        Contribution(pushed, turned),
        tail.torque,
    )
