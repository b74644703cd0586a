"""One change at a time on helicopters entered from their reports: per cent off the published derivatives.

`python research/from_geometry.py` prints the table of from-geometry.md. The UH-60A is not in it: it judges.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import swashplate as sp
from entered_helicopters import BO105, BO105C, BO105C_HOVER, PUMA, Entered, published
from published_helicopters import KNOT, lynx_published
from swashplate.models.catalogue import from_card

NAMES = ("Xu", "Yv", "Mu", "Mq", "Nv", "Nr")
ALSO = ("tail_delta3", "tail_blade_inertia", "rotor_drag_thrust", "fin_height")
_CARD = sp.vehicle("lynx").card.values()
LYNX = Entered(_CARD["mass"], _CARD["rotor_radius"], "ccw", {n: _CARD[n] for n in (*BO105.numbers, *ALSO)})
CASES = [
    *((f"Bo 105 {knots}", BO105, knots, published("bo105", knots)) for knots in (0, 20, 40, 60)),
    *((f"Puma {knots}", PUMA, knots, published("puma", knots)) for knots in (0, 20, 40, 60)),
    *((f"Lynx {knots}", LYNX, knots, lynx_published(knots)) for knots in (0, 20, 40, 60)),
    ("BO-105C 0", BO105C, 0, BO105C_HOVER),
]
PLATES: dict[str, Any] = {"cross_flow": False}
CHANGES: dict[str, tuple[dict[str, Any], dict[str, float]]] = {
    "as it was": (PLATES, {}),
    "fuselage in cross flow": ({}, {}),
    "no wake on the fuselage": (PLATES, {"fuselage_wake": 0.0}),
    "no wake on the tailplane": (PLATES, {"tailplane_wake": 0.0}),
    "tail rotor in the wake": (PLATES | {"tail_in_wake": True}, {}),
    "tip loss": (PLATES | {"tip_loss": True}, {}),
    "inflow uniform": (PLATES | {"inflow": "uniform"}, {}),
    "inflow pitt-peters": (PLATES | {"inflow": "pitt-peters"}, {}),
    "thrust-tilt": (PLATES | {"in_plane": "thrust-tilt"}, {}),
    "no yaw at the hub": (PLATES | {"yaw_at_hub": False}, {}),
    "no delta-3 of the tail": (PLATES, {"tail_delta3": 0.0}),
    "no blockage by the fin": (PLATES, {"fin_blockage": 0.0}),
    "no drag of the thrust": (PLATES, {"rotor_drag_thrust": 0.0}),
}


def off(case: tuple[str, Entered, int, dict[str, float]], options: dict[str, Any], numbers: dict[str, float]) -> list:
    _, entered, knots, told = case
    vehicle = entered.vehicle(**numbers)
    vehicle = from_card(replace(vehicle.card, options={**vehicle.card.options, **options}))
    at = sp.trim(vehicle, speed=knots * KNOT)
    found = sp.derivatives(vehicle, at, primed=entered is not BO105C).tables[0]
    return [100.0 * (found[each] / told[each] - 1.0) for each in NAMES]


def main() -> None:
    rows = {change: [off(case, *made) for case in CASES] for change, made in CHANGES.items()}
    for i, name in enumerate(NAMES):
        print(f"\n| {name} | " + " | ".join(case[0] for case in CASES) + " |")
        print("|---" * (len(CASES) + 1) + "|")
        for change, found in rows.items():
            print(f"| {change} | " + " | ".join(f"{each[i]:+.0f}" for each in found) + " |")


if __name__ == "__main__":
    main()
