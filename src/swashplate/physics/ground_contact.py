"""Four skid ends on level ground: a spring and damper that only push, and friction, with or without sticking."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.frames import Vector, body_to_local, local_to_body
from swashplate.physics.rigid_body import RigidBody


class Skids(NamedTuple):
    """Half length, half width and depth below the CG [m]; stiffness [N/m], damping [N s/m] and friction of one end."""

    half_length: Scalar
    half_width: Scalar
    depth: Scalar
    stiffness: Scalar
    damping: Scalar
    friction: Scalar

    @staticmethod
    def of(par: Named) -> Skids:
        """Those of a card's parameters."""
        names = ("length", "width", "depth", "stiffness", "damping", "friction")
        return Skids(*(getattr(par, f"skid_{name}") for name in names))


class Grip(NamedTuple):
    """How far each skid end is bent north and east of where it stands [m]: fore and aft, right and left."""

    grip_fr_x: Scalar
    grip_fr_y: Scalar
    grip_fl_x: Scalar
    grip_fl_y: Scalar
    grip_ar_x: Scalar
    grip_ar_y: Scalar
    grip_al_x: Scalar
    grip_al_y: Scalar


_CREEP = 0.05
"""m/s: below this sliding speed friction without sticking acts as a damper, so that it has a slope."""
_RELEASE = 0.02
"""s: within this an end that leaves the ground, or slides fast, forgets where it stood; slow enough for 100 Hz."""
_TINY = 1e-9


def skid_loads(
    body: RigidBody, skids: Skids, xp: Backend, grip: Grip | None = None
) -> tuple[Vector, Vector, Grip | None]:
    """Force [N] and moment [N m] in body axes of ground at z = 0, and the rates of the grip [m/s].

    With a grip each end is held by a bristle with the skid's stiffness and damping until friction gives way (Dahl 1968;
    Canudas de Wit et al. 1995, without their Stribeck effect): what is parked stays where it is. Without one, friction
    below 5 cm/s is a damper, and what is pushed creeps.
    """

    def end(
        ahead: float, right: float, bent: tuple[Scalar, Scalar] | None
    ) -> tuple[Vector, Vector, tuple[Scalar, ...]]:
        arm = Vector(ahead * skids.half_length, right * skids.half_width, skids.depth)
        sunk = body.z + body_to_local(arm, body.attitude, xp).z
        moving = body_to_local(body.velocity + body.rates.cross(arm), body.attitude, xp)
        pushing = xp.maximum(0.0, skids.stiffness * sunk + skids.damping * moving.z)
        pushing = xp.where(sunk > 0.0, pushing, 0.0)
        most = skids.friction * pushing
        if bent is None:
            back = -most / xp.sqrt(moving.x * moving.x + moving.y * moving.y + _CREEP * _CREEP)
            held = (back * moving.x, back * moving.y)
            bending: tuple[Scalar, ...] = ()
        else:
            held, bending = _held(bent, (moving.x, moving.y), most, skids, xp)
        force = local_to_body(Vector(*held, -pushing), body.attitude, xp)
        return force, arm.cross(force), bending

    bent = (None,) * 4 if grip is None else (grip[:2], grip[2:4], grip[4:6], grip[6:])
    # Left and right first, so that a mirror image gives the same bits.
    (fr, mr, a), (fl, ml, b) = end(1.0, 1.0, bent[0]), end(1.0, -1.0, bent[1])
    (ar, nr, c), (al, nl, d) = end(-1.0, 1.0, bent[2]), end(-1.0, -1.0, bent[3])
    rates = None if grip is None else Grip(*a, *b, *c, *d)
    return (fr + fl) + (ar + al), (mr + ml) + (nr + nl), rates


def _held(
    bent: tuple[Scalar, ...], moving: tuple[Scalar, Scalar], most: Scalar, skids: Skids, xp: Backend
) -> tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]:
    """The pull of one bristle, at most what friction holds [N], and how it bends [m/s]: z' = v - |v| k z / most."""
    k, c = skids.stiffness, skids.damping
    x, y = (k * z + c * v for z, v in zip(bent, moving, strict=True))
    share = xp.minimum(1.0, most / xp.sqrt(x * x + y * y + _TINY))
    speed = xp.sqrt(moving[0] * moving[0] + moving[1] * moving[1] + _TINY * _TINY)  # a slope at rest too
    touching = most > 0.0
    sliding = xp.minimum(1.0 / _RELEASE, speed * k / xp.maximum(most, _TINY))
    forgetting = xp.where(touching, sliding, 1.0 / _RELEASE)
    along = (xp.where(touching, v, 0.0) for v in moving)
    rates = tuple(v - forgetting * z for v, z in zip(along, bent, strict=True))
    return (-share * x, -share * y), (rates[0], rates[1])
