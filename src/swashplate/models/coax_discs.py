"""The CoaX's two discs by the flapping of their blades: tilt by speed, rates and cyclic pitch, in-plane forces, coning.

Each rotor is the single-rotor helicopter's (`conventional.main_rotor`), one turning each way at a speed of its own, in
air that comes down as fast as the other's wake brings it (as `coaxial.coaxial` has them). What the paper gives numbers
of their own follows from the blades: flap-back, the tilt across the motion, damping of roll, pitch and yaw, the
blades' gyroscopic moment.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from swashplate.models.coax_rotors import SLOWEST, InflowOptions, air_between
from swashplate.models.coaxial.coaxial_parameters import OneRotor
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.models.conventional.main_rotor import Contribution, MainRotor, main_rotor
from swashplate.physics import blade_element, coaxial_wake, flapping, ground_effect, inflow
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.coaxial_wake import Induced
from swashplate.physics.environment import LABORATORY_GRAVITY
from swashplate.physics.flapping import Flapping
from swashplate.physics.frames import Vector
from swashplate.physics.inflow import Inflow
from swashplate.physics.rotor import TipPathPlane

_PI = 3.141592653589793
UNITS = {"blade_inertia": "kg m^2"}
"""What flapping blades need beside the numbers of `coax_rotors.UNITS`."""
_SENSES = (1.0, -1.0)  # upper and lower rotor, counter-clockwise from above positive


class DiscPair(NamedTuple):
    """What both rotors pass on, their tilts [rad] and how these move [rad/s]; upper first.

    `acting` is without the shafts' reactions to a change of rotor speed. `lift` [N] is along the shafts.
    """

    acting: Contribution
    planes: tuple[TipPathPlane, TipPathPlane]
    turning: tuple[TipPathPlane, TipPathPlane]
    lift: tuple[Scalar, Scalar]
    torque: tuple[Scalar, Scalar]
    inflow: Induced


def _numbers(par: Any, side: str) -> tuple[Scalar, Any]:
    """Pitch at the root [rad], and the numbers of one rotor as `main_rotor` reads them: its hinge has only a spring."""
    pitch = getattr(par, f"pitch_{side}")
    named: Any = OneRotor
    return pitch - 0.75 * par.rotor_twist, named(
        rotor_radius=par.rotor_radius,
        rotor_chord=par.rotor_chord,
        rotor_blades=par.rotor_blades,
        rotor_lift_slope=par.rotor_lift_slope,
        rotor_drag=getattr(par, f"rotor_drag_{side}"),
        rotor_drag_thrust=0.0,
        rotor_twist=par.rotor_twist,
        rotor_speed=getattr(par, f"k_drive_{side}"),
        blade_inertia=par.blade_inertia,
        blade_first_moment=1.0,
        hub_stiffness=getattr(par, f"hub_stiffness_{side}"),
        hinge_offset=0.0,
        precone=0.0,
        hub_x=0.0,
        hub_y=0.0,
        wake_distortion=0.0,
        wake_distortion_fade=1.0,
        phase_lag=0.0,
        cyclic_phase=0.0,
        rotor_tip_loss=par.tip_loss,
        rotor_root_cutout=par.root_cutout,
        rotor_induced_factor=par.induced_factor,
        hub_height=getattr(par, f"hub_height_{side}"),
        shaft_tilt=0.0,
    )


def switches(sense: float, options: InflowOptions) -> HelicopterOptions:
    """What the blades of a rotor do: everything that the single rotor's equations have without a state of its own."""
    return HelicopterOptions(
        rotation="ccw" if sense > 0.0 else "cw",
        inflow="pitt-peters-static",
        coning=True,
        tip_loss=True,
        induced_factor=True,
        yaw_at_blades=True,
        precession_torque=True,
        stiff_blades=True,
        ground_effect=options.ground_effect,
    )


def cyclic_for(
    tilt: TipPathPlane, omega: Scalar, share: Scalar, par: Any, side: str, sense: float, density: Scalar, xp: Backend
) -> tuple[Scalar, Scalar]:
    """Cyclic pitch (A1, B1) [rad] that tilts the disc so in hover: what swashplate or bar ask for.

    The card's linkages and phase lags are those of the tilt that a bench sees, which has the blades' spring and their
    wake in it: a1 + i b1 = (B1 ...) / (1 + i S / d), S = 8 (lambda^2 - 1) / gamma, and d what the wake of a tilting
    moment leaves of that moment. Each rotor carries half of the weight here.

    Args:
        tilt: asked for, body axes.
        omega: rotor speed [rad/s].
        share: of the other's induced flow at this disc, in hover.
        par, density: the card's numbers, the air.
        side, sense: of the rotor.
    """
    area = _PI * par.rotor_radius * par.rotor_radius
    solidity = par.rotor_blades * par.rotor_chord * par.rotor_radius / area
    blade = blade_element.span(par.tip_loss, par.root_cutout)
    slope = par.rotor_lift_slope * 4.0 * blade.m3
    carried = (
        par.mass * LABORATORY_GRAVITY / (4.0 * density * area * (1.0 + share))
    )  # v (v + share v) of half the weight
    lam0 = xp.sqrt(carried) / (omega * par.rotor_radius)
    flow = inflow.gradient_flow(lam0, -share * lam0, 0.0, lam0 + share * lam0)
    _, (left, _, _) = inflow.pitt_peters_static(lam0, 0.0, (0.0, 0.0), flow, solidity, slope)
    held = flapping.hinge(
        blade_inertia=par.blade_inertia,
        blades=par.rotor_blades,
        hub_stiffness=getattr(par, f"hub_stiffness_{side}"),
        hinge_offset=0.0,
        omega=omega,
        density=density,
        lift_slope=slope,
        chord=par.rotor_chord,
        radius=par.rotor_radius,
    )
    stiffness = 8.0 * held.excess / held.lock / left
    a1, b1 = tilt.beta, sense * tilt.alpha
    lateral, longitudinal = b1 + stiffness * a1, stiffness * b1 - a1  # of a counter-clockwise rotor
    return sense * lateral, longitudinal


