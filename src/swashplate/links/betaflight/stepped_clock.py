"""Lockstep for a SITL that has none: a clock that stands still until the next state, put before its libraries.

Betaflight's SITL takes its time from CLOCK_MONOTONIC. On Linux a library that is loaded before the system's answers for
it (LD_PRELOAD), so the binary stays as it is.
"""

from __future__ import annotations

import sys
from pathlib import Path

from swashplate.compiler import shared_library
from swashplate.engine.emit import fill_template
from swashplate.errors import SwashError

LOOP = 0.001
"""s of each of its loops (VIRTUAL_GYRO_SAMPLE_RATE_HZ), and so from state to state."""
_NAP, _LOOK = 5e-5, 1e-7
"""s that pass where its main thread sleeps, and where it looks at the clock."""


def stepped_clock(state: int, folder: Path) -> Path | None:
    """The library for states of so many bytes, in a folder; None where there is no compiler, or another system."""
    if sys.platform != "linux":
        return None
    blanks = {name: f"{1e9 * value:.0f}" for name, value in (("LOOP", LOOP), ("NAP", _NAP), ("LOOK", _LOOK))}
    source, library = folder / "clock.c", folder / "clock.so"
    source.write_text(fill_template("stepped_clock.c", {**blanks, "STATE": str(state)}), encoding="utf-8")
    try:
        shared_library([source], library, options=("-O1",))
    except (SwashError, OSError):
        return None
    return library.absolute()
