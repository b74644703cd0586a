"""How late commands are taken to be, and who says so, in words."""

from __future__ import annotations

from collections.abc import Mapping

from swashplate.models.surroundings import complete_delays, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller


def lateness(vehicle: Vehicle, controller: Controller | None, *, given: Mapping[str, float] | float | None) -> str:
    """How late commands are taken to be, and who says so.

    Args:
        vehicle: what flies, or what is designed on.
        controller: what flies it, which may believe in delays that the vehicle's card does not know.
        given: delays that somebody asked for [s], one for all or by input.
    """
    inside = vehicle.traits.delayed_by
    in_equations = (
        f"commands {1e3 * vehicle.card.values()[inside]:.3g} ms ({inside}, in the model's equations)" if inside else ""
    )
    further = _further(vehicle, controller, given=given, inside=in_equations)
    return f"{in_equations}; further: {further}" if in_equations and further else in_equations or further


def _further(
    vehicle: Vehicle, controller: Controller | None, *, given: Mapping[str, float] | float | None, inside: str
) -> str:
    """What is late beside what the equations delay."""
    known, believed = input_delays(vehicle), {} if controller is None else dict(controller.delays)
    if given is not None:
        delays, whose = complete_delays(vehicle, given), "as given"
        if any(known.get(name, 0.0) > value + 1e-4 for name, value in delays.items()):
            whose += f"; Careful: identified were {_listed(known)}"
    elif controller is not None and controller.at_once:
        left = f"; the identified {_listed(known)} are left out" if any(known.values()) else ""
        return f"nothing: the hold acts at once{left}"
    elif known:
        delays, whose = known, "identified"
    elif any(believed.values()):
        delays, whose = believed, "as the controller was designed for: the model knows none"
    elif inside:
        return ""
    else:
        return "nothing: no delay of this model is known, --delay says one"
    return f"{_listed(delays) or 'nothing'} ({whose})"


def _listed(delays: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {1e3 * value:.3g} ms" for name, value in delays.items() if value)
