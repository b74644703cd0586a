"""A model as a level-2 S-function: the exported C and a wrapper that Simulink's `mex` compiles.

Written from the documented interface and compiled in the tests against our own stub of simstruc.h; it has not been run
in Simulink.
"""

from __future__ import annotations

from swashplate.engine.emit import fill_template
from swashplate.export.model_c import model_code
from swashplate.export.traced import Traced


def simulink(model: Traced) -> dict[str, str]:
    """Texts by file name: NAME_sfun.c, sfun_model.h, NAME.c and NAME.h."""
    code = model_code(model)
    return {
        f"{model.name}_sfun.c": fill_template("sfunction.c", {}),
        "sfun_model.h": fill_template(
            "sfun_model.h", {"NAME": model.name, "NAMES": fill_template("model_names.h", {"NAME": model.name})}
        ),
        f"{model.name}.h": code.header,
        f"{model.name}.c": code.source,
    }
