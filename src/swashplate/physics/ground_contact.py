"""Four skid ends on level ground: a spring and damper that only push, and friction."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
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


_CREEP = 0.05
"""m/s: below this sliding speed friction acts as a damper, so that it has a slope."""


def skid_loads(body: RigidBody, skids: Skids, xp: Backend) -> tuple[Vector, Vector]:
    """Force [N] and moment [N m] in body axes of ground at z = 0."""

    def end(ahead: float, right: float) -> tuple[Vector, Vector]:
        arm = Vector(ahead * skids.half_length, right * skids.half_width, skids.depth)
        sunk = body.z + body_to_local(arm, body.attitude, xp).z
        moving = body_to_local(body.velocity + body.rates.cross(arm), body.attitude, xp)
        pushing = xp.maximum(0.0, skids.stiffness * sunk + skids.damping * moving.z)
        pushing = xp.where(sunk > 0.0, pushing, 0.0)
        sliding = xp.sqrt(moving.x * moving.x + moving.y * moving.y + _CREEP * _CREEP)
        grip = -skids.friction * pushing / sliding
        force = local_to_body(Vector(grip * moving.x, grip * moving.y, -pushing), body.attitude, xp)
        return force, arm.cross(force)

    # Left and right first, so that a mirror image gives the same bits.
    (fr, mr), (fl, ml), (ar, nr), (al, nl) = end(1.0, 1.0), end(1.0, -1.0), end(-1.0, 1.0), end(-1.0, -1.0)
    return (fr + fl) + (ar + al), (mr + ml) + (nr + nl)
