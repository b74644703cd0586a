"""Steady descents in which the rotors need no power of the engine."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from scipy.optimize import brentq

from swashplate.errors import TrimError
from swashplate.models.doubts import shaft_power
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.trim import Trim, trim

_FASTEST = 4.0
"""Sink over the hover's induced velocity beyond which no rotor autorotates."""
_STEP = 0.25
_CLOSE = 1e-6
"""m/s of sink to which the descent is found."""


def autorotations(
    vehicle: Vehicle, speeds: Sequence[float], *, lateral: float = 0.0, environment: Environment | None = None
) -> tuple[Trim, ...]:
    """The slowest steady descent at each speed ahead in which the shaft power is zero, at the governed rotor speed.

    Sink is raised in steps until the air drives the rotors, and the zero is found between. The power is that of main
    and tail rotor; what gears and a free-wheeling engine take is not in it.

    Args:
        vehicle: of which the shaft power is known.
        speeds: ahead [m/s].
        lateral: to the right [m/s].
        environment: wind, air and voltage.

    Raises:
        TrimError: for a vehicle without shaft power, or a speed at which no descent is found.
    """
    if vehicle.traits.power is None or "rotor_radius" not in vehicle.parameter_names:
        raise TrimError(
            "has no shaft power, and so no autorotation.",
            where=vehicle.card.where,
            hint="Helicopters and rotors with inflow have one.",
        )
    descents = []
    for speed in map(float, speeds):
        flown = partial(_sinking, vehicle, speed, lateral, environment)
        descents.append(_at(vehicle, flown, speed))
    return tuple(descents)


def _sinking(
    vehicle: Vehicle, speed: float, lateral: float, environment: Environment | None, climb: float, near: Trim | None
) -> Trim:
    return trim(vehicle, speed=speed, lateral=lateral, climb=climb, environment=environment, near=near)


def _at(vehicle: Vehicle, flown: Callable[[float, Trim | None], Trim], speed: float) -> Trim:
    reached: list[Trim] = []

    def power(climb: float) -> float:
        reached.append(flown(climb, reached[-1] if reached else None))
        at = reached[-1]
        return float(shaft_power(vehicle, at.state, at.inputs, at.environment) or 0.0)

    level = power(0.0)
    around = reached[-1].environment
    if level <= 0.0:
        return reached[-1]
    card = vehicle.card.values()
    disc = math.pi * card["rotor_radius"] ** 2
    hover = math.sqrt(card["mass"] * around.gravity / (2.0 * around.air_density * disc))
    step, slow = _STEP * hover, 0.0
    while slow < _FASTEST * hover:
        try:
            if power(-slow - step) <= 0.0:
                break
        except TrimError as fault:
            raise TrimError(
                f"no autorotation at {speed:g} m/s: {fault}", where=vehicle.card.where, hint="Ask for another speed."
            ) from fault
        slow += step
    else:
        raise TrimError(
            f"no autorotation at {speed:g} m/s: at {slow:.1f} m/s of sink the rotors still need power.",
            where=vehicle.card.where,
            hint="Profile drag may be too large, or the speed too far from that of least power.",
        )
    sink = brentq(lambda rate: power(-rate), slow, slow + step, xtol=_CLOSE)
    return flown(-float(sink), reached[-1])
