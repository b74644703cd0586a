"""How XLA compiles here: a persistent cache, so that a second run starts fast, and small loops as one function."""

from __future__ import annotations

import importlib
import json
import os
import zlib
from contextlib import suppress
from pathlib import Path

from swashplate.arrays import lengthened as lengthened
from swashplate.atomic import write_text
from swashplate.errors import WriteError
from swashplate.jax_on_demand import option, set_option
from swashplate.kept import cache_folder

QUICK_TO_COMPILE = {"xla_cpu_use_fusion_emitters": False}
"""Options for `jax.jit`: a helicopter's exact derivatives compile four times faster, loops of one vehicle by a sixth to
a third, and run as fast; a batch runs 5 % slower."""

FEW_PASSES = {**QUICK_TO_COMPILE, "xla_backend_optimization_level": 1}
"""Options for `jax.jit` of runs and slopes along records: a seventh to a third less compiling than
`QUICK_TO_COMPILE`, and as fast (slopes at all samples side by side 6 % slower)."""

RUN_RARELY = {**QUICK_TO_COMPILE, "xla_backend_optimization_level": 0}
"""Of what is called a few hundred times at most: half of the compiling, and a call takes 10 to 70 us longer."""

_SMALL_LOOP = "xla_cpu_small_while_loop_byte_threshold"
_SMALL_LOOP_BYTES = 1_000_000


def compile_small_loops_whole() -> None:
    """Let XLA compile a loop that touches little memory into one function instead of one launch per kernel.

    XLA's CPU compiler does this for loops of up to 1,024 bytes; one vehicle's Runge-Kutta stage touches some
    thousands. A launch takes about 60 ns and a stage has 40 to 100 of them (measured: 1,350,000 steps per second
    instead of 150,000 for one CoaX, 440,000 instead of 43,000 for a helicopter with flapping, bar and dynamic inflow).
    Loops that gather, scatter or multiply matrices stay as they are.

    An option of XLA that is read when JAX first compiles: called by the package's entry points, it has no effect where
    JAX has already compiled something, and it leaves a value alone that the user has set.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" not in flags:
        option = f"--xla_backend_extra_options={_SMALL_LOOP}={_SMALL_LOOP_BYTES}"
        os.environ["XLA_FLAGS"] = f"{flags} {option}".strip()


def enable_compilation_cache(folder: str | Path | None = None) -> Path | None:
    """Keep compiled code between runs; called by the package's entry points, never on import.

    Args:
        folder: where; by default the folder that JAX is already told to use (`JAX_COMPILATION_CACHE_DIR`), otherwise
            `swashplate/jax` in the user's cache folder.

    Returns:
        The folder, or None where it cannot be written (then nothing is kept, and nothing else changes).
    """
    asked = folder or option("jax_compilation_cache_dir") or cache_folder("jax")
    if asked is None:
        return None
    chosen = Path(asked)
    try:
        chosen.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    if not os.access(chosen, os.W_OK):
        return None
    _without_damaged(chosen)
    set_option("jax_compilation_cache_dir", str(chosen))
    set_option("jax_persistent_cache_min_compile_time_secs", 0.3)
    set_option("jax_persistent_cache_min_entry_size_bytes", 0)
    return chosen


_CHECKED = "checked.json"


def _without_damaged(folder: Path) -> None:
    """Removes entries that do not unpack, so that they are compiled anew.

    JAX writes an entry in place and never again: one that a kill or a full disk cut off stays for ever, and each run
    warns of it. An entry is unpacked once; a note beside the entries says which were whole, by size and time.
    """
    note = folder / _CHECKED
    try:
        known = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        known = {}
    known = known if isinstance(known, dict) else {}
    whole = {}
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if not entry.name.endswith("-cache"):
                continue
            with suppress(OSError):
                status = entry.stat()
                seen = [status.st_size, status.st_mtime_ns]
                if known.get(entry.name) == seen or _unpacks(Path(entry.path).read_bytes()):
                    whole[entry.name] = seen
                else:
                    os.unlink(entry.path)
    if whole != known:
        with suppress(WriteError):  # without the note they are unpacked again the next time
            write_text(note, json.dumps(whole))


def _unpacks(content: bytes) -> bool:
    """Whether an entry is complete: JAX packs it by Zstandard where that is installed, by zlib otherwise."""
    for name in ("compression.zstd", "zstandard"):
        with suppress(ImportError):
            unpack = importlib.import_module(name).decompress
            break
    else:
        unpack = zlib.decompress
    try:
        return len(unpack(content)) > 0
    except Exception:  # each library has errors of its own
        return False
