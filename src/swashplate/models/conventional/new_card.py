"""A first card for one's own helicopter: from a class of its size or a known one, every number with what to measure."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter, packaged_cards
from swashplate.models.conventional.helicopter_parameters import ADDED, MEANING, UNITS, USUAL


class Usual(NamedTuple):
    """What is usual for one parameter: value, one sigma in the same unit, and where it comes from."""

    value: float
    sigma: float | None
    source: str


class SizeClass(NamedTuple):
    """A class of helicopters: what is in it, the packaged cards that are scaled for it, its statistics and switches."""

    name: str
    contents: str
    mass_below: float
    radius_below: float
    members: tuple[str, ...]
    usual: Callable[[float, float], Mapping[str, Usual]]
    options: Mapping[str, str | bool] = {}


class DefaultClass(NamedTuple):
    """The class that mass and radius ask for, and why, in words."""

    name: str
    why: str


_RAND = "statistics of 180 helicopters (Rand and Khromov 2004, Journal of the AHS 49, as others have copied it)"
_SPREAD = 0.15
"""One sigma of a regression or of a scaled number, as a share of it."""
_DRAG_AREA = {"OH-6A": (1157.0, 0.465), "UH-1B": (4309.0, 1.812), "CH-47": (14969.0, 4.013)}
"""Gross weight [kg] and equivalent flat plate area [m^2]: Prouty 1986, Table 4.3."""
_FOUR_TAIL_BLADES_FROM = 3000.0
"""[kg] The BO-105C (2.2 t) has two tail blades; Lynx (4.3 t), UH-60A and CH-53D have four. The UH-1 has two."""


def _share(value: float, source: str, share: float = _SPREAD) -> Usual:
    return Usual(float(f"{value:.4g}"), float(f"{share * abs(value):.3g}"), source)


def _hub_over_cg(radius: float) -> Usual:
    return Usual(0.0, float(f"{0.01 * radius:.3g}"), "the hub stands over the middle; sigma 1 % of the radius")


def drag_area(mass: float) -> Usual:
    """Drag area ahead of a full-size helicopter, f = k m^(2/3) with the mean and spread of three (Prouty 1986).

    Args:
        mass: gross weight [kg].

    Returns:
        In m^2.
    """
    logs = [math.log(area / weight ** (2.0 / 3.0)) for weight, area in _DRAG_AREA.values()]
    mean = sum(logs) / len(logs)
    spread = math.sqrt(sum((log - mean) ** 2 for log in logs) / (len(logs) - 1))
    named = ", ".join(_DRAG_AREA)
    return _share(math.exp(mean) * mass ** (2.0 / 3.0), f"k m^(2/3), k of {named} (Prouty 1986, Table 4.3)", spread)


def _full_size(mass: float, radius: float) -> Mapping[str, Usual]:
    diameter, blades = 2.0 * radius, 4
    tail_blades = 4 if mass >= _FOUR_TAIL_BLADES_FROM else 2
    speed = 140.0 * diameter**0.171 / radius
    tail_diameter = 0.0886 * mass**0.393
    tail_speed = 182.0 * tail_diameter**0.172 / (tail_diameter / 2.0)
    regressions = {
        "rotor_chord": 0.0108 * mass**0.539 / blades**0.714,
        "tail_radius": tail_diameter / 2.0,
        "tail_chord": 0.0058 * mass**0.506 / tail_blades**0.720,
        "tail_arm": 0.5107 * diameter**1.061,
        "tailplane_area": 0.0021 * mass**0.758,
        "tailplane_arm": 0.4247 * mass**0.327,
        "fin_arm": 0.5914 * diameter**0.995,
        "engine_power": 76.4 * mass**1.1455,
    }
    sign = f"{_RAND}; tip speed grows with the diameter, as Lynx and UH-60A say, where the copy has it shrink"
    count = "by weight, to be counted: BO-105C (2.2 t) two; Lynx (4.3 t), UH-60A and CH-53D four, but UH-1 two"
    return {
        **{name: _share(value, _RAND) for name, value in regressions.items()},
        "rotor_speed": _share(speed, sign),
        "tail_gear": _share(tail_speed / speed, sign),
        "rotor_blades": Usual(float(blades), None, "to be counted: four on BO-105C, Lynx and UH-60A"),
        "tail_blades": Usual(float(tail_blades), None, count),
        "fuselage_area_x": drag_area(mass),
        "hub_y": _hub_over_cg(radius),
        "hinge_offset": Usual(0.04, 0.02, "articulated, as UH-60A's 0.047 (Hilbert 1984); 0 and hub_stiffness if not"),
        "hub_stiffness": Usual(0.0, None, "none: hinge_offset holds the hub's stiffness"),
        "collective_high": Usual(math.radians(25.0), math.radians(3.0), "at the root; UH-60A hovers at 22 deg there"),
    }


def _small(mass: float, radius: float) -> Mapping[str, Usual]:
    return {"hub_y": _hub_over_cg(radius)}


def _micro(mass: float, radius: float) -> Mapping[str, Usual]:
    """Tip speed between Mach scaling (the same) and Froude scaling (root of size), drag by the Reynolds number."""
    known = packaged_cards()["raptor50"].values()
    ratio = radius / known["rotor_radius"]
    tip = known["rotor_speed"] * known["rotor_radius"] * ratio**0.25
    thicker = (ratio * ratio**0.25) ** -0.2
    between = "between Froude and Mach scaling of the Raptor 50 (Mettler 2003)"
    skin = "the Raptor 50's, growing with the Reynolds number to -0.2 (skin friction)"
    return {
        **_small(mass, radius),
        "rotor_speed": _share(tip / radius, between),
        "rotor_drag": _share(known["rotor_drag"] * thicker, skin, 0.3),
        "tail_drag": _share(known["tail_drag"] * thicker, skin, 0.3),
    }


_OF_TABLES = {"cross_flow": True}
"""Fuselages of full size are known by slopes in air from ahead, small ones by areas of the cross flow."""

CLASSES: Mapping[str, SizeClass] = {
    entry.name: entry
    for entry in (
        SizeClass("micro", "below the 600 class: 250 to 500 mm blades", 2.0, 0.52, ("raptor50", "xcell60"), _micro),
        SizeClass("600", "model helicopters with blades of about 600 mm", 6.5, 0.74, ("raptor50",), _small),
        SizeClass("90", "the largest model helicopters: engines of 15 cm^3", 30.0, 1.1, ("xcell60", "helion"), _small),
        SizeClass("rmax", "unmanned helicopters for work, as R-MAX and R-50", 300.0, 2.5, ("rmax", "r50"), _small),
        SizeClass("full-size", "with a pilot on board", math.inf, math.inf, ("lynx",), _full_size, _OF_TABLES),
    )
}
"""From the smallest; what is not below a class' mass (radius) belongs to a larger one."""


