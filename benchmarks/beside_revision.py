"""Whole commands beside those of an older revision, in turn on the same machine: how much has changed, whatever it is.

python -m benchmarks.beside_revision REVISION [--repeats 3] [--out FILE.json]    FILE: for tests/proof.py --put

Both codes run with the libraries that are installed, with caches of their own: empty, then filled.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.identifying import START, commands, flight, spent

ROOT = Path(__file__).resolve().parents[1]
ASKED = {
    "identify, cold": 10.0 / 34.0,
    "identify, warm": 4.0 / 15.5,
    "validate, cold": 6.0 / 35.0,
    "control design, cold": 0.5,
    "control check, cold": 0.5,
}
"""What of the former time was asked for when da9651e2 was today's code: for 34 s and 15.5 s of a fit by the clock (in a
new process, and its second in a process) 10 and 4 s of the whole command, for 35 s of processor time 6 s, and half."""
BY_CLOCK = ("identify, cold", "identify, warm")


@contextmanager
def checkout(revision: str) -> Iterator[Path]:
    """The source of a revision in a folder that is there for a while."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name) / "old"
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", place, revision], cwd=ROOT, check=True)
        try:
            yield place / "src"
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", place], cwd=ROOT, check=True)


def _environment(source: Path, cache: Path) -> dict[str, str]:
    left = {k: v for k, v in os.environ.items() if k not in ("XLA_FLAGS", "JAX_COMPILATION_CACHE_DIR")}
    return {**left, "PYTHONPATH": str(source), "XDG_CACHE_HOME": str(cache)}


def measure(revision: str, *, repeats: int) -> dict[tuple[str, str], list[dict[str, float]]]:
    """Per command and state, and code ("former", "this"), what each run used."""
    found: dict[tuple[str, str], list[dict[str, float]]] = {}
    with checkout(revision) as old, tempfile.TemporaryDirectory() as name:
        folder, sources = Path(name), {"former": old, "this": ROOT / "src"}
        flight().save(folder / "flight.parquet")
        save = f"import sys, swashplate as sp; sp.vehicle('coax').with_values({START!r}).save(sys.argv[1])"
        for code, source in sources.items():
            (folder / code).mkdir()
            spent(["-c", save, str(folder / code / "start.toml")], _environment(source, folder / code))
        for turn in range(repeats):
            for what in commands(folder, folder):
                for state in ("cold", "warm"):
                    for code, source in sources.items():
                        around = _environment(source, folder / f"{turn} {what} {code}")
                        words = ["-m", "swashplate", *commands(folder, folder / code)[what]]
                        found.setdefault((f"{what}, {state}", code), []).append(spent(words, around)[0])
    return found


def as_section(found: dict[tuple[str, str], list[dict[str, float]]], revision: str) -> dict[str, Any]:
    """The measured runs in the form of tests/proof.py: medians, and the share that is left of the former time."""

    def median(what: str, code: str, kind: str) -> float:
        return statistics.median(run[kind] for run in found[what, code])

    rows, kept = [], True
    for what in dict.fromkeys(name for name, _ in found):
        kind = "clock" if what in BY_CLOCK else "processor"
        share, asked = median(what, "this", kind) / median(what, "former", kind), ASKED.get(what)
        kept = kept and (asked is None or share <= asked)
        seconds = [median(what, code, kind) for code in ("former", "this")]
        peaks = [max(run["peak_gib"] for run in found[what, code]) for code in ("former", "this")]
        judged = None if asked is None else share <= asked
        rows.append([f"swash {what}", kind, *seconds, share, asked, judged, *peaks])
    repeats = len(next(iter(found.values())))
    text = (
        f"The commands of this code and of revision {revision} in turn, in the same minutes ({os.cpu_count()} cores): "
        f"medians of {repeats} runs. Asked is what was asked for of the seconds that the former took on its day; so a "
        "slow machine slows both."
    )
    columns = ["what", "by", "former [s]", "this [s]", "left", "asked", "met", "former [GiB]", "this [GiB]"]
    title = "Speed beside the code before it was made faster"
    return {"title": title, "text": text, "columns": columns, "rows": rows, "passed": kept}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision", help="of git, whose card and flight files are like today's")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path, help="the section for docs/proof.md, as JSON")
    options = parser.parse_args()
    section = as_section(measure(options.revision, repeats=options.repeats), options.revision)
    text = json.dumps(section, indent=2)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
