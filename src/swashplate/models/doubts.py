"""What of a vehicle's equations does not hold, at a state or along a flight, and the power that it takes."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment

_LOOKS = 200


def doubts(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> tuple[str, ...]:
    """What of the equations does not hold at a state, in words.

    Empty where they may be trusted, and of a model that says nothing of its limits (`Traits.doubts`).
    """
    said = vehicle.traits.doubts
    return () if said is None else tuple(said(vehicle, x, u, environment).values())


def doubts_along(vehicle: Vehicle, time: Array, x: Array, u: Array, wind: Array) -> tuple[str, ...]:
    """What of the equations does not hold somewhere along a flight, each with when that is first seen.

    Args:
        time: stamps [s], shape (n,); at most `_LOOKS` of them are looked at.
        x, u, wind: states (n, n_states), inputs (n, n_inputs) and wind (n, 3) by sample.
    """
    said = vehicle.traits.doubts
    if said is None:
        return ()
    usual, first = environment_of(vehicle), dict[str, str]()
    for k in np.unique(np.linspace(0, len(time) - 1, min(_LOOKS, len(time))).astype(int)):
        blowing = dict(zip(Environment._fields[:3], map(float, wind[k]), strict=True))
        for kind, words in said(vehicle, x[k], u[k], usual._replace(**blowing)).items():
            first.setdefault(kind, f"At {time[k]:.1f} s {words}")
    return tuple(first.values())


def shaft_power(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> float | None:
    """Power [W] that the rotors take from the engine at a state; None for a model without one."""
    power = vehicle.traits.power
    return None if power is None else power(vehicle, x, u, environment)
