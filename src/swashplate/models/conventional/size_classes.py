"""Classes of single-rotor helicopters by size, and what is usual in each: for a first card from mass and radius."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from swashplate.errors import CardError
from swashplate.models.card import packaged_cards


class Usual(NamedTuple):
    """What is usual for one parameter: value, one sigma in the same unit, and where it comes from."""

    value: float
    sigma: float | None
    source: str


class SizeClass(NamedTuple):
    """A class of helicopters: what is in it, the packaged cards that are scaled for it, and its statistics."""

    name: str
    words: str
    mass_below: float
    radius_below: float
    members: tuple[str, ...]
    usual: Callable[[float, float], Mapping[str, Usual]]


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


CLASSES: Mapping[str, SizeClass] = {
    entry.name: entry
    for entry in (
        SizeClass("micro", "below the 600 class: 250 to 500 mm blades", 2.0, 0.52, ("raptor50", "xcell60"), _micro),
        SizeClass("600", "model helicopters with blades of about 600 mm", 6.5, 0.74, ("raptor50",), _small),
        SizeClass("90", "the largest model helicopters: engines of 15 cm^3", 30.0, 1.1, ("xcell60", "helion"), _small),
        SizeClass("rmax", "unmanned helicopters for work, as R-MAX and R-50", 300.0, 2.5, ("rmax", "r50"), _small),
        SizeClass("full-size", "with a pilot on board", math.inf, math.inf, ("lynx",), _full_size),
    )
}
"""From the smallest; what is not below a class' mass (radius) belongs to a larger one."""


def default_class(mass: float, radius: float) -> DefaultClass:
    """The class of a helicopter of this mass [kg] and rotor radius [m]; where they disagree, the mass decides."""
    by_mass = next(entry for entry in CLASSES.values() if mass < entry.mass_below)
    by_radius = next(entry for entry in CLASSES.values() if radius < entry.radius_below)
    why = f"class {by_mass.name} ({by_mass.words}), because of its mass of {mass:g} kg"
    if by_mass is by_radius:
        return DefaultClass(by_mass.name, f"{why} and rotor radius of {radius:g} m")
    return DefaultClass(
        by_mass.name, f"{why}; the rotor radius of {radius:g} m is usual in class {by_radius.name}: check both"
    )


def size_class(name: str) -> SizeClass:
    """A class by its name.

    Raises:
        CardError: where there is none of this name.
    """
    if name not in CLASSES:
        raise CardError(f"is no class of helicopters, expected one of {', '.join(CLASSES)}.", where=name)
    return CLASSES[name]
