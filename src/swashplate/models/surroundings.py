"""In what air and at what voltage a vehicle flies where nobody says it, and how late its commands act."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from swashplate.errors import CardError, ControllerError
from swashplate.models.card import Card
from swashplate.physics.backend import Named
from swashplate.physics.environment import LABORATORY_GRAVITY, SEA_LEVEL_DENSITY, Environment

if TYPE_CHECKING:
    from swashplate.models.vehicle import Vehicle

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
        given = given._replace(air_density=_parameter_or(vehicle, "air_density", SEA_LEVEL_DENSITY, parameters))
    if given.gravity is None:
        given = given._replace(gravity=_parameter_or(vehicle, "gravity", LABORATORY_GRAVITY, parameters))
    if given.voltage is None:
        given = given._replace(voltage=_parameter_or(vehicle, "voltage_nominal", _NO_BATTERY, parameters))
    return given


def _parameter_or(vehicle: _Carded, name: str, usual: float, parameters: Named) -> Any:
    if name not in vehicle.parameter_names:
        return usual
    return vehicle.card.values()[name] if parameters is None else getattr(parameters, name)


SECTION = "input_delays"
"""Section of the card's `observer` with a delay for each input by name [s]."""
BY_OUTPUT = "input_delays_by_output"
"""The same by "output/input" where an input reaches outputs after different times [s]."""
BY_ENTRY = "input_delays_by_entry"
"""Of a linear model, delays of single entries of G by "state_dot/input" [s]: only its structure holds them."""
_LONGEST = 1.0


def input_delays(vehicle: Vehicle) -> dict[str, float]:
    """Identified delays from command to action by input [s]; empty where the card holds none, so that nothing is known.

    A fit of the nonlinear equations remembers two (`delay_motor` for motors, `delay_servo` for all else) in the section
    `nuisance`: by how much the motion lagged the logged commands. Radio, servo pulses, servo lags and a late log are
    all in them; the equations have none of it. A linear model's card has one for each input.

    Raises:
        CardError: where an input reaches outputs, or acts in equations, after different times.
    """
    if apart := vehicle.card.observer.get(BY_ENTRY):
        listed = ", ".join(f"{n} {d:g} s" for n, d in apart.items())
        raise CardError(
            f"has delays of single entries of G ({listed}): expected one delay of each input.",
            where=vehicle.card.where,
            hint="Give the file one delay per input; fits to responses and verification hold those of entries.",
        )
    if apart := vehicle.card.observer.get(BY_OUTPUT):
        by_input: dict[str, set[float]] = {}
        for name, delay in apart.items():
            by_input.setdefault(name.partition("/")[2], set()).add(delay)
        torn = {i for i, each in by_input.items() if len(each) > 1}
        listed = ", ".join(f"{n} {d:g} s" for n, d in apart.items() if n.partition("/")[2] in torn)
        raise CardError(
            f"has delays that differ between outputs ({listed}): expected one delay of each input.",
            where=vehicle.card.where,
            hint="Give the file one delay per input.",
        )
    known = vehicle.card.observer.get(SECTION)
    if known is None:
        held = vehicle.card.observer.get("nuisance", {})
        names = {i: "delay_motor" if i in vehicle.traits.motors else "delay_servo" for i in vehicle.input_names}
        known = {i: held.get(name, 0.0) for i, name in names.items()} if held.keys() & set(names.values()) else {}
    return {name: max(0.0, float(value)) for name, value in known.items()}


def known_delays(vehicle: Vehicle) -> dict[str, float]:
    """The same [s], by "output/input" where an input reaches outputs after different times; empty: none is known."""
    apart = vehicle.card.observer.get(BY_OUTPUT)
    return {name: max(0.0, float(value)) for name, value in apart.items()} if apart else input_delays(vehicle)


def complete_delays(vehicle: Vehicle, delays: Mapping[str, float] | float) -> dict[str, float]:
    """A delay for every input [s], of one number for all or of some by name; inputs that are not named act at once.

    Raises:
        ControllerError: for a name that is no input, or a delay outside 0 to 1 s.
    """
    if not isinstance(delays, Mapping):
        delays = dict.fromkeys(vehicle.input_names, float(delays))
    unknown = sorted(set(delays) - set(vehicle.input_names))
    if unknown:
        raise ControllerError(
            f"{', '.join(unknown)}: expected {', '.join(vehicle.input_names)}.", channel="delays", where=vehicle.name
        )
    complete = {name: float(delays.get(name, 0.0)) for name in vehicle.input_names}
    if not all(0.0 <= d <= _LONGEST for d in complete.values()):
        raise ControllerError(
            f"are {list(complete.values())} s, expected 0 to {_LONGEST:g}.", channel="delays", where=vehicle.name
        )
    return complete
