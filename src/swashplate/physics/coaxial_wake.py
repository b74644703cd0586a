"""Two rotors of one radius, one above the other: what each one's induced flow does at the other's disc.

Every rotor has an induced velocity of its own, v, which moves its thrust's momentum; the flow through its disc is v and
a share of the other's (Glauert's momentum theory for each, the other's flow taken as given). Velocities count down
through the discs. The shares are means over a disc, because that is what a blade-element thrust feels.
"""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar

FORMS = ("vortex-tube", "contracted-wake", "coplanar", "none")
_TINY = 1e-12


class WakeShares(NamedTuple):
    """Mean flow at the lower disc over the upper rotor's induced velocity, and the other way round."""

    on_lower: Scalar
    on_upper: Scalar


class Induced(NamedTuple):
    """Induced velocities that the rotors' own thrusts make [m/s], down through the discs positive."""

    induced_upper: Scalar
    induced_lower: Scalar


def upstream_share(separation: Scalar, radius: Scalar) -> Scalar:
    """Mean velocity ahead of a semi-infinite vortex tube over that in its mouth, 1 / (1 + 2.35 s + s^2), s = z / R.

    Fits the tube's exact mean (elliptic integrals) to 0.025 for every separation, 0.01 from a fifth of the radius on,
    and with it Prandtl's biplane factor (1924, NACA TN 182), which is the same share for a wake that goes straight
    aft. By symmetry the mean in the tube, as far behind its mouth, is 2 less this.
    """
    s = separation / radius
    return 1.0 / (1.0 + 2.35 * s + s * s)


def wake_shares(
    axial: Scalar, across2: Scalar, induced: Induced, *, separation: Scalar, radius: Scalar, form: str, xp: Backend
) -> WakeShares:
    """How much of each rotor's induced velocity the other one feels, as a mean over its disc.

    * "vortex-tube": the lower rotor in the upper's wake, accelerated and contracted as far as it is at the separation,
      and the upper one in the flow that the lower draws (cylinder of McCormick 1967, sec. 4-3; means over the disc).
    * "contracted-wake": the lower rotor in the fully contracted wake, the upper one undisturbed (the momentum limit of
      Leishman and Ananthan 2006).
    * "coplanar": both in one plane, each in the other's whole flow (Coleman 1997, NASA TP-3675, and cited there).
    * "none": two rotors far apart.

    A wake that is contracted to the area a and accelerated to s v gives the mean a s v; by continuity that is v in
    hover and more in climb, where wakes contract less. A wake blown aside by forward flight covers less of the other
    disc: what it gives beyond the upstream share fades with cos^1.5 of the wake's skew (within 0.07 of a skewed
    vortex tube's). In a descent whose air goes up through the discs the rotors change places; between, from half to
    one and a half times the induced flow of both, shares go over smoothly and are no model of the vortex ring.

    Args:
        axial: speed of the air down through the discs without any induced flow: of climb [m/s].
        across2: square of its speed along the discs [m^2/s^2].
        own: both rotors' induced velocities.
        separation, radius: of the rotors [m].
        form: one of `FORMS`.
        xp: the operations.
    """
    if form in ("none", "coplanar"):
        share = float(form == "coplanar")
        return WakeShares(share, share)
    ahead = upstream_share(separation, radius) if form == "vortex-tube" else 0.0
    gain = 2.0 - ahead
    both = induced.induced_upper + induced.induced_lower
    through, size = axial + both, xp.abs(both) + _TINY
    skew = xp.abs(through) / xp.sqrt(through * through + across2 + _TINY) + _TINY
    covered = skew * xp.sqrt(skew)
    v = xp.maximum(induced.induced_upper, _TINY)
    climb = xp.maximum(axial, -0.5 * v)
    at_disc, behind = climb + v, climb + gain * v
    area = xp.sqrt((across2 + at_disc * at_disc) / (across2 + behind * behind))
    below = ahead + (gain * area - ahead) * covered
    above = ahead + (gain - ahead) * covered
    down = xp.minimum(1.0, xp.maximum(0.0, through / size + 0.5))
    down = down * down * (3.0 - 2.0 * down)
    return WakeShares(down * below + (1.0 - down) * ahead, down * ahead + (1.0 - down) * above)
