"""The tip-path plane of a rotor on teetering, sprung or offset hinges, as two first-order states.

Blade flapping beta'' + lambda_b^2 beta = (aerodynamics), with beta = a0 - a1 cos - b1 sin and a1, b1 slow: their second
derivatives, the advancing flap mode at about twice the rotor speed, are left out (Chen 1980; Mettler 2003, sec. 3.2).
In that form the rates of the tip-path plane in space, q + da1/dt and p + db1/dt, follow from one two-by-two system.
"""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.blade_element import FlapMoments
from swashplate.physics.inflow import APPARENT_GRADIENT


class Flapping(NamedTuple):
    """Tilt of the tip-path plane against the shaft [rad]: a1 aft, b1 right positive (right as seen, either sense)."""

    a1: Scalar
    b1: Scalar


class Hinge(NamedTuple):
    """How a blade is held: flap frequency above one per revolution, and what tilting the disc does to the hub.

    Attributes:
        excess: lambda_b^2 - 1.
        lock: Lock number gamma = rho a c R^4 / I_b, less what a hinge that is not in the centre takes off it.
        moment: hub moment per tilt [N m/rad].
        offset: the hinge's part of the excess: hub rates turn a blade by 1 + offset times its own inertia.
        damping: flapping about the hinge over the same motion about the centre, in the air's moments.
        stiffness_pace: time that the disc takes to move against the shaft over first order's (`regressing_pace`).
    """

    excess: Scalar
    lock: Scalar
    moment: Scalar
    offset: Scalar = 0.0
    damping: Scalar = 1.0
    stiffness_pace: Scalar = 1.0


def regressing_pace(excess: Scalar, xp: Backend) -> Scalar:
    """(1 + lambda_b) / 2: with it a first-order disc has the regressing flap mode of its blades, (lambda_b - 1) Omega.

    In axes that do not turn, z'' - 2 i Omega z' + (lambda_b^2 - 1) Omega^2 z = 0 has the modes i (1 +- lambda_b) Omega
    (Johnson 1980, sec. 12-1). Left out, z'' leaves (lambda_b^2 - 1) / 2, which is a half more at lambda_b = 2. Keeping
    the slow mode itself, z' (1 + lambda_b) in place of 2 z', keeps it exact without air, and every steady tilt.
    """
    return 0.5 * (1.0 + xp.sqrt(1.0 + excess))


def hinge(
    *,
    blade_inertia: Scalar,
    blades: Scalar,
    hub_stiffness: Scalar,
    hinge_offset: Scalar,
    omega: Scalar,
    density: Scalar,
    lift_slope: Scalar,
    chord: Scalar,
    radius: Scalar,
    first_moment: Scalar = 1.0,
) -> Hinge:
    """Flap frequency and hub stiffness from the blade and the hub (Bramwell 2001, eqs 1.9 and 3.60).

    `hub_stiffness` is the whole hub's [N m/rad], N_b / 2 times a blade's spring; `hinge_offset` a fraction e of R. Two
    blades pass their moment on twice per revolution unevenly; the mean over a revolution is taken.

    `first_moment` is the blade's first moment about the hinge over that of an even blade with the same inertia, 3/2 of
    I / ((1 - e) R); the centrifugal force on the offset, and the hub moment that it makes, are in proportion to it.

    Blades that begin at the hinge have less moment of the air: by pitch and hub rates 4 int_e^1 (x - e) x^2 dx =
    1 - 4 e / 3 + e^4 / 3, by flapping 4 int_e^1 (x - e)^2 x dx = 1 - 8 e / 3 + 2 e^2 - e^4 / 3 of that about the centre
    (Chen 1980). The first is used for the terms with advance ratio too (exactly 1 - 3 e / 2: 1 % at e = 0.05).
    """
    cubed = hinge_offset * hinge_offset * hinge_offset
    by_pitch = 1.0 - hinge_offset * (4.0 - cubed) / 3.0
    by_flapping = 1.0 - hinge_offset * (8.0 - 6.0 * hinge_offset + cubed) / 3.0
    centrifugal = blade_inertia * omega * omega
    offset = first_moment * (1.5 * hinge_offset / (1.0 - hinge_offset))
    half = 0.5 * blades
    return Hinge(
        hub_stiffness / (half * centrifugal) + offset,
        by_pitch * density * lift_slope * chord * radius * radius * radius * radius / blade_inertia,
        hub_stiffness + half * centrifugal * offset,
        offset,
        by_flapping / by_pitch,
    )


def coning(moment: Scalar, held: Hinge, precone: Scalar, *, free: Scalar) -> Scalar:
    """Steady coning angle a0 [rad]: the built-in one, or with `free` = 1 that of blades that cone by themselves."""
    flying = 0.5 * held.lock * moment / (1.0 + held.excess)
    return precone + free * (flying - precone)


