"""The parameters of a coaxial helicopter with collective pitch: name, unit, what to measure, and what none has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from swashplate.errors import CardError
from swashplate.models.card import Card
from swashplate.models.conventional.helicopter_checks import LARGEST_ANGLE, check_blades, check_inertia
from swashplate.models.conventional.helicopter_parameters import ANGLES as SINGLE_ANGLES
from swashplate.models.conventional.helicopter_parameters import MEANING as SINGLE_MEANING
from swashplate.models.conventional.helicopter_parameters import NOT_NEGATIVE as SINGLE_NOT_NEGATIVE
from swashplate.models.conventional.helicopter_parameters import POSITIVE as SINGLE_POSITIVE
from swashplate.models.conventional.helicopter_parameters import UNITS as SINGLE_UNITS
from swashplate.physics.backend import Named

_OWN: Mapping[str, tuple[str, str]] = {
    "hub_height_upper": ("m", "upper hub above the CG"),
    "hub_height_lower": ("m", "lower hub above the CG"),
    "differential_limit": ("rad", "largest differential collective either way, half of the rotors' difference"),
    "air_density": ("kg/m^3", "of the air that it is made for; it flies there where nobody says otherwise"),
    "gravity": ("m/s^2", "where it is made for: 9.81, or 3.71 on Mars"),
}
_ROTOR = (
    "rotor_radius",
    "rotor_chord",
    "rotor_blades",
    "rotor_lift_slope",
    "rotor_drag",
    "rotor_drag_thrust",
    "rotor_twist",
    "rotor_speed",
    "blade_inertia",
    "hub_stiffness",
    "hinge_offset",
    "precone",
    "hub_x",
    "hub_y",
    "wake_distortion",
    "wake_distortion_fade",
    "phase_lag",
    "cyclic_phase",
    "rotor_tip_loss",
    "rotor_root_cutout",
    "rotor_induced_factor",
)
"""Of the blades and hubs: the same for both rotors."""
_TAKEN = (
    "mass",
    "inertia_xx",
    "inertia_yy",
    "inertia_zz",
    "inertia_xz",
    *_ROTOR,
    "fuselage_area_x",
    "fuselage_area_y",
    "fuselage_area_z",
    "fuselage_wake",
    "engine_power",
    "rotor_inertia",
    "engine_time",
    "governor_gain",
    "governor_integral",
    "servo_time",
    "servo_delay",
    "servo_speed",
    "collective_low",
    "collective_high",
    "cyclic_limit",
    "skid_length",
    "skid_width",
    "skid_depth",
    "skid_stiffness",
    "skid_damping",
    "skid_friction",
)
"""What a single rotor has too, with the same name and meaning."""

UNITS: Mapping[str, str] = {
    **{name: SINGLE_UNITS[name] for name in _TAKEN},
    **{name: unit for name, (unit, _) in _OWN.items()},
}
"""Every parameter and its unit, in the order of the equations' tuple."""
MEANING: Mapping[str, str] = {
    **{name: SINGLE_MEANING[name] for name in _TAKEN},
    **{name: text for name, (_, text) in _OWN.items()},
}
"""What each parameter is, and what to measure or assume."""
POSITIVE = (*(n for n in SINGLE_POSITIVE if n in UNITS), "differential_limit", "air_density", "gravity")
NOT_NEGATIVE = tuple(name for name in SINGLE_NOT_NEGATIVE if name in UNITS)
ANGLES = (*(n for n in SINGLE_ANGLES if n in UNITS and n != "cyclic_phase"), "differential_limit")

CoaxialParameters = NamedTuple("CoaxialParameters", [(name, Any) for name in UNITS])  # pyrefly: ignore[bad-class-definition]

_EACH = ("hub_height", "shaft_tilt", "blade_first_moment")
OneRotor = NamedTuple("OneRotor", [(name, Any) for name in (*_ROTOR, *_EACH)])  # pyrefly: ignore[bad-class-definition]
"""The numbers of one of the rotors, by the names that `main_rotor` reads; shafts are upright, blades even."""


def one_rotor(par: Named, hub_height: Any) -> Any:
    """The numbers of the rotor at this height."""
    numbers = [getattr(par, name) for name in _ROTOR]
    return OneRotor._make((*numbers, hub_height, 0.0, 1.0))


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
