"""A model as a level-2 S-function: the exported C and a wrapper that Simulink's `mex` compiles.

Written from the documented interface and compiled in the tests against our own stub of simstruc.h; it has not been run
in Simulink.
"""

from __future__ import annotations

from swashplate.export.fmu import wrapper
from swashplate.export.model_c import model_code
from swashplate.export.traced import Traced


def simulink(model: Traced) -> dict[str, str]:
    """Texts by file name: NAME_sfun.c, sfun_model.h, NAME.c and NAME.h."""
    code = model_code(model)
    functions = ("rates", "outputs", "start_x", "start_s", "start_p")
    kinds = ("states", "inputs", "surroundings", "parameters", "outputs")
    config = [
        f"/* In MATLAB: mex {model.name}_sfun.c {model.name}.c",
        f" * then an S-Function block with the name {model.name}_sfun and no parameters. */",
        f"#define S_FUNCTION_NAME {model.name}_sfun",
        f'#include "{model.name}.h"',
        *(f"#define model_{name} {model.name}_{name}" for name in functions),
        *(f"#define N_{kind.upper()} {model.name}_n_{kind}" for kind in kinds),
    ]
    return {
        f"{model.name}_sfun.c": wrapper("sfunction.c"),
        "sfun_model.h": "\n".join(config) + "\n",
        f"{model.name}.h": code.header,
        f"{model.name}.c": code.source,
    }
