"""The Bell-Hiller stabilizer bar: paddles that follow the fuselage late and feed the blades' cyclic pitch."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Scalar


class Bar(NamedTuple):
    """Tilt of the bar's tip-path plane against the shaft [rad]: c aft, d right positive."""

    c: Scalar
    d: Scalar


def bar_lock_number(
    *, density: Scalar, lift_slope: Scalar, chord: Scalar, inner: Scalar, outer: Scalar, inertia: Scalar
) -> Scalar:
    """gamma_s = rho a_s c_s (R_out^4 - r_in^4) / I_s of paddles between two radii (Mettler 2003, sec. 3.4)."""
    return density * lift_slope * chord * (outer * outer * outer * outer - inner * inner * inner * inner) / inertia


def bar_rates(
    bar: Bar, p: Scalar, q: Scalar, A1: Scalar, B1: Scalar, *, lock: Scalar, omega: Scalar, cyclic: Scalar
) -> Bar:
    """Rates of the bar [rad/s]: a teetering rotor without thrust, time constant 16 / (gamma_s Omega) (Mettler 2003).

    `cyclic` is the paddles' pitch per stick (the Hiller part).
    """
    rate = lock * omega / 16.0
    return Bar(-q - rate * (bar.c + cyclic * B1), -p - rate * (bar.d - cyclic * A1))


def mixed_cyclic(A1: Scalar, B1: Scalar, bar: Bar, gain: Scalar) -> tuple[Scalar, Scalar]:
    """Cyclic pitch (A1, B1) of the blades from stick and bar (the Bell part is the stick's own)."""
    return A1 + gain * bar.d, B1 - gain * bar.c
