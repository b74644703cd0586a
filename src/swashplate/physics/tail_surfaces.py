"""Horizontal and vertical tail in the wakes of the two rotors (Gavrilets, Mettler and Feron 2001, sec. 3.5, 3.6)."""

from __future__ import annotations

from swashplate.physics.backend import Backend, Scalar

ROUNDED = 0.05
"""m/s."""


def wake_on_tailplane(
    u: Scalar,
    w: Scalar,
    induced: Scalar,
    *,
    near: Scalar,
    far: Scalar,
    drop: Scalar,
    most: Scalar,
    xp: Backend,
) -> Scalar:
    """Downwash [m/s] of the main rotor at the tailplane: 0 to `most` (1.5) times its induced velocity.

    The wake's edges reach a tail at distances `near` (front edge) and `far` behind the hub's rim and `drop` below it
    when the wake is swept back by u / (induced - w); in between the share rises linearly.
    """
    down = xp.maximum(induced - w, 1e-3)
    swept = u / down
    share = most * xp.minimum(1.0, xp.maximum(0.0, (swept * drop - near) / (far - near)))
    return share * induced


def lifting_force(
    along: Scalar, across: Scalar, *, area: Scalar, lift_slope: Scalar, density: Scalar, xp: Backend
) -> Scalar:
    """Force [N] against the speed `across` a flat surface that moves `along` through the air, stalled as drag.

    -rho/2 S (C_La |along| + |across|) across, and never more than the dynamic pressure times the area. |along| is
    rounded off below `ROUNDED`, so that a hover, where it would have a kink, has derivatives.
    """
    ahead = xp.sqrt(along * along + ROUNDED * ROUNDED)
    linear = (lift_slope * ahead + xp.abs(across)) * across
    most = ahead * ahead + across * across
    return -0.5 * density * area * xp.maximum(-most, xp.minimum(most, linear))


def inclined_force(
    along: Scalar,
    across: Scalar,
    incidence: Scalar,
    *,
    area: Scalar,
    lift_slope: Scalar,
    density: Scalar,
    xp: Backend,
) -> tuple[Scalar, Scalar]:
    """Forces [N] along and across the body of a surface that is set at an incidence [rad]; see `lifting_force`.

    Positive incidence is what air from the side of positive `across` would give: a leading edge that is up for a
    horizontal tail (across is down), to the left for a fin (across is right).
    """
    ci, si = xp.cos(incidence), xp.sin(incidence)
    force = lifting_force(
        along * ci - across * si,
        across * ci + along * si,
        area=area,
        lift_slope=lift_slope,
        density=density,
        xp=xp,
    )
    return force * si, force * ci


def stabilator_incidence(
    along: Scalar,
    collective: Scalar,
    pitch_rate: Scalar,
    *,
    low: Scalar,
    high: Scalar,
    begin: Scalar,
    end: Scalar,
    by_collective: Scalar,
    neutral: Scalar,
    by_pitch_rate: Scalar,
    xp: Backend,
) -> Scalar:
    """Incidence [rad] of an all-moving tail by its schedule: speed, collective and pitch rate add up.

    The form of the UH-60A's (Howlett 1981, NASA CR-166309, sec. 5.6) without its lateral acceleration; its gains change
    with speed, these do not. It stays between the ends of its schedule with speed.

    Args:
        along: air speed ahead [m/s].
        collective: of the main rotor [rad]. pitch_rate: [rad/s].
        low, high: incidence at speeds up to `begin` and from `end` on [rad], [m/s].
        by_collective: per collective above `neutral` [rad]. by_pitch_rate: [s].
    """
    way = xp.minimum(1.0, xp.maximum(0.0, (along - begin) / (end - begin)))
    asked = low + (high - low) * way + by_collective * (collective - neutral) + by_pitch_rate * pitch_rate
    least, most = xp.minimum(low, high), xp.maximum(low, high)
    return xp.maximum(least, xp.minimum(most, asked))
