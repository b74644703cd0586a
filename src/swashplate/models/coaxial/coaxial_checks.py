"""Numbers that no coaxial helicopter has."""

from __future__ import annotations

import math

from swashplate.errors import CardError
from swashplate.models.card import Card
from swashplate.models.coaxial.coaxial_parameters import ANGLES, NOT_NEGATIVE, POSITIVE, UNITS
from swashplate.models.conventional.helicopter_checks import LARGEST_ANGLE, check_blades, check_inertia


def checked_numbers(card: Card) -> Card:
    """The card itself, if its numbers can be a coaxial helicopter's.

    Raises:
        CardError: naming the parameter, what it is and what is expected.
    """
    card = card.checked_against(UNITS)
    value = card.values()

    def refuse(name: str, problem: str, hint: str | None = None) -> None:
        raise CardError(problem, where=card.where, channel=name, hint=hint)

    for name in POSITIVE:
        if not value[name] > 0.0:
            refuse(name, f"is {value[name]:g}, expected more than 0.")
    for name in NOT_NEGATIVE:
        if value[name] < 0.0:
            refuse(name, f"is {value[name]:g}, expected 0 or more.")
    check_inertia(value, refuse)
    check_blades(value, refuse, rotors=("rotor",))
    if not value["collective_low"] < value["collective_high"]:
        refuse(
            "collective_low", f"is {value['collective_low']:g}, not below collective_high {value['collective_high']:g}."
        )
    for name in ANGLES:
        if abs(value[name]) > LARGEST_ANGLE:
            hint = "Angles in cards are in radians."
            refuse(name, f"is {value[name]:g} rad, more than {math.degrees(LARGEST_ANGLE):.0f} deg.", hint)
    if abs(value["cyclic_phase"]) > math.pi:  # stiff blades need up to a quarter of a turn
        refuse("cyclic_phase", f"is {value['cyclic_phase']:g} rad, more than half a turn.", "Angles are in radians.")
    if value["hub_height_upper"] <= value["hub_height_lower"]:
        refuse(
            "hub_height_upper",
            f"is {value['hub_height_upper']:g} m, not above hub_height_lower {value['hub_height_lower']:g} m.",
            "Wakes go down: the upper rotor is the one above.",
        )
    return card
