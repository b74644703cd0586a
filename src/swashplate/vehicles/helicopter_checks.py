"""Numbers that no helicopter has."""

from __future__ import annotations

from swashplate.errors import CardError
from swashplate.vehicles.card import Card
from swashplate.vehicles.helicopter_parameters import NOT_NEGATIVE, POSITIVE


def check_numbers(card: Card) -> None:
    """Refuse a card whose numbers cannot be a helicopter's.

    Raises:
        CardError: naming the parameter, what it is and what physics asks for.
    """
    where, value = card.where, card.values()

    def refuse(name: str, problem: str, hint: str | None = None) -> None:
        raise CardError(problem, where=where, channel=name, hint=hint)

    for name in POSITIVE:
        if not value[name] > 0.0:
            refuse(name, f"is {value[name]:g}, expected more than 0.")
    for name in NOT_NEGATIVE:
        if value[name] < 0.0:
            refuse(name, f"is {value[name]:g}, expected 0 or more.")
    inertia = {axis: value[f"inertia_{axis}"] for axis in ("xx", "yy", "zz")}
    for axis, own in inertia.items():
        others = sum(inertia.values()) - own
        if own > others:
            refuse(
                f"inertia_{axis}",
                f"is {own:g}, more than the two others together ({others:g}).",
                "No body has such moments of inertia: check the units and which axis is which.",
            )
    if value["inertia_xz"] ** 2 >= inertia["xx"] * inertia["zz"]:
        refuse("inertia_xz", f"is {value['inertia_xz']:g}, too large for inertia_xx and inertia_zz.")
    if value["rotor_chord"] >= value["rotor_radius"] or value["tail_chord"] >= value["tail_radius"]:
        refuse("rotor_chord", "or tail_chord is longer than its rotor's radius.", "Check the units: metres.")
    if not 0.0 <= value["hinge_offset"] < 0.5:
        refuse("hinge_offset", f"is {value['hinge_offset']:g}, expected 0 to 0.5 of the radius.")
    for low, high in (("collective_low", "collective_high"), ("tail_low", "tail_high"), ("bar_inner", "bar_outer")):
        if not value[low] < value[high]:
            refuse(low, f"is {value[low]:g}, not below {high} = {value[high]:g}.")
    for name in ("rotor_twist", "shaft_tilt", "precone", "cyclic_limit", "collective_high", "tail_high"):
        if abs(value[name]) > 1.0:
            refuse(name, f"is {value[name]:g} rad, more than 57 deg.", "Angles in cards are in radians.")
