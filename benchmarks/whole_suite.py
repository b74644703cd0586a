"""`make test` beside that of an older revision, in turn on the same machine: each in a clone with nothing compiled.

python -m benchmarks.whole_suite REVISION [--out FILE.json]    FILE: for tests/proof.py --put

This code runs before and after the older one, so that a machine that becomes slower is seen. Fifty minutes, all in all.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
ASKED = 6.0 / 11.0
"""For 11 minutes of da9651e2 on its day 6 were asked for."""
_OURS = re.compile("XLA_FLAGS|JAX_.*|OMP_NUM_THREADS|OPENBLAS_NUM_THREADS|PYTHON.*|VIRTUAL_ENV|XDG_CACHE_HOME")


def _environment(cache: Path) -> dict[str, str]:
    """That of a newcomer: nothing of this project's is set, and nothing was kept."""
    left = {name: value for name, value in os.environ.items() if not _OURS.fullmatch(name)}
    path = [place for place in left["PATH"].split(os.pathsep) if ROOT not in Path(place).parents]
    return {**left, "PATH": os.pathsep.join(path), "XDG_CACHE_HOME": str(cache)}


def said(output: str) -> dict[str, float]:
    """Tests that passed and failed by pytest's last line."""
    last = [line for line in output.splitlines() if re.search(r"\d+ (passed|failed|error).* in [\d.]+s", line)]
    if not last:
        raise ValueError(f"make test said nothing of its tests; it ended with: {output[-2000:]}")
    return {kind: float((re.findall(rf"(\d+) {kind}", last[-1]) or [0])[0]) for kind in ("passed", "failed", "error")}


def suite(revision: str) -> dict[str, float]:
    """What `make test` of a revision took after its installation: clock and processor time [s], tests."""
    with tempfile.TemporaryDirectory() as name:
        code, around = Path(name) / "code", _environment(Path(name) / "cache")
        subprocess.run(["git", "clone", "--quiet", "--no-checkout", ROOT, code], check=True)
        subprocess.run(["git", "checkout", "--quiet", "--detach", revision], cwd=code, check=True)
        if (real := ROOT.parent / "shared").is_dir():
            (Path(name) / "shared").symlink_to(real.resolve())
        subprocess.run(["make", ".venv/.complete"], cwd=code, env=around, check=True, stdout=subprocess.DEVNULL)
        before, begin = os.times(), time.perf_counter()
        run = subprocess.run(["make", "test"], cwd=code, env=around, capture_output=True, text=True, check=False)
        if run.returncode:  # make stopped at a failed test, before the benchmarks that some revisions have after them
            subprocess.run(["make", "speed"], cwd=code, env=around, capture_output=True, check=False)
        clock, after = time.perf_counter() - begin, os.times()
        spent = sum(after[2:4]) - sum(before[2:4])
        print(revision, run.stdout[-1500:], run.stderr[-500:], file=sys.stderr, flush=True)
        return {"clock": clock, "processor": spent, **said(run.stdout)}


def as_section(former: dict[str, float], this: list[dict[str, float]], revision: str) -> dict[str, Any]:
    """The measured runs in the form of tests/proof.py, with the share that is left of the former time."""
    clock = statistics.mean(run["clock"] for run in this)
    share = clock / former["clock"]
    runs = [("former", former), *(("this", run) for run in this)]
    rows = [
        [code, run["clock"], run["processor"], int(run["passed"]), int(run["failed"] + run["error"])]
        for code, run in runs
    ]
    whole = not any(run["failed"] + run["error"] for run in this)
    text = (
        f"`make test` in clones with nothing compiled, of this code before and after that of revision {revision} "
        f"({os.cpu_count()} cores). Left of the clock's time is {share:.2f}, asked {ASKED:.2f} (6 of the 11 minutes "
        "that the former took on its day); so a slow machine slows both. Processor time is without browsers."
    )
    if failed := int(former["failed"] + former["error"]):
        text += (
            f" {failed} tests of the former fail here; its short benchmarks, which come after them, ran by themselves."
        )
    columns = ["code", "clock [s]", "processor [s]", "tests passed", "failed"]
    title = "The whole of `make test` beside that of the code before it was made faster"
    return {"title": title, "text": text, "columns": columns, "rows": rows, "passed": whole and share <= ASKED}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision", help="of git, with a `make test` of its own")
    parser.add_argument("--out", type=Path, help="the section for docs/proof.md, as JSON")
    options = parser.parse_args()
    known = ["git", "rev-parse", "--quiet", "--verify", f"{options.revision}^{{commit}}"]
    if subprocess.run(known, cwd=ROOT, capture_output=True, check=False).returncode:
        parser.error(f"git knows no revision {options.revision}")  # not after the first run
    before, former, after = suite("HEAD"), suite(options.revision), suite("HEAD")
    text = json.dumps(as_section(former, [before, after], options.revision), indent=2)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
