"""C of one period of the live page, law and physics, and the same as WebAssembly: what flies where no Python is."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from swashplate.atomic import scratch_folder, write_text
from swashplate.compiler import ran, web_compiler
from swashplate.engine.emit import fill_template, print_graph
from swashplate.engine.equations import equations_of
from swashplate.engine.fly import flight_code
from swashplate.engine.law import FELT, print_function
from swashplate.engine.roots import require_casadi
from swashplate.engine.trace import traced_force, traced_placing
from swashplate.errors import ExportError
from swashplate.extras import missing
from swashplate.links.live.pilots import WANTED
from swashplate.links.live.sensors import BODY, PLACED, traced_sensors
from swashplate.links.live.world import MOST_DRAWS, World

EXPORTS = ("frame", "buffer", "delays", "sense")
"""What the module shows, beside its memory."""
_TARGET = ("-target", "wasm32-freestanding", "-nostdlib", "-Wl,--no-entry", "-Wl,--strip-all")
_OPTIONS = ("-O2", "-fno-math-errno", "-fno-trapping-math", "-w")
_STACK = 1 << 18
"""Bytes: a period of a vehicle with a hundred states needs a tenth of it."""
READY = Path(__file__).parent / "ready"
"""Modules of the ready vehicles' equations, whatever their numbers, made by `scripts/ready_modules.py`."""


def frame_code(world: World) -> str:
    """C of `frame`: one period of the controller for one of some crafts (`templates/frame.c`).

    Args:
        world: what flies; its vehicle, law, delays and steps. It, its ghost and its drawn models may fly at a time.

    Raises:
        ExportError: for equations or a law that CasADi cannot trace.
        MissingLibraryError: without CasADi.
    """
    require_casadi()
    equations = equations_of(world.vehicle)
    readings = len(world.vehicle.state_names) + len(FELT) + 1
    law = world.pilot.decide.graph(readings, world.pilot.memory.size, world.pilot.gain_count)
    printed, _ = print_function(law.function, "double")
    force = placing = ""
    if world.pilot.feels:
        force = print_graph(
            traced_force(equations), real="double", precision="double", inputs=["x", "w", "p"], outputs=["felt"]
        )
    if not world.vehicle.traits.linear:
        placing = print_graph(
            traced_placing(len(world.vehicle.state_names)),
            real="double",
            precision="double",
            inputs=["x"],
            outputs=["row"],
        )
    f, period = law.function, world.substeps
    sensors = print_graph(traced_sensors(), real="double", precision="double", inputs=["x", "s"], outputs=["row"])
    return fill_template(
        "frame.c",
        {
            "FLIGHT": flight_code(
                equations, None, precision="double", lanes=1, quaternion=not world.vehicle.traits.linear
            ),
            "TRACED": printed,
            "PLACE": placing,
            "FEELS": int(world.pilot.feels),
            "FORCE": force,
            "NAME": f.name(),
            "LONGEST": max(1, int(f.sz_w())),
            "WHOLES": max(1, int(f.sz_iw())),
            "ARGUMENTS": max(4, int(f.sz_arg())),
            "RESULTS": max(1, int(f.sz_res())),
            "PERIOD": period,
            "DEPTH": world.depth,
            "CARRIED": law.memory,
            "ASKED": len(WANTED),
            "GAINS": world.pilot.gain_count,
            "DRAWN": law.draws,
            "CRAFTS": 2 + max(MOST_DRAWS, len(world.draws)),
            "STEP": repr(world.period / period),
            "SENSORS": sensors,
            "BODY": BODY,
            "PLACED": len(PLACED),
        },
    )


def module_name(source: str, exports: Sequence[str]) -> str:
    """The file's name of a module that ships, by what it is made of."""
    made_of = "\n".join([source, fill_template("bare.h", {}), *_TARGET, *_OPTIONS, str(_STACK), *exports])
    return f"{hashlib.sha256(made_of.encode()).hexdigest()[:20]}.wasm"


def web_assembly(source: str, *, exports: Sequence[str] = EXPORTS, ready: bool = True) -> bytes:
    """A C source as a WebAssembly module without a library: all that it imports is mathematics, from the browser.

    Args:
        source: C without a main.
        exports: functions that it shows, beside its memory.
        ready: take the module that ships where there is one of this source.

    Raises:
        MissingLibraryError: without a compiler that makes it: ziglang (the extra `compiler`), or clang with wasm-ld.
        ExportError: where it refuses the source.
        WriteError: where the folder for temporary files is full.
    """
    ships = READY / module_name(source, exports)
    if ready and ships.is_file():
        return ships.read_bytes()
    program = web_compiler()
    if program is None:
        raise missing("ziglang", what="a page in which a model flies")
    bare = fill_template("bare.h", {}) + re.sub(r"#include <(?:math|string)\.h>\n", "", source)
    with scratch_folder() as folder:
        text, module = folder / "frame.c", folder / "frame.wasm"
        write_text(text, bare)
        shown = [f"-Wl,--export={name}" for name in exports]
        command = [*program, *_TARGET, f"-Wl,-z,stack-size={_STACK}", *_OPTIONS, *shown]
        code, _, said = ran([*command, "-o", str(module), str(text)], where="WebAssembly")
        if code != 0 or not module.is_file():
            name = "ziglang" if len(program) > 1 else program[0]
            raise ExportError(f"{name} refused the model's C: {said.strip()[:300]}", where="WebAssembly")
        return module.read_bytes()
