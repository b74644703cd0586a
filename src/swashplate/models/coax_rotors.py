"""The CoaX's two rotors with inflow: thrust and torque that know climb, descent, flight across and each other's wake.

Blade elements and momentum theory as for the single-rotor helicopter (`physics.blade_element`), in place of the paper's
k Omega^2. The tip-path planes stay the paper's: the loads act along and about them (`coax_discs` has those of blades).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from swashplate.errors import CardError
from swashplate.models.card import Card
from swashplate.physics import blade_element, coaxial_wake, ground_effect
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.coaxial_wake import Induced, WakeShares
from swashplate.physics.environment import LABORATORY_GRAVITY
from swashplate.physics.frames import Vector

_PI = 3.141592653589793
SLOWEST = 0.1
"""Share of the full speed below which a rotor's coefficients no longer change and its loads fade with Omega^2."""

UNITS: Mapping[str, str] = {
    "rotor_blades": "1",
    "rotor_chord": "m",
    "rotor_lift_slope": "1/rad",
    "rotor_twist": "rad",
    "pitch_upper": "rad",
    "pitch_lower": "rad",
    "rotor_drag_upper": "1",
    "rotor_drag_lower": "1",
    "tip_loss": "1",
    "root_cutout": "1",
    "induced_factor": "1",
}
"""What `rotor = "inflow"` needs beside the paper's numbers."""


_NEEDED = {
    "rotor_blades": "number of blades of each rotor",
    "rotor_chord": "blade chord at 3/4 radius",
    "rotor_lift_slope": "lift curve slope of the blades; 4 to 5.5 at small Reynolds numbers",
    "rotor_twist": "from root to tip, negative washes out; 0 for flat blades",
    "pitch_upper": "fixed pitch of the upper blades at 3/4 radius, from the zero-lift line",
    "pitch_lower": "the same of the lower blades",
    "rotor_drag_upper": "profile drag coefficient of the upper blades; 0.02 to 0.06 at small Reynolds numbers",
    "rotor_drag_lower": "the same of the lower blades",
    "tip_loss": "share of the radius to which blades lift; 0.97, 1 for none",
    "root_cutout": "radius of the first profile over the rotor's; 0 for none",
    "induced_factor": "induced power over that of an even inflow; 1.15, 1 for none",
}


class InflowOptions(NamedTuple):
    """What a card says of rotors with inflow.

    Attributes:
        interference: one of `coaxial_wake.FORMS`.
        ground_effect: one of `ground_effect.FORMS`, over ground at z = 0.
        flapping: of the discs: "paper" (its equations with fitted constants), "blades" (`coax_discs`: blades flap,
            with their own lag), or "settled-blades" (they follow at once, the swashplate with the paper's lag).
    """

    interference: str = "vortex-tube"
    ground_effect: str = "none"
    flapping: str = "paper"


FLAPPINGS = ("paper", "blades", "settled-blades")


class RotorPair(NamedTuple):
    """Thrusts [N], aerodynamic torques [N m], rates of the induced velocities [m/s^2] and the flow's shares."""

    thrust_upper: Scalar
    thrust_lower: Scalar
    torque_upper: Scalar
    torque_lower: Scalar
    inflow: Induced
    shares: WakeShares


def _rotor(
    tip: Scalar, axial: Scalar, across: Vector, flow: Scalar, own: Scalar, pitch: Scalar, drag: Scalar, par: Any
) -> tuple[Scalar, Scalar]:
    """C_T and C_Q; `flow` is the whole induced flow and `own` the part that the rotor's own thrust makes [m/s]."""
    solidity = par.rotor_blades * par.rotor_chord / (_PI * par.rotor_radius)
    blade = blade_element.span(par.tip_loss, par.root_cutout)
    mu_x, mu_y, mu_z, lam = across.x / tip, across.y / tip, -axial / tip, flow / tip
    root = pitch - 0.75 * par.rotor_twist
    disc = blade_element.Disc(mu_x, mu_y, mu_z, lam, 0.0, 0.0, 0.0, 0.0, root, par.rotor_twist, 0.0, 0.0, 0.0, 0.0, 0.0)
    CT = blade_element.thrust_coefficient(disc, solidity, par.rotor_lift_slope, blade)
    mu2 = mu_x * mu_x + mu_y * mu_y
    uneven = (par.induced_factor - 1.0) * own / tip
    profile = (
        0.5 * solidity * drag * blade.d3 * (1.0 + 4.65 * mu2)
    )  # with the in-plane drag's power, as for tail rotors
    return CT, (lam - mu_z + uneven) * CT + profile


