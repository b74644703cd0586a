"""A first card for one's own helicopter: from a class of its size or a known one, every number with what to measure."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping
from dataclasses import replace

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter, packaged_cards
from swashplate.models.conventional.helicopter_parameters import ADDED, MEANING, UNITS, USUAL
from swashplate.models.conventional.size_classes import Usual, default_class
from swashplate.models.conventional.size_classes import size_class as class_of

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


def new_card(
    title: str,
    *,
    mass: float,
    radius: float,
    rotation: str = "cw",
    like: str | None = None,
    size_class: str | None = None,
) -> Card:
    """A card of the size and weight given; all but these two are guesses, marked so and with wide sigmas.

    What is not given is a statistic of the class or the mean of its packaged cards, scaled: each number's source says
    which, and its sigma is the spread, at least 15 % where it is scaled.

    Args:
        title: what the aircraft is.
        mass: with fuel or battery [kg].
        radius: of the main rotor [m].
        rotation: "cw" or "ccw", seen from above.
        like: a packaged helicopter to scale, in place of a class.
        size_class: "full-size", "rmax", "600", "90" or "micro"; by default what mass and radius ask for.

    Raises:
        CardError: where mass or radius cannot be, `like` is no single-rotor card, there is no such class, or both are
            given.
    """
    if not (0.0 < mass < math.inf and 0.0 < radius < math.inf):
        raise CardError(f"mass {mass:g} kg and radius {radius:g} m, expected both finite and above 0.", where=title)
    if like is not None and size_class is not None:
        raise CardError("takes a class or a packaged helicopter to scale, not both.", where=title)
    usual = {name: Usual(float(ADDED[name][1]), None, "the usual number") for name in _WAKES}
    if like is None:
        chosen = class_of(size_class or default_class(mass, radius).name)
        usual |= chosen.usual(mass, radius)
    members = (like,) if like is not None else chosen.members
    patterns = [_pattern(member) for member in members]
    source = f"guess: {' and '.join(members)} scaled to {radius:g} m and {mass:g} kg"
    parameters = {name: _scaled(name, patterns, mass, radius, source) for name in patterns[0].parameters}
    parameters |= {name: _stated(parameters[name], entry) for name, entry in usual.items()}
    for name, value in (("mass", mass), ("rotor_radius", radius)):
        parameters[name] = replace(parameters[name], value=value, source="given", status="measured", sigma=None)
    for name, source in USUAL.items():
        parameters.setdefault(name, Parameter(float(ADDED[name][1]), UNITS[name], source, "assumed"))
    for name, (option, stood) in ADDED.items():
        if isinstance(stood, float):
            words = f"none fitted; option {option} takes it" if option else "none fitted"
            parameters.setdefault(name, Parameter(stood, UNITS[name], words, "assumed"))
    trust = "Nothing yet: every number marked assumed is a guess. Measure them, and write how into source and status."
    parts = {name: value for name, value in patterns[0].options.items() if name not in _TABLES}
    options = {**parts, "rotation": rotation, "yaw_at_blades": True, "precession_torque": True}
    return Card("conventional", title, trust, options, parameters)


def _pattern(name: str) -> Card:
    pattern = packaged_cards().get(name)
    if pattern is None or pattern.vehicle != "conventional":
        raise CardError("is no packaged single-rotor helicopter.", where=name)
    return pattern


def _factor(name: str, pattern: Card, mass: float, radius: float) -> float:
    known = pattern.parameters
    size, weight = radius / known["rotor_radius"].value, mass / known["mass"].value
    if name == "rotor_speed":
        return 1.0 / size
    scale = _SCALE.get(known[name].unit)
    return 1.0 if scale is None else scale(size, weight)


def _scaled(name: str, patterns: list[Card], mass: float, radius: float, source: str) -> Parameter:
    """The mean of what the patterns give; one sigma is their spread, or the usual share where that is more."""
    entries = [pattern.parameters[name] for pattern in patterns]
    factors = [_factor(name, pattern, mass, radius) for pattern in patterns]
    values = [entry.value * factor for entry, factor in zip(entries, factors, strict=True)]
    counted = name.endswith("_blades")
    value = float(round(statistics.fmean(values)) if counted else f"{statistics.fmean(values):.4g}")
    sigma = max(_GUESS * abs(value), statistics.stdev(values) if len(values) > 1 else 0.0)
    lower = [e.lower * min(f, 1.0) for e, f in zip(entries, factors, strict=True) if e.lower is not None]
    upper = [e.upper * max(f, 1.0) for e, f in zip(entries, factors, strict=True) if e.upper is not None]
    return Parameter(
        value,
        entries[0].unit,
        source,
        "assumed",
        sigma=None if counted or not sigma else float(f"{sigma:.3g}"),
        lower=min(lower) if len(lower) == len(entries) else None,
        upper=max(upper) if len(upper) == len(entries) else None,
    )


def _stated(scaled: Parameter, usual: Usual) -> Parameter:
    """A parameter with the class' statistic; its bounds widen to ten times the value, as on packaged cards."""
    lower = None if scaled.lower is None else min(scaled.lower, usual.value / 10.0)
    upper = None if scaled.upper is None else max(scaled.upper, usual.value * 10.0)
    return replace(scaled, value=usual.value, sigma=usual.sigma, source=usual.source, lower=lower, upper=upper)


def commented(card: Card) -> str:
    """The card's file with a comment on every number: what it is, and how to get it."""
    lines = []
    for line in card.to_toml().splitlines():
        if line.startswith("[parameters."):
            name = line.removeprefix("[parameters.").removesuffix("]")
            lines.append(f"# {MEANING[name]}")
        lines.append(line)
    return "\n".join(lines) + "\n"
