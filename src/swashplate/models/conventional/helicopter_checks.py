"""Numbers that no helicopter has, and those that a card of an earlier version lacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.models.conventional.helicopter_parameters import (
    ADDED,
    ANGLES,
    MEANING,
    NOT_NEGATIVE,
    POSITIVE,
    UNITS,
    USUAL,
)

LARGEST_ANGLE = 1.0
"""rad, of what is an angle of much less on every helicopter."""
Refuse = Callable[..., None]


def with_added(card: Card, options: HelicopterOptions) -> Card:
    """A card of an earlier version with the parameters that were added since, where they have no effect.

    Raises:
        CardError: where an option needs the number that the card lacks.
    """
    lacking = {name: entry for name, entry in ADDED.items() if name not in card.parameters}
    for name, (option, _) in lacking.items():
        if option is not None and name not in USUAL and getattr(options, option):
            raise CardError(
                f"is missing, and option '{option}' needs it ({MEANING[name]}).",
                where=card.path or card.vehicle,
                channel=name,
                hint=f'Add [parameters.{name}] with value, unit = "{UNITS[name]}", source and status.',
            )
    added = {name: _stand_in(name, *entry, card) for name, entry in lacking.items()}
    return replace(card, parameters={**card.parameters, **added}) if added else card


def _stand_in(name: str, option: str | None, value: float | str, card: Card) -> Parameter:
    source = "not on the card, which is older than this parameter; "
    if isinstance(value, str):
        known = card.parameters.get(value)
        return Parameter(known.value if known else math.nan, UNITS[name], f"{source}{value} stands for it", "assumed")
    if name in USUAL:
        return Parameter(value, UNITS[name], f"{source}{USUAL[name]}; without option {option} no effect", "assumed")
    usual = "this leaves it out" if not value else "this is what was there before"
    meant = usual if option is None else "without its option it has no effect"
    return Parameter(value, UNITS[name], source + meant, "assumed")


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
    check_inertia(value, refuse)
    check_blades(value, refuse, rotors=("rotor", "tail"))
    disc = math.pi * value["tail_radius"] ** 2
    if value["fin_blockage"] * value["fin_area"] >= disc:
        refuse(
            "fin_blockage", f"of a fin of {value['fin_area']:g} m^2 leaves nothing of the tail rotor's {disc:.3g} m^2."
        )
    for low, high in (("collective_low", "collective_high"), ("tail_low", "tail_high"), ("bar_inner", "bar_outer")):
        if not value[low] < value[high]:
            refuse(low, f"is {value[low]:g}, not below {high} = {value[high]:g}.")
    if not value["stabilator_from"] < value["stabilator_to"]:
        refuse(
            "stabilator_from", f"is {value['stabilator_from']:g}, not below stabilator_to = {value['stabilator_to']:g}."
        )
    for name in ANGLES:
        if abs(value[name]) > LARGEST_ANGLE:
            refuse(
                name,
                f"is {value[name]:g} rad, more than {math.degrees(LARGEST_ANGLE):.0f} deg.",
                "Angles in cards are in radians.",
            )


def check_inertia(value: Mapping[str, float], refuse: Refuse) -> None:
    """Refuse moments of inertia that no body has."""
    inertia = {axis: value[f"inertia_{axis}"] for axis in ("xx", "yy", "zz")}
    for axis, moment in inertia.items():
        others = sum(inertia.values()) - moment
        if moment > others:
            refuse(
                f"inertia_{axis}",
                f"is {moment:g}, more than the two others together ({others:g}).",
                "No body has such moments of inertia: check the units and which axis is which.",
            )
    # The principal moments in the plane of symmetry must be a body's too.
    apart = math.hypot(inertia["xx"] - inertia["zz"], 2.0 * value["inertia_xz"])
    if apart > inertia["yy"]:
        refuse(
            "inertia_xz",
            f"is {value['inertia_xz']:g}: with it the principal moments differ by {apart:g}, more than inertia_yy.",
            "No body has such moments of inertia: check the units and the sign convention.",
        )


def check_blades(value: Mapping[str, float], refuse: Refuse, *, rotors: Sequence[str]) -> None:
    """Refuse blades and hinges that no rotor has."""
    for rotor in rotors:
        chord, radius, blades = (value[f"{rotor}_{name}"] for name in ("chord", "radius", "blades"))
        if chord >= radius:
            refuse(f"{rotor}_chord", f"is {chord:g}, longer than its rotor's radius {radius:g}.", "Lengths are in m.")
        if blades != round(blades) or blades < 2.0:
            refuse(f"{rotor}_blades", f"is {blades:g}, expected a whole number of at least 2.")
    if not 0.0 <= value["hinge_offset"] < 0.5:
        refuse("hinge_offset", f"is {value['hinge_offset']:g}, expected 0 to 0.5 of the radius.")
    if not value["rotor_root_cutout"] + 0.2 < value["rotor_tip_loss"] <= 1.0 or value["rotor_root_cutout"] < 0.0:
        refuse(
            "rotor_tip_loss",
            f"is {value['rotor_tip_loss']:g} and rotor_root_cutout {value['rotor_root_cutout']:g}: blades lift between "
            "them, at least over a fifth of the radius.",
            "Usual are 0.97 and 0.15; 1 and 0 for the whole radius.",
        )
    if not 1.0 <= value["rotor_induced_factor"] <= 2.0:
        refuse("rotor_induced_factor", f"is {value['rotor_induced_factor']:g}, expected 1 to 2.")
