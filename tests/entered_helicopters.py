"""Helicopters as a user enters them from a report: geometry and inertia from there, everything else by the size class.

Bo 105 and Puma: Padfield (2007), appendix 4B, as a public toolbox has copied it (Musero45/TFG on GitHub,
`heroes/heroesData`); its polynomials of the fuselage are forces and moments at 100 ft/s. BO-105C in hover: Heffley et
al. 1979 (NASA CR-3144), Table III-3, case 29, as SethKitchen/Helicopter on GitHub quotes it; what that report does not
say (hub stiffness, height of the CG) is Padfield's. The toolbox gives the Puma's tail rotor twice: the chord of 0.186 m
is the one that it says is from the book. Nobody gives the fins' heights, the delta-3 and the blockage: the class does.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from published_helicopters import INCH, padfield
from swashplate.models.catalogue import from_card
from swashplate.models.conventional.new_card import new_card
from swashplate.models.vehicle import Vehicle

_HEAD = 0.5 * 1.225 * (100.0 * 0.3048) ** 2
"""Dynamic pressure at 100 ft/s [Pa]."""


class Entered(NamedTuple):
    """What is given of a helicopter, beside mass [kg] and radius [m]; `turns` is its sense of rotation."""

    mass: float
    radius: float
    turns: str
    numbers: dict[str, float]

    def vehicle(self, **numbers: float) -> Vehicle:
        card = new_card("entered", mass=self.mass, radius=self.radius, rotation=self.turns, size_class="full-size")
        known = {
            name: replace(card.parameters[name], value=float(value), sigma=None, lower=None, upper=None)
            for name, value in {**self.numbers, **numbers}.items()
        }
        return from_card(replace(card, parameters={**card.parameters, **known}))


BO105_CG = 0.0163 * 4.91
"""Ahead of the hub's foot [m]."""
BO105 = Entered(
    2200.0,
    4.91,
    "ccw",
    {
        "inertia_xx": 1433.0, "inertia_yy": 4973.0, "inertia_zz": 4099.0, "inertia_xz": 660.0,
        "rotor_chord": 0.27, "rotor_blades": 4, "rotor_lift_slope": 6.113, "rotor_drag": 0.0074, "rotor_twist": -0.14,
        "rotor_speed": 44.4, "blade_inertia": 231.7, "hub_stiffness": 2.0 * 113330.0, "hinge_offset": 0.0,
        "hub_x": -BO105_CG, "hub_height": 1.48, "shaft_tilt": 0.0523,
        "tail_radius": 0.95, "tail_chord": 0.18, "tail_blades": 2, "tail_lift_slope": 5.7, "tail_drag": 0.008,
        "tail_gear": 2220.0 * 2.0 * math.pi / 60.0 / 44.4, "tail_arm": 6.0 + BO105_CG, "tail_height": 1.72,
        "fin_area": 0.805, "fin_lift_slope": 2.704, "fin_arm": 5.416 + BO105_CG, "fin_incidence": 0.08116,
        "tailplane_area": 0.803, "tailplane_lift_slope": 3.262, "tailplane_arm": 4.56 + BO105_CG,
        "tailplane_incidence": 0.0698,
        "fuselage_area_x": 580.6 / _HEAD, "fuselage_area_y": 2399.0 / _HEAD, "fuselage_area_z": 1202.0 / _HEAD,
        "fuselage_pitch_volume": 12752.0 / _HEAD, "fuselage_yaw_volume": 10028.0 / _HEAD,
        "fuselage_pitch_zero": -1191.8 / _HEAD,
    },
)  # fmt: skip
PUMA_CG = 0.005 * 7.5
PUMA = Entered(
    5805.0,
    7.5,
    "cw",
    {
        "inertia_xx": 9638.0, "inertia_yy": 33240.0, "inertia_zz": 25889.0, "inertia_xz": 2226.0,
        "rotor_chord": 0.5401, "rotor_blades": 4, "rotor_lift_slope": 5.73, "rotor_drag": 0.008, "rotor_twist": -0.14,
        "rotor_speed": 27.0, "blade_inertia": 1280.0, "hub_stiffness": 2.0 * 48149.0, "hinge_offset": 0.0,
        "hub_x": -PUMA_CG, "hub_height": 2.157, "shaft_tilt": 0.0873,
        "tail_radius": 1.56, "tail_chord": 0.186, "tail_blades": 5, "tail_lift_slope": 5.73, "tail_drag": 0.008,
        "tail_gear": 4.82, "tail_arm": 9.0 + PUMA_CG, "tail_height": 1.587,
        "fin_area": 1.395, "fin_arm": 9.0 + PUMA_CG,
        "fin_incidence": -0.0175,
        "tailplane_area": 1.34, "tailplane_lift_slope": 3.7, "tailplane_arm": 9.0 + PUMA_CG,
        "tailplane_incidence": -0.0262,
        "fuselage_area_x": 822.9 / _HEAD, "fuselage_area_y": 11672.0 / _HEAD, "fuselage_area_z": 5693.7 / _HEAD,
        "fuselage_pitch_volume": 8745.0 / _HEAD, "fuselage_yaw_volume": 24269.2 / _HEAD,
        "fuselage_pitch_zero": -1065.7 / _HEAD,
    },
)  # fmt: skip
BO105C_CG = (99.15 - 98.44) * INCH
"""Behind the hub [m]."""
BO105C = Entered(
    2096.0,
    4.91,
    "ccw",
    {
        **BO105.numbers,
        "inertia_xx": 1803.0, "inertia_yy": 4892.0, "inertia_zz": 4428.0, "inertia_xz": 0.0,
        "blade_inertia": 219.5, "rotor_twist": -math.radians(8.0), "rotor_lift_slope": 5.73, "tail_lift_slope": 5.73,
        "shaft_tilt": math.radians(3.0), "hub_x": BO105C_CG, "tail_gear": 5.24,
        "tail_arm": (335.0 - 99.15) * INCH, "tail_height": 1.48 + (68.7 - 61.2) * INCH,
        "tailplane_area": 0.809, "tailplane_arm": (277.5 - 99.15) * INCH, "tailplane_incidence": 0.0,
        "tailplane_drop": (61.2 - 25.84) * INCH,
    },
)  # fmt: skip
BO105C_HOVER = {
    "Xu": -0.0166, "Zw": -0.3317, "Mq": -3.3972, "Mu": 0.0663, "Yv": -0.0320,
    "Lp": -9.2439, "Lv": -0.2075, "Nr": -0.3270, "Nv": 0.0325,
}  # fmt: skip
BO105C_TRIM = {"theta0": 14.32, "theta0T": 10.17, "theta": 2.64, "phi": -2.97}
"""In hover [deg]; pitch of the blades where the report measures it is not said."""


def published(name: str, knots: int) -> dict[str, float]:
    """Padfield's derivatives of "bo105" or "puma" at 0, 20, 40 or 60 kn; roll and yaw rows are primed."""
    return padfield(name, knots, sense={"bo105": 1.0, "puma": -1.0}[name])
