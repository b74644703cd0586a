"""One process that reads damaged files, so that whatever one of them does to it is seen from outside.

Lines in: `TARGET<tab>FIRST<tab>COUNT`. Lines out: `? SEED` before each file; after it `a SEED` (accepted),
`w SEED WORDS` (accepted, NumPy or another library warned), `r SEED` (refused) or `x SEED WORDS` (anything else); and
`.` at the end.
"""

from __future__ import annotations

import random
import resource
import sys
import tempfile
import traceback
import warnings
from pathlib import Path

from swashplate.errors import SwashError

from .targets import TARGETS, Target

LONGEST_MESSAGE = 2_000
MEMORY = 4 << 30
"""Bytes that a worker may have of its own."""


def outcome(target_name: str, seed: int, folder: Path) -> str:
    """What reading one damaged file came to: "a", "r" or "x" and words."""
    target = _made.get(target_name) or _made.setdefault(target_name, TARGETS[target_name]())
    path = folder / f"mutant{target.suffix}"
    path.write_bytes(target.mutant(random.Random(f"{target_name} {seed}")))
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            target.use(path)
    except SwashError as error:
        return "r" if len(str(error)) <= LONGEST_MESSAGE else f"x message of {len(str(error))} characters"
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)
        ours = [frame for frame in frames if "/swashplate/" in frame.filename] or frames
        place = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"
        return f"x {type(error).__name__} at {place}: {' '.join(str(error).split())[:200]}"
    return "a" if not told else f"w {told[0].category.__name__} at {Path(told[0].filename).name}:{told[0].lineno}"


_made: dict[str, Target] = {}


def main() -> None:
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    out = sys.stdout
    sys.stdout = sys.stderr  # what the program prints is not the answer
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            name, first, count = line.rstrip("\n").split("\t")
            for seed in range(int(first), int(first) + int(count)):
                print(f"? {seed}", file=out, flush=True)
                told = outcome(name, seed, Path(folder))
                print(f"{told[0]} {seed}{told[1:]}", file=out, flush=True)
            print(".", file=out, flush=True)


if __name__ == "__main__":
    main()
