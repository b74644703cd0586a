"""JAX's persistent compilation cache in the user's cache folder, so that a second run starts fast."""

from __future__ import annotations

import os
from pathlib import Path

import jax
import platformdirs


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