def default_class(mass: float, radius: float) -> DefaultClass:
    """The class of a helicopter of this mass [kg] and rotor radius [m]; where they disagree, the mass decides."""
    by_mass = next(entry for entry in CLASSES.values() if mass < entry.mass_below)
    by_radius = next(entry for entry in CLASSES.values() if radius < entry.radius_below)
    why = f"class {by_mass.name} ({by_mass.contents}), because of its mass of {mass:g} kg"
    if by_mass is by_radius:
        return DefaultClass(by_mass.name, f"{why} and rotor radius of {radius:g} m")
    return DefaultClass(
        by_mass.name, f"{why}; the rotor radius of {radius:g} m is usual in class {by_radius.name}: check both"
    )


def known_class(name: str) -> SizeClass:
    """A class by its name.

    Raises:
        CardError: where there is none of this name.
    """
    if name not in CLASSES:
        raise CardError(f"is no class of helicopters, expected one of {', '.join(CLASSES)}.", where=name)
    return CLASSES[name]


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
    switched: Mapping[str, str | bool] = {}
    if like is None:
        chosen = known_class(size_class or default_class(mass, radius).name)
        usual |= chosen.usual(mass, radius)
        switched = chosen.options
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
            fitted = f"none fitted; option {option} takes it" if option else "none fitted"
            parameters.setdefault(name, Parameter(stood, UNITS[name], fitted, "assumed"))
    trust = "Nothing yet: every number marked assumed is a guess. Measure them, and write how into source and status."
    parts = {name: value for name, value in patterns[0].options.items() if name not in _TABLES}
    options = {**parts, **switched, "rotation": rotation, "yaw_at_blades": True, "precession_torque": True}
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
