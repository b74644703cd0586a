"""The one place that says in what air and at what voltage a vehicle flies where nobody says it."""

from __future__ import annotations

from typing import Any, Protocol

from swashplate.models.card import Card
from swashplate.physics.atmosphere import SEA_LEVEL_DENSITY
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment

_NO_BATTERY = 12.22
"""V, carried along by vehicles whose equations have no battery; it changes nothing."""


class _Carded(Protocol):
    """A vehicle, as far as its surroundings go."""

    @property
    def card(self) -> Card: ...
    @property
    def parameter_names(self) -> tuple[str, ...]: ...


def environment_of(vehicle: _Carded, environment: Environment | None = None, *, parameters: Any = None) -> Environment:
    """The surroundings of a vehicle, complete: what `environment` leaves open is the vehicle's own.

    Args:
        vehicle: whose card may state `air_density` [kg/m^3], the air that its factors hold for, `gravity` [m/s^2] and
            `voltage_nominal` [V]. Without a density it flies at sea level of the standard atmosphere, 1.225 kg/m^3 (ISO
            2533:1975); without gravity at 9.81 m/s^2.
        environment: what is known; None: calm air.
        parameters: numbers in place of the card's, as the equations take them (traced ones too).
    """
    given = environment or Environment()
    if given.air_density is None:
        given = given._replace(air_density=_own(vehicle, "air_density", SEA_LEVEL_DENSITY, parameters))
    if given.gravity is None:
        given = given._replace(gravity=_own(vehicle, "gravity", LABORATORY_GRAVITY, parameters))
    if given.voltage is None:
        given = given._replace(voltage=_own(vehicle, "voltage_nominal", _NO_BATTERY, parameters))
    return given


def _own(vehicle: _Carded, name: str, usual: float, parameters: Any) -> Any:
    if name not in vehicle.parameter_names:
        return usual
    return vehicle.card.values()[name] if parameters is None else getattr(parameters, name)