def disc_pair(
    air: Vector,
    rates: Vector,
    asked: tuple[TipPathPlane, TipPathPlane],
    planes: tuple[TipPathPlane, TipPathPlane] | None,
    omegas: tuple[Scalar, Scalar],
    own: Induced,
    heights: tuple[Scalar, Scalar],
    par: Any,
    density: Scalar,
    options: InflowOptions,
    xp: Backend,
) -> DiscPair:
    """Both rotors, upper first.

    Args:
        air: velocity of the CG through the air, body axes [m/s].
        rates: body rates [rad/s].
        asked: tilts that the bar and the swashplate ask for [rad].
        planes: tilts of the discs [rad]; None where they follow the blades' steady flapping at once.
        omegas: rotor speeds [rad/s].
        own: induced velocities of their own thrusts [m/s].
        heights: of the rotors above the ground [m]; they count with ground effect only.
        par, density: the card's numbers, the air.
        options: of the card.
        xp: the operations.
    """
    across2 = air.x * air.x + air.y * air.y
    area = _PI * par.rotor_radius * par.rotor_radius
    _, given = air_between(-air.z, across2, own, par, options, xp)
    calm, _ = air_between(0.0, 0.0, Induced(1.0, 1.0), par, options, xp)
    force, moment = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    tilts, turns, lifts, torques, inflows = [], [], [], [], []
    for i, side in enumerate(("upper", "lower")):
        sense = _SENSES[i]
        omega = xp.maximum(omegas[i], SLOWEST * getattr(par, f"k_drive_{side}"))
        fading = xp.maximum(0.0, xp.minimum(1.0, omegas[i] / omega))
        fading = fading * fading
        tip = omega * par.rotor_radius
        near = ground_effect.induced_share(
            heights[i], across2, own[i] + given[i], radius=par.rotor_radius, form=options.ground_effect, xp=xp
        )
        through = Vector(air.x, air.y, air.z - near * given[i])
        root, numbers = _numbers(par, side)
        share = (calm.on_upper, calm.on_lower)[i]
        lateral, longitudinal = cyclic_for(asked[i], omega, share, par, side, sense, density, xp)
        pitches = (root, lateral, longitudinal)

        def rotor(
            tilt: Flapping,
            i: int = i,
            sense: float = sense,
            omega: Scalar = omega,
            met: Scalar = tip - sense * rates.z * par.rotor_radius,  # by the blades, which the yaw carries along
            through: Vector = through,
            numbers: Any = numbers,
            pitches: Any = pitches,
        ) -> MainRotor:
            flow = Inflow(own[i] / met, 0.0, 0.0)
            said = switches(sense, options)
            return main_rotor(through, rates, tilt, flow, pitches, omega, numbers, density, xp, said, heights[i])

        tilt = _settled(rotor) if planes is None else Flapping(planes[i].beta, planes[i].alpha)
        single = rotor(tilt)
        force = force + single.acting.force.scaled(fading)
        moment = moment + single.acting.moment.scaled(fading)
        lift = -fading * single.acting.force.z
        tilts.append(TipPathPlane(tilt.b1, tilt.a1))
        turns.append(TipPathPlane(single.disc.b1, single.disc.a1))
        lifts.append(lift)
        torques.append(fading * single.torque)
        inflows.append(
            coaxial_wake.induced_rate(
                own[i],
                own[i] + given[i],
                -air.z,
                across2,
                lift / (density * area),
                radius=par.rotor_radius,
                xp=xp,
            )
        )
    return DiscPair(
        Contribution(force, moment),
        (tilts[0], tilts[1]),
        (turns[0], turns[1]),
        (lifts[0], lifts[1]),
        (torques[0], torques[1]),
        Induced(inflows[0], inflows[1]),
    )


def _settled(rotor: Any) -> Flapping:
    """The tilt at which a disc stands still against its shaft; its rates are a straight function of the tilt."""
    rest, aft, right = (rotor(Flapping(*tilt)).disc for tilt in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    cc, sc = aft.a1 - rest.a1, aft.b1 - rest.b1
    cs, ss = right.a1 - rest.a1, right.b1 - rest.b1
    determinant = cc * ss - cs * sc
    return Flapping((cs * rest.b1 - ss * rest.a1) / determinant, (sc * rest.a1 - cc * rest.b1) / determinant)
