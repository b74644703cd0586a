"""How XLA compiles here: a persistent cache, so that a second run starts fast, and flags of the compiler."""

from __future__ import annotations

import os
from pathlib import Path

import jax
import platformdirs

QUICK_TO_COMPILE = {"xla_cpu_use_fusion_emitters": False}
"""Options for `jax.jit` of what takes longest to compile: as below, also where JAX has compiled something before."""

_FLAGS = {
    "xla_cpu_use_fusion_emitters": "false",
    "xla_backend_extra_options": "xla_cpu_small_while_loop_byte_threshold=1000000",
}


def set_compiler_flags() -> None:
    """Let XLA make one function of a loop that touches little memory, and compile without its fusion emitters.

    By default XLA's CPU compiler does the first for loops of up to 1,024 bytes; one vehicle's Runge-Kutta stage touches
    some thousands. A launch takes about 60 ns and a stage has 40 to 100 of them (measured: 1,350,000 steps per second
    instead of 150,000 for one CoaX, 440,000 instead of 43,000 for a helicopter with flapping, bar and dynamic inflow).
    Loops that gather, scatter or multiply matrices stay as they are.

    Without the emitters a helicopter's derivatives compile in a sixth less time (the exact ones of an observer in a
    quarter of it) and a fit needs a third less memory; what was compiled runs as fast (decision 27).

    Flags of XLA that are read when JAX first compiles: called by the package's entry points, they have no effect where
    JAX has already compiled something, and a value that the user has set stays.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    ours = [f"--{name}={value}" for name, value in _FLAGS.items() if name not in flags]
    if ours:
        os.environ["XLA_FLAGS"] = " ".join([flags, *ours]).strip()


def enable_compilation_cache(folder: str | Path | None = None) -> Path | None:
    """Keep compiled code between runs; called by the package's entry points, never on import.

    Args:
        folder: where; by default the folder that JAX is already told to use (`JAX_COMPILATION_CACHE_DIR`), otherwise
            `swashplate/jax` in the user's cache folder.

    Returns:
        The folder, or None where it cannot be written (then nothing is kept, and nothing else changes).
    """
    chosen = Path(
        folder
        or jax.config.values["jax_compilation_cache_dir"]
        or Path(platformdirs.user_cache_dir("swashplate", appauthor=False)) / "jax"
    )
    try:
        chosen.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    if not os.access(chosen, os.W_OK):
        return None
    _set("jax_compilation_cache_dir", str(chosen))
    _set("jax_persistent_cache_min_compile_time_secs", 0.3)
    _set("jax_persistent_cache_min_entry_size_bytes", 0)
    return chosen


def _set(option: str, value: object) -> None:
    jax.config.update(option, value)  # type: ignore[no-untyped-call]


def dispatch_in_line() -> None:
    """Let JAX run compiled code in the thread that calls it, for a process that waits for every small step.

    By default the CPU back end hands every program with a loop to another thread (measured: 45 us a call). An option
    that is read when JAX first computes; called by entry points that own their process.
    """
    _set("jax_cpu_enable_async_dispatch", False)