def air_between(
    axial: Scalar, across2: Scalar, own: Induced, par: Any, options: InflowOptions, xp: Backend
) -> tuple[WakeShares, tuple[Scalar, Scalar]]:
    """The flow's shares, and what the upper and the lower disc get of the other's induced flow [m/s]."""
    shares = coaxial_wake.wake_shares(
        axial,
        across2,
        own,
        separation=par.hub_height_upper - par.hub_height_lower,
        radius=par.rotor_radius,
        form=options.interference,
        xp=xp,
    )
    return shares, (shares.on_upper * own.induced_lower, shares.on_lower * own.induced_upper)


def rotor_pair(
    air: Vector,
    normals: tuple[Vector, Vector],
    omegas: tuple[Scalar, Scalar],
    own: Induced,
    heights: tuple[Scalar, Scalar],
    par: Any,
    density: Scalar,
    options: InflowOptions,
    xp: Backend,
) -> RotorPair:
    """Both rotors, upper first.

    Args:
        air: velocity through the air, body axes [m/s].
        normals: of the tip-path planes, upwards, body axes.
        omegas: rotor speeds [rad/s].
        own: induced velocities of their own thrusts [m/s].
        heights: of the rotors above the ground [m]; they count with ground effect only.
        par: the card's numbers, with those of `UNITS`.
        density: of the air [kg/m^3].
        options: of the card.
        xp: the operations.
    """
    radius = par.rotor_radius
    area = _PI * radius * radius
    across2 = air.x * air.x + air.y * air.y
    axial = tuple(air.x * n.x + air.y * n.y + air.z * n.z for n in normals)
    shares, given = air_between(0.5 * (axial[0] + axial[1]), across2, own, par, options, xp)
    flows = (own.induced_upper + given[0], own.induced_lower + given[1])
    full = (par.k_drive_upper, par.k_drive_lower)
    pitches, drags = (par.pitch_upper, par.pitch_lower), (par.rotor_drag_upper, par.rotor_drag_lower)
    thrusts, torques, rates = [], [], []
    for i in (0, 1):
        omega = xp.maximum(omegas[i], SLOWEST * full[i])
        turning = xp.maximum(0.0, xp.minimum(1.0, omegas[i] / omega))
        tip = omega * radius
        near = ground_effect.induced_share(
            heights[i], across2, flows[i], radius=radius, form=options.ground_effect, xp=xp
        )
        CT, CQ = _rotor(tip, axial[i], air, near * flows[i], near * own[i], pitches[i], drags[i], par)
        pressure = density * area * tip * tip * turning * turning
        thrusts.append(pressure * CT)
        torques.append(pressure * radius * CQ)
        loading = tip * tip * turning * turning * CT
        rates.append(coaxial_wake.induced_rate(own[i], flows[i], axial[i], across2, loading, radius=radius, xp=xp))
    return RotorPair(thrusts[0], thrusts[1], torques[0], torques[1], Induced(rates[0], rates[1]), shares)


class BalancedHover(NamedTuple):
    """Both rotors in hover: speeds [rad/s], thrusts [N], the torque that each takes [N m], induced velocities."""

    omega_upper: Scalar
    omega_lower: Scalar
    thrust_upper: Scalar
    thrust_lower: Scalar
    torque: Scalar
    induced: Induced


_HALVINGS = 60


def balanced_hover(par: Any, options: InflowOptions, xp: Backend) -> BalancedHover:
    """The hover out of ground effect in which both torques balance and both thrusts carry the weight, on plain floats.

    Everything scales with Omega^2 there, so that one number is sought, the ratio of the rotor speeds, by halving.
    Level, at the card's air density, in its gravity.
    """
    level, still = Vector(0.0, 0.0, -1.0), Vector(0.0, 0.0, 0.0)
    free_air = options._replace(ground_effect="none")

    def at(upper: float, lower: float) -> tuple[RotorPair, Induced]:
        induced = _settled_inflow(upper, lower, par, options, xp)
        omegas, far = (upper, lower), (_FAR, _FAR)
        return rotor_pair(still, (level, level), omegas, induced, far, par, par.air_density, free_air, xp), induced

    middle = 0.5 * par.k_drive_lower
    low, high = 0.25, 4.0
    for _ in range(_HALVINGS):
        ratio = (low * high) ** 0.5
        pair, _induced = at(ratio * middle, middle)
        low, high = (low, ratio) if pair.torque_upper > pair.torque_lower else (ratio, high)
    pair, induced = at(ratio * middle, middle)
    scale = par.mass * LABORATORY_GRAVITY / max(pair.thrust_upper + pair.thrust_lower, _LEAST)
    faster = scale**0.5
    return BalancedHover(
        ratio * middle * faster,
        middle * faster,
        pair.thrust_upper * scale,
        pair.thrust_lower * scale,
        0.5 * (pair.torque_upper + pair.torque_lower) * scale,
        Induced(induced.induced_upper * faster, induced.induced_lower * faster),
    )


