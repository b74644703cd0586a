"""A first card for one's own helicopter: scaled from a known one, every number with what to measure."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter, packaged_cards
from swashplate.models.conventional.helicopter_parameters import ADDED, MEANING, UNITS, USUAL

_SCALE: Mapping[str, Callable[[float, float], float]] = {
    "m": lambda size, weight: size,
    "m^2": lambda size, weight: size**2,
    "m^3": lambda size, weight: size**3,
    "kg": lambda size, weight: weight,
    "kg m^2": lambda size, weight: weight * size**2,
    "N m/rad": lambda size, weight: weight * size,
    "W": lambda size, weight: weight**1.5 / size,
    "N/m": lambda size, weight: weight / size,
    "N s/m": lambda size, weight: weight / size**0.5,
}
"""How numbers of a unit grow with size and weight: geometry, and tip speed and lean angles alike."""

_TABLES = ("in_plane", "yaw_at_hub")
"""Options with which a packaged card repeats its published table; a new card flies without them."""
_WAKES = ("tailplane_wake", "fuselage_wake")
"""And numbers."""
_GUESS = 0.15
"""One sigma of what is only scaled, as a share of it."""


def new_card(title: str, *, mass: float, radius: float, rotation: str = "cw", like: str = "raptor50") -> Card:
    """A card of the size and weight given; all but these two are guesses, marked so and with wide sigmas.

    Args:
        title: what the aircraft is.
        mass: with fuel or battery [kg].
        radius: of the main rotor [m].
        rotation: "cw" or "ccw", seen from above.
        like: the packaged helicopter to scale.

    Raises:
        CardError: where mass or radius cannot be, or `like` is no single-rotor card.
    """
    pattern = packaged_cards().get(like)
    if pattern is None or pattern.vehicle != "conventional":
        raise CardError("is no packaged single-rotor helicopter.", where=like)
    if not (0.0 < mass < math.inf and 0.0 < radius < math.inf):
        raise CardError(f"mass {mass:g} kg and radius {radius:g} m, expected both finite and above 0.", where=title)
    known = pattern.values()
    size, weight = radius / known["rotor_radius"], mass / known["mass"]
    given = {"mass": mass, "rotor_radius": radius}
    usual = {name: float(ADDED[name][1]) for name in _WAKES}
    parameters = {}
    for name, parameter in pattern.parameters.items():
        scale = _SCALE.get(parameter.unit)
        factor = 1.0 if scale is None else scale(size, weight)
        if name == "rotor_speed":
            factor = 1.0 / size
        value = {**given, **usual}.get(name, float(f"{parameter.value * factor:.4g}"))
        parameters[name] = replace(
            parameter,
            value=value,
            source="given" if name in given else f"guess: {like} scaled to {radius:g} m and {mass:g} kg",
            status="measured" if name in given else "assumed",
            sigma=None
            if name in given or name.endswith("_blades") or not value
            else float(f"{_GUESS * abs(value):.3g}"),
            lower=None if parameter.lower is None else parameter.lower * min(factor, 1.0),
            upper=None if parameter.upper is None else parameter.upper * max(factor, 1.0),
            note="",
        )
    for name, source in USUAL.items():
        value = float(ADDED[name][1])
        parameters.setdefault(name, Parameter(value, UNITS[name], source, "assumed"))
    trust = "Nothing yet: every number marked assumed is a guess. Measure them, and write how into source and status."
    parts = {name: value for name, value in pattern.options.items() if name not in _TABLES}
    options = {**parts, "rotation": rotation, "yaw_at_blades": True, "precession_torque": True}
    return Card("conventional", title, trust, options, parameters)


def commented(card: Card) -> str:
    """The card's file with a comment on every number: what it is, and how to get it."""
    lines = []
    for line in card.to_toml().splitlines():
        if line.startswith("[parameters."):
            name = line.removeprefix("[parameters.").removesuffix("]")
            lines.append(f"# {MEANING[name]}")
        lines.append(line)
    return "\n".join(lines) + "\n"
