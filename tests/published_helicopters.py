"""Helicopters with published derivatives: the numbers, and where they come from.

UH-60A: Hilbert 1984 (NASA TM 85890), Tables 1, 4, 12 to 15, as SethKitchen/Helicopter on GitHub quotes them; tail
surfaces and blockage are GenHel's (Howlett 1981), as a public model of it holds them. Lynx: Padfield (2007), and the
Rationalized Helicopter Model (Skogestad and Postlethwaite 2005). R-50: Mettler, Tischler and Kanade (2002). HeLion:
Cai, Chen and Lee (2011), the linear model about hover, eleven states, as given there (rates of the tip-path plane
divided by its time constant; the sign of the collective is theirs).
"""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

from swashplate.models.catalogue import from_card
from swashplate.models.conventional.new_card import new_card
from swashplate.models.published import read_published
from swashplate.models.vehicle import Vehicle

FOOT, INCH, SLUG = 0.3048, 0.0254, 14.593903
AIR, SLOPE, RADIUS, CHORD = 1.225, 5.73, 26.83 * FOOT, 1.73 * FOOT
TAIL = 5.5 * FOOT
TAIL_CHORD = 0.1875 * math.pi * TAIL / 4
CG, HUB = (360.4, 247.2), (341.2, 315.0)
"""Station and water line [in]."""
ENTERED = {
    "inertia_xx": 5629 * SLUG * FOOT**2,
    "inertia_yy": 40000 * SLUG * FOOT**2,
    "inertia_zz": 37200 * SLUG * FOOT**2,
    "inertia_xz": 1670 * SLUG * FOOT**2,
    "rotor_chord": CHORD,
    "rotor_blades": 4,
    "rotor_lift_slope": SLOPE,
    "rotor_twist": -0.3142,
    "rotor_speed": 27.0,
    "blade_inertia": AIR * SLOPE * CHORD * RADIUS**4 / 8.1936,
    "hinge_offset": 0.04659,
    "hub_x": (CG[0] - HUB[0]) * INCH,
    "hub_height": (HUB[1] - CG[1]) * INCH,
    "shaft_tilt": 0.05236,
    "tail_radius": TAIL,
    "tail_blades": 4,
    "tail_chord": TAIL_CHORD,
    "tail_lift_slope": SLOPE,
    "tail_gear": 124.62 / 27.0,
    "tail_arm": (732.0 - CG[0]) * INCH,
    "tail_height": (324.7 - CG[1]) * INCH,
    "tail_twist": -0.3142,
    "tail_cant": math.radians(20.0),
    "tail_delta3": -0.7002,
    "tail_blade_inertia": AIR * SLOPE * TAIL_CHORD * TAIL**4 / 3.3783,
    "fin_area": 32.3 * FOOT**2,
    "fin_arm": (695.0 - CG[0]) * INCH,
    "fin_height": (273.0 - CG[1]) * INCH,
    "fin_lift_slope": 0.44 / math.radians(10.0),  # its table from -5 to 5 deg
    "fin_blockage": (1.0 - 0.9) / (32.3 / (math.pi * 5.5**2)),  # 0.9 of the thrust is left in hover
    "tailplane_area": 45.0 * FOOT**2,
    "tailplane_arm": (700.4 - CG[0]) * INCH,
    "tailplane_drop": (HUB[1] - 244.0) * INCH,
    "tailplane_lift_slope": 0.712 / math.radians(10.0),
}
PUBLISHED = {"Zw": -0.2748, "Lp": -3.3484, "Nr": -0.2879, "Yv": -0.0465, "Nv": 0.0266, "Xu": -0.0150}
"""At 0.5 kn [1/s, rad/(m s)]."""
MQ_AT_20_KN = -1.03

TAU = 1.0 / 8.1222
HELION = {
    "g": 9.7807, "Xu": -0.1778, "Yv": -0.3104, "Yped": 0.0,
    "Lu": -0.3326, "Lv": -0.5353, "Lw": 0.0, "La": 75.764, "Lb": 343.86, "Lped": 0.0,
    "Mu": 0.1903, "Mv": -0.294, "Mw": 0.0, "Ma": 172.62, "Mb": -59.958, "Mcol": 0.0,
    "tau_f": TAU, "Ab": 4.6535 * TAU, "Ba": -0.0921 * TAU,
    "Alat": 0.0632 * TAU, "Alon": 3.339 * TAU, "Blat": 3.1739 * TAU, "Blon": 0.2216 * TAU,
    "Za": 17.168, "Zb": 7.1018, "Zw": -0.6821, "Zr": -0.107, "Zcol": 19.925,
    "Nv": 0.0, "Np": -0.2834, "Nw": -0.1446, "Nr": -5.5561, "Nrfb": -36.674 * 2.7492, "Krfb": 11.112,
    "Nped": -74.364, "Ncol": 2.0816,
}  # fmt: skip


def entered() -> Vehicle:
    card = new_card("UH-60A", mass=7439.0, radius=RADIUS, rotation="ccw", size_class="full-size")
    known = {
        name: replace(card.parameters[name], value=float(value), sigma=None, lower=None, upper=None, source="TM 85890")
        for name, value in ENTERED.items()
    }
    return from_card(replace(card, parameters={**card.parameters, **known}))


def lynx_rows(shared_data: Path) -> dict[str, dict[str, float]]:
    with (shared_data / "vehicles" / "lynx_validation.csv").open(encoding="utf-8") as lines:
        return {row.pop("deriv"): {k: float(v) for k, v in row.items()} for row in csv.DictReader(lines)}


KNOT = 1.689 * 0.3048
"""m/s, as Padfield's U_0 in Y_r has it."""


def padfield(name: str, knots: int, *, sense: float = 1.0) -> dict[str, float]:
    """Padfield's A and B without their kinematic terms; the attitude is in A's gravity terms."""
    path = Path(__file__).parent / "oracle" / name / f"padfield_{knots:02d}kn.csv"
    with path.open(encoding="utf-8") as lines:
        gravity = {row[""]: row for row in csv.DictReader(line for line in lines if not line.startswith("#"))}
    roll = -math.atan2(float(gravity["w"]["phi"]), float(gravity["v"]["phi"]))
    pitch = math.asin(-float(gravity["w"]["theta"]) / 9.81 / math.cos(roll))
    speed = knots * KNOT
    flight = {"u": speed * math.cos(pitch), "v": 0.0, "w": speed * math.sin(pitch) * math.cos(roll)}
    return read_published(path, sense=sense, flight=flight)


def lynx_published(knots: int) -> dict[str, float]:
    return padfield("lynx", knots)


def r50_identified(data: Path) -> dict[str, float]:
    """Mettler's R-50 in hover, SI."""
    with (data / "vehicles" / "derivs_mettler_r50.csv").open(encoding="utf-8") as lines:
        return {row["param"]: float(row["hover_SI"]) for row in csv.DictReader(lines)}