_FAR = 1e6
_LEAST = 1e-6


def _settled_inflow(omega_upper: Scalar, omega_lower: Scalar, par: Any, options: InflowOptions, xp: Backend) -> Induced:
    """Induced velocities [m/s] at rest in free air at these rotor speeds."""
    solidity = par.rotor_blades * par.rotor_chord / (_PI * par.rotor_radius)
    blade = blade_element.span(par.tip_loss, par.root_cutout)
    still = blade_element.Disc(*(0.0,) * 15)
    free, loss = [], []
    for omega, pitch in ((omega_upper, par.pitch_upper), (omega_lower, par.pitch_lower)):
        tip = omega * par.rotor_radius
        disc = still._replace(theta0=pitch - 0.75 * par.rotor_twist, twist=par.rotor_twist)
        free.append(tip * tip * blade_element.thrust_coefficient(disc, solidity, par.rotor_lift_slope, blade))
        loss.append(tip * 0.5 * solidity * par.rotor_lift_slope * blade.m1)
    shares, _ = air_between(0.0, 0.0, Induced(1.0, 1.0), par, options, xp)  # at rest they depend on no velocity
    return coaxial_wake.hover_induced(
        (free[0], free[1]), (loss[0], loss[1]), on_upper=shares.on_upper, on_lower=shares.on_lower, xp=xp
    )


def checked_blades(card: Card, options: InflowOptions) -> Card:
    """The card itself, if it has what rotors with inflow need and no number that no rotor has.

    Raises:
        CardError: naming the number, what it is and what is expected.
    """
    value = card.values()

    def refuse(name: str, problem: str, hint: str | None = None) -> None:
        raise CardError(problem, where=card.where, channel=name, hint=hint)

    flaps = options.flapping != "paper"
    needed = [(name, UNITS[name], meaning, "rotor = 'inflow'") for name, meaning in _NEEDED.items()]
    if flaps:
        told = "of one blade about its root; at most half of what a two-bladed rotor and its drive have"
        needed.append(("blade_inertia", "kg m^2", told, f"flapping = '{options.flapping}'"))
    for name, unit, meaning, asking in needed:
        if name not in value:
            told = f'unit = "{unit}", source and status'
            refuse(
                name,
                f"is missing, and {asking} needs it ({meaning}).",
                f"Add [parameters.{name}] with value, {told}; the packaged card 'coax' has the CoaX's.",
            )
    for name in ("rotor_chord", "rotor_lift_slope", *(("blade_inertia",) if flaps else ())):
        if not value[name] > 0.0:
            refuse(name, f"is {value[name]:g}, expected more than 0.")
    for name in ("rotor_drag_upper", "rotor_drag_lower"):
        if value[name] < 0.0:
            refuse(name, f"is {value[name]:g}, expected 0 or more.")
    for name in ("pitch_upper", "pitch_lower", "rotor_twist"):
        if abs(value[name]) > 1.0:
            refuse(name, f"is {value[name]:g} rad, more than 57 deg.", "Angles in cards are in radians.")
    if value["rotor_blades"] != round(value["rotor_blades"]) or value["rotor_blades"] < 2.0:
        refuse("rotor_blades", f"is {value['rotor_blades']:g}, expected a whole number of at least 2.")
    if value["rotor_chord"] >= value["rotor_radius"]:
        refuse("rotor_chord", f"is {value['rotor_chord']:g} m, longer than rotor_radius {value['rotor_radius']:g} m.")
    if not 0.0 <= value["root_cutout"] < 0.6:
        refuse("root_cutout", f"is {value['root_cutout']:g}, expected 0 to 0.6 of the radius.")
    if not 0.8 <= value["tip_loss"] <= 1.0:
        refuse("tip_loss", f"is {value['tip_loss']:g}, expected 0.8 to 1.")
    if not 1.0 <= value["induced_factor"] <= 2.0:
        refuse("induced_factor", f"is {value['induced_factor']:g}, expected 1 to 2.")
    if value["hub_height_upper"] <= value["hub_height_lower"]:
        refuse(
            "hub_height_upper",
            f"is {value['hub_height_upper']:g} m, not above hub_height_lower {value['hub_height_lower']:g} m.",
            "Wakes go down: the upper rotor is the one above.",
        )
    return card
