"""What of a vehicle's equations does not hold, at a state or along a flight, and the power that it takes."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment

_LOOKS = 200
_NOMINAL = "voltage_nominal"
_NEAR_NOMINAL = 0.25
"""Share of the nominal voltage, to either side, within which a card's drive train is believed; assumed."""


def doubts(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> tuple[str, ...]:
    """What of the equations does not hold at a state, in words.

    Empty where they may be trusted. Of the battery every vehicle that has one is asked, of the rest those that know
    their limits (`Traits.doubts`).
    """
    return tuple(_by_kind(vehicle, x, u, environment).values())


def _by_kind(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> dict[str, str]:
    said = vehicle.traits.doubts
    found = {} if said is None else dict(said(vehicle, x, u, environment))
    nominal = nominal_voltage(vehicle)
    if nominal is not None and abs(environment.voltage / nominal - 1.0) > _NEAR_NOMINAL:
        found["battery"] = (
            f"the battery gives {environment.voltage:.3g} V: the card's drive train holds about {nominal:.4g} V, and "
            "is a guess so far away"
        )
    return found


def nominal_voltage(vehicle: Vehicle) -> float | None:
    """Voltage [V] about which the card's drive train holds; None for a vehicle that flies on no battery."""
    return float(vehicle.card.values()[_NOMINAL]) if _NOMINAL in vehicle.parameter_names else None


def doubts_along(vehicle: Vehicle, time: Array, x: Array, u: Array, wind: Array, voltage: Array) -> tuple[str, ...]:
    """What of the equations does not hold somewhere along a flight, each with when that is first seen.

    Args:
        time: stamps [s], shape (n,); at most `_LOOKS` of them are looked at.
        x, u, wind: states (n, n_states), inputs (n, n_inputs) and wind (n, 3) by sample.
        voltage: of the battery by sample [V], shape (n,).
    """
    usual, first = environment_of(vehicle), dict[str, str]()
    for k in np.unique(np.linspace(0, len(time) - 1, min(_LOOKS, len(time))).astype(int)):
        blowing = dict(zip(Environment._fields[:3], map(float, wind[k]), strict=True))
        around = usual._replace(**blowing, voltage=float(voltage[k]))
        for kind, words in _by_kind(vehicle, x[k], u[k], around).items():
            first.setdefault(kind, f"At {time[k]:.1f} s {words}")
    return tuple(first.values())


def shaft_power(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> float | None:
    """Power [W] that the rotors take from the engine at a state; None for a model without one."""
    power = vehicle.traits.power
    return None if power is None else power(vehicle, x, u, environment)
