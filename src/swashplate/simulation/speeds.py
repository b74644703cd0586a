"""One vehicle over a range of speeds: trims that start from their neighbours, and what holds there."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from swashplate.errors import TrimError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.trim import Trim, trim


def trims_over_speed(
    vehicle: Vehicle,
    speeds: Sequence[float],
    *,
    climb: float = 0.0,
    turn: float = 0.0,
    lateral: float = 0.0,
    environment: Environment | None = None,
) -> tuple[Trim, ...]:
    """Trims at ascending speeds [m/s], each from the one before.

    Raises:
        TrimError: at the first speed that cannot be flown, with the limit that stops it.
    """
    trims: list[Trim] = []
    for speed in speeds:
        at = partial(
            trim, vehicle, speed=float(speed), lateral=lateral, climb=climb, turn=turn, environment=environment
        )
        try:
            trims.append(at(near=trims[-1] if trims else None))
        except TrimError:
            # A neighbour may lead astray where the trim curve bends; what fails afresh too, fails.
            trims.append(at())
    return tuple(trims)
