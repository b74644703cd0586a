"""How late a vehicle's commands act, as an identification found it: one number for every input."""

from __future__ import annotations

from collections.abc import Mapping

from swashplate.errors import CardError, ControllerError
from swashplate.models.vehicle import Vehicle

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
        told = vehicle.card.observer.get("nuisance", {})
        names = {i: "delay_motor" if i in vehicle.traits.motors else "delay_servo" for i in vehicle.input_names}
        known = {i: told.get(name, 0.0) for i, name in names.items()} if told.keys() & set(names.values()) else {}
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
