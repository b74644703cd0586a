"""The tail rotor: a teetering rotor on its side that gives thrust and takes torque, blocked in part by the fin."""

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
    """
    tip = omega * radius
    solidity = blades * chord / (3.141592653589793 * radius)
    mu2, mu_z = across2 / (tip * tip), towards / tip
    scale = 0.5 * lift_slope * solidity
    # Coning a0 = (gamma / 8)((1 + mu^2) theta + (4/3)(mu_z - lam0)) feeds back through delta3.
    feed = delta3 * density * lift_slope * chord * radius * radius * radius * radius / (8.0 * blade_inertia)
    kept = 1.0 / (1.0 - feed * (1.0 + mu2))
    by_pitch = 1.0 / 3.0 + 0.5 * mu2
    by_flow = 0.5 + by_pitch * kept * feed * (4.0 / 3.0)
    lam0 = momentum_inflow(scale * (by_pitch * kept * pitch + by_flow * mu_z), scale * by_flow, mu_z, mu2, xp)
    v, _, _ = mass_flow(lam0, mu_z, mu2, xp)
    CT = 2.0 * lam0 * v
    # Teetering and without cyclic: the in-plane force is small and its power is within the profile's 1 + 4.65 mu^2.
    CQ = (lam0 - mu_z) * CT + 0.125 * solidity * drag * (1.0 + 4.65 * mu2)
    pressure = density * 3.141592653589793 * radius * radius * tip * tip
    return TailLoads(pressure * CT, pressure * radius * CQ, lam0 * tip)
