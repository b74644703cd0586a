"""Small pages in which a reader moves a control, a number or the speed, and the vehicle's own C answers as WebAssembly.

`<!-- step NAME KNOB -->` on a page becomes one: KNOB is `bar` (with and without it), `wake_distortion` (K_R, 0 to 3) or
`speed` (0 to 20 m/s, each with its own trim). What is drawn dashed is the card as it is, in the hover.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import swashplate as sp
from swashplate.export.model_c import model_code
from swashplate.export.traced import trace_vehicle
from swashplate.links.live.frame_code import web_assembly
from swashplate.links.logs.app import PAGE as LOGS
from swashplate.links.web.single_file import WEB_ASSEMBLY, single_file
from swashplate.models.vehicle import Vehicle

DT, SECONDS = 0.002, 1.2
SPEEDS = tuple(map(float, range(21)))
K_R = (0.0, 3.0)
_FIRST = {"coax": "servo_roll", "raptor50": "A1"}
_ROOM = "static double room[{size}];\ndouble *numbers(void) {{ return room; }}\n"


@lru_cache(maxsize=4)
def craft(name: str, bar: bool, speeds: tuple[float, ...]) -> tuple[bytes, dict[str, Any], Vehicle]:
    """A vehicle's step as WebAssembly, what the page must know of it, and the vehicle."""
    vehicle = sp.vehicle(name, bar=bar)
    trims = [sp.trim(vehicle, speed=speed) for speed in speeds]
    model = trace_vehicle(vehicle, trims[0], name="m")
    code = model_code(model)
    s, p = ([float(one.start) for one in part] for part in (model.surroundings, model.parameters))
    size = len(vehicle.state_names) + len(vehicle.input_names) + len(s) + len(p)
    source = code.source.replace('#include "m.h"', code.header) + _ROOM.format(size=size)
    told = {
        "label": "with stabilizer bar" if bar else "without stabilizer bar",
        "states": list(vehicle.state_names),
        "s": s,
        "p": p,
        "trims": [
            {"speed": speed, "x": trim.state.tolist(), "u": trim.inputs.tolist()}
            for speed, trim in zip(speeds, trims, strict=True)
        ],
    }
    return web_assembly(source, exports=("m_step", "numbers")), told, vehicle


def step_picture(name: str, knob: str) -> str:
    """The text of one such page.

    Raises:
        SwashError: without CasADi, ziglang or the page's libraries.
    """
    own = bool(sp.vehicle(name).card.options.get("bar"))
    speeds = SPEEDS if knob == "speed" else (0.0,)
    crafts = [craft(name, own, speeds), *([craft(name, not own, speeds)] if knob == "bar" else [])]
    vehicle = crafts[0][2]
    inputs = [
        {"name": one, "unit": unit, "low": float(low), "high": float(high)}
        for one, unit, (low, high) in zip(vehicle.input_names, vehicle.input_units, vehicle.input_limits, strict=True)
    ]
    card = vehicle.card
    of_card = f"K_R = {card.values()[knob]:g}, " if knob == "wake_distortion" else ""
    picture = {
        "crafts": [told for _, told, _ in crafts],
        "inputs": inputs,
        "input": list(vehicle.input_names).index(_FIRST[name]),
        "dt": DT,
        "steps": round(SECONDS / DT),
        "fastest": card.fastest,
        "shownSpeed": 10,
        "asIs": f"the card as it is, {of_card}{crafts[0][1]['label']}, hover",
        "knob": {
            "name": "K_R",
            "place": list(card.values()).index(knob),
            "low": K_R[0],
            "high": K_R[1],
            "value": card.values()[knob],
        }
        if knob == "wake_distortion"
        else None,
    }
    here = Path(__file__).parent / "step"
    return single_file(
        here / "step.html",
        title=f"{name}: step of a control",
        documents={"picture": picture},
        packed={f"{WEB_ASSEMBLY}{k or ''}": code for k, (code, _, _) in enumerate(crafts)},
        folders={"/step/": here, "/open/": LOGS},
    )