def plane_rates(
    flapping: Flapping,
    moments: FlapMoments,
    held: Hinge,
    shaft: tuple[Scalar, Scalar] = (0.0, 0.0),
    *,
    wake_distortion: Scalar,
    phase_lag: tuple[Scalar, Scalar] | None,
) -> tuple[Scalar, Scalar]:
    """(p, q): rates of the tip-path plane in space over the rotor speed.

    cos:  (1 - K_R) q + (16/gamma) p = -S a1 - 4 M_c,      sin:  (1 - K_R) p - (16/gamma) q = -S b1 - 4 M_s

    A hinge at an offset damps flapping less than it feels the shaft turn: with d = `damping`, (1 - K_R) q becomes
    (d - K_R) q + (1 - d) q_shaft, and (16/gamma) p becomes (16/gamma) (p + offset p_shaft). Stiff blades move the disc
    against the shaft more slowly: p becomes p_shaft + pace (p - p_shaft), with pace = `stiffness_pace`.

    Args:
        flapping: its tilt (counter-clockwise rotor).
        moments: `flap_moments` of the disc with p = q = 0, and a1, b1 times the hinge's `damping`.
        shaft: its rates (p, q) over the rotor speed; count only with an offset.
        held: the hinge; S = 8 (lambda_b^2 - 1) / gamma.
        wake_distortion: K_R; the wake bends with the disc's turning and puts K_R (q cos + p sin) onto the inflow
            (Keller 1996; Arnold, Keller, Curtiss and Reichert 1998), as far as it keeps up (`wake_follows`).
        phase_lag: (cos, sin) of the angle by which the air's moments come late (Mansur and Tischler 1998), or None.
    """
    m, inertia = held.damping - wake_distortion, 16.0 / held.lock
    stiffness = 8.0 * held.excess / held.lock
    p_shaft, q_shaft = shaft
    # aerodynamic moment times 4: D (4 M + m W), W = (q, p); rows cos and sin
    c = 4.0 * moments.cos + (1.0 - held.damping) * q_shaft
    s = 4.0 * moments.sin + (1.0 - held.damping) * p_shaft
    w_cq, w_cp, w_sq, w_sp = m, 0.0, 0.0, m
    if phase_lag is not None:
        cosine, sine = phase_lag
        c, s = cosine * c - sine * s, sine * c + cosine * s
        w_cq, w_cp, w_sq, w_sp = (
            cosine * w_cq - sine * w_sq,
            cosine * w_cp - sine * w_sp,
            sine * w_cq + cosine * w_sq,
            sine * w_cp + cosine * w_sp,
        )
    pace = held.stiffness_pace
    w_cp, w_sq = w_cp + inertia * pace, w_sq - inertia * pace
    by_shaft = inertia * (held.offset - (pace - 1.0))
    right_c = -stiffness * flapping.a1 - c - by_shaft * p_shaft
    right_s = -stiffness * flapping.b1 - s + by_shaft * q_shaft
    determinant = w_cq * w_sp - w_cp * w_sq
    q = (right_c * w_sp - right_s * w_cp) / determinant
    p = (right_s * w_cq - right_c * w_sq) / determinant
    return p, q


def faded_wake_distortion(hover: Scalar, mu2: Scalar, fade: Scalar, xp: Backend) -> Scalar:
    """K_R at an advance ratio squared: its hover value, falling smoothly to zero at the advance ratio `fade`.

    A wake that is blown away no longer bends above the disc; by mu = 0.15 to 0.2 nothing of it is left.
    """
    rest = xp.maximum(0.0, 1.0 - mu2 / (fade * fade))
    return hover * rest * rest


def wake_lateness(excess: Scalar, v2: Scalar) -> Scalar:
    """k^2: how late the bending wake comes for a disc that springs and hinges turn, in radians of that turning.

    The bent wake's gradient comes late by APPARENT_GRADIENT / V of the rotor's turning (Pitt and Peters 1981 in hover,
    V the flow through the disc). Springs and hinges turn the disc at excess / 2 of the rotor speed. k is their product.

    Args:
        excess: lambda_b^2 - 1.
        v2: V^2, dimensionless (`inflow.mass_flow`).
    """
    k = 0.5 * APPARENT_GRADIENT * excess
    return k * k / v2


def wake_follows(excess: Scalar, v2: Scalar, xp: Backend) -> Scalar:
    """Share of K_R that is left where the wake is too slow for the disc: exactly 1 in flight, 0 without a wake.

    1 / (1 + k^2) of a late gradient is in phase with the disc's rate. A card's K_R comes from flight, where k is about
    0.1 and that share part of the number; so the fall begins at k = 1, and goes over into 1 / k^2.

    Without it K_R above 1 is a negative damping that grows with the springs over the centrifugal force: a stopped rotor
    would shake itself to pieces in still air.
    """
    lateness = xp.maximum(0.0, wake_lateness(excess, v2) - 1.0)
    return 1.0 / xp.sqrt(1.0 + lateness * lateness)


def precession_torque(disc: Flapping, p: Scalar, q: Scalar, *, inertia: Scalar, omega: Scalar) -> Scalar:
    """Torque [N m] that a tilted rotor takes off its shaft when the shaft rolls and pitches: I Omega (p b1 + q a1).

    The angular momentum I Omega of the turning blades points along the tip-path plane's normal; carried around by p and
    q it changes along the shaft (the vertical part of rates x H). The blades' aerodynamic torque holds this part (the
    moment that precesses the disc, leaning with it), but not the shaft, to which blades pass only what is left.

    Args:
        disc: tip-path plane, counter-clockwise axes.
        p, q: rates of the shaft [rad/s], counter-clockwise axes.
        inertia: of all blades about the shaft [kg m^2].
        omega: rotor speed [rad/s].
    """
    return inertia * omega * (p * disc.b1 + q * disc.a1)
