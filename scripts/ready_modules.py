"""Make the WebAssembly that ships in the wheel: the ready vehicles' equations, so that they fly without its compiler.

    python scripts/ready_modules.py

A card's numbers are no part of a module: what was fitted to such a vehicle flies by the same one.
"""

from __future__ import annotations

import swashplate as sp
from swashplate.links.live.frame_code import EXPORTS, READY, frame_code, module_name, web_assembly
from swashplate.links.live.world import World
from swashplate.models.catalogue import packaged_cards


def sources() -> dict[str, str]:
    """C of every module that ships, by its file's name."""
    found = {}
    for name in packaged_cards():
        vehicle = sp.vehicle(name)
        variants = [vehicle]
        if "bar" in vehicle.traits.switches:
            variants += [sp.vehicle(name, bar=on) for on in (True, False)]
        for one in variants:
            source = frame_code(World(one, controller=None))
            found[module_name(source, EXPORTS)] = source
    return found


if __name__ == "__main__":
    made = {name: web_assembly(source, ready=False) for name, source in sources().items()}
    for old in READY.glob("*.wasm"):
        old.unlink()
    for name, module in made.items():
        (READY / name).write_bytes(module)
    print(f"{len(made)} modules, {sum(map(len, made.values()))} bytes, in {READY}")
