"""The tail rotor: a rotor on its side, without cyclic pitch, that gives thrust and takes torque, blocked by the fin."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.inflow import mass_flow, momentum_inflow


class TailLoads(NamedTuple):
    """Thrust [N], positive towards the side that the tail rotor pushes to, torque [N m] and induced velocity [m/s]."""

    thrust: Scalar
    torque: Scalar
    induced: Scalar


def fin_blockage(fin_area: Scalar, radius: Scalar, share: Scalar) -> Scalar:
    """Part of the thrust that a fin in front of the disc leaves: 1 - share S / (pi R^2) (Lynn et al. 1970: 3/4)."""
    return 1.0 - share * fin_area / (3.141592653589793 * radius * radius)


def coning_feedback(
    *,
    density: Scalar,
    radius: Scalar,
    chord: Scalar,
    lift_slope: Scalar,
    delta3: Scalar,
    blade_inertia: Scalar,
    flap_frequency: Scalar,
) -> Scalar:
    """delta3 gamma / (8 lambda_beta^2): pitch that coning takes or adds, per pitch (Padfield 2007, sec. 3.2.2).

    Coning is a0 = gamma / (8 lambda_beta^2) [(1 + mu^2) theta + (4/5 + 2/3 mu^2) twist + 4/3 (mu_z - lam0)].
    """
    lock = density * lift_slope * chord * radius * radius * radius * radius / blade_inertia
    return delta3 * lock / (8.0 * flap_frequency * flap_frequency)


def tail_rotor_loads(
    pitch: Scalar,
    across2: Scalar,
    towards: Scalar,
    *,
    omega: Scalar,
    density: Scalar,
    radius: Scalar,
    chord: Scalar,
    blades: Scalar,
    lift_slope: Scalar,
    drag: Scalar,
    delta3: Scalar,
    blade_inertia: Scalar,
    flap_frequency: Scalar,
    twist: Scalar,
    xp: Backend,
) -> TailLoads:
    """Blade-element thrust with uniform momentum inflow (Padfield 2007, sec. 3.2.2), before the fin's blockage.

    Args:
        pitch: collective [rad].
        across2: square of the speed of the air across the disc [m^2/s^2].
        towards: speed of the rotor's hub against its thrust [m/s]; positive increases the thrust, as sinking does.
        omega: its rotor speed [rad/s].
        delta3: tangent of the pitch-flap angle: blades that cone by a0 change their pitch by delta3 a0.
        blade_inertia: of one blade about its flapping hinge [kg m^2]; counts only with delta3.
        flap_frequency: lambda_beta, of flapping over rotor speed; counts only with delta3.
        twist: from root to tip [rad].
    """
    tip = omega * radius
    solidity = blades * chord / (3.141592653589793 * radius)
    mu2, mu_z = across2 / (tip * tip), towards / tip
    scale = 0.5 * lift_slope * solidity
    feed = coning_feedback(
        density=density,
        radius=radius,
        chord=chord,
        lift_slope=lift_slope,
        delta3=delta3,
        blade_inertia=blade_inertia,
        flap_frequency=flap_frequency,
    )
    kept = 1.0 / (1.0 - feed * (1.0 + mu2))
    by_pitch = 1.0 / 3.0 + 0.5 * mu2
    by_flow = 0.5 + by_pitch * kept * feed * (4.0 / 3.0)
    by_twist = 0.25 * (1.0 + mu2) + by_pitch * kept * feed * (0.8 + 2.0 / 3.0 * mu2)
    free = by_pitch * kept * pitch + by_twist * twist + by_flow * mu_z
    lam0 = momentum_inflow(scale * free, scale * by_flow, mu_z, mu2, xp)
    v, _, _ = mass_flow(lam0, mu_z, mu2, xp)
    CT = 2.0 * lam0 * v
    # Teetering and without cyclic: the in-plane force is small and its power is within the profile's 1 + 4.65 mu^2.
    CQ = (lam0 - mu_z) * CT + 0.125 * solidity * drag * (1.0 + 4.65 * mu2)
    pressure = density * 3.141592653589793 * radius * radius * tip * tip
    return TailLoads(pressure * CT, pressure * radius * CQ, lam0 * tip)
