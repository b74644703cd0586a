"""Computes golden cases, each run in a process of its own with fixed threads and flags.

    python -m tests.golden.freeze --list
    python -m tests.golden.freeze CASE...            computes them and writes tests/golden/frozen/CASE.json
    python -m tests.golden.freeze --check CASE...    computes them and says how far they are from what is frozen

Instead of names: --light, --heavy or --all. Freeze only what was meant to change, and say in the commit why it did.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # the tests' own modules (hfb320, r50, ...) lie in tests/
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from . import cases  # noqa: F401 (fills CASES)
from .case import CASES, ENVIRONMENT, FROZEN, RELATIVE, ROOT, SMALL, Case, Values, deviations, floor_of, plain

PACKAGES = ("numpy", "scipy", "casadi", "control")


def data_folder() -> Path | None:
    """The folder of real flights, as the tests find it."""
    places = [os.environ.get("SWASHPLATE_DATA"), ROOT.parent / "shared" / "data"]
    return next((Path(place) for place in places if place and Path(place).is_dir()), None)


def missing(case: Case) -> str:
    """What a case needs and is not here ("": nothing)."""
    folder = data_folder()
    for name in case.data:
        if folder is None or not (folder / name).exists():
            return f"shared data {name}: set SWASHPLATE_DATA or put shared/data beside the checkout"
    return ", ".join(f"package {name}" for name in case.needs if importlib.util.find_spec(name) is None)


def machine() -> dict[str, str]:
    """What decides the last digits: processor and packages."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []
    told = {line.partition(":")[0].strip(): line.partition(":")[2].strip() for line in lines}
    flags = " ".join(sorted(told.get("flags", "").split()))
    return {
        "processor": told.get("model name", platform.machine()),
        "instructions": hashlib.sha256(flags.encode()).hexdigest()[:12],
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in PACKAGES if importlib.util.find_spec(name)},
    }


def compute(names: Sequence[str], *, environment: dict[str, str] | None = None) -> dict[str, dict[str, Any]]:
    """Runs cases in one process of their own: {name: {"values": ..., "seconds": ...}}; a failure is raised as text."""
    if not names:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "computed.json"
        command = [sys.executable, "-m", "tests.golden.freeze", "--compute", str(out), *names]
        paths = os.pathsep.join(p for p in (str(ROOT / "src"), os.environ.get("PYTHONPATH", "")) if p)
        around = {**os.environ, **ENVIRONMENT, **(environment or {}), "PYTHONPATH": paths}
        done = subprocess.run(command, cwd=ROOT, env=around, check=False, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}:\n{done.stderr[-4000:]}")
        found: dict[str, dict[str, Any]] = json.loads(out.read_text(encoding="utf-8"))
        return found


def frozen(name: str) -> dict[str, Any]:
    """A case's file."""
    document: dict[str, Any] = json.loads((FROZEN / f"{name}.json").read_text(encoding="utf-8"))
    return document


def write(name: str, values: Values, seconds: float) -> Path:
    """A case's file, complete or not at all."""
    document = {
        "case": name,
        "commit that last changed src": subprocess.run(
            ["git", "log", "-1", "--format=%H", "--", "src"], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.strip(),
        "machine": machine(),
        "environment": ENVIRONMENT,
        "relative": RELATIVE,
        "floor": f"{SMALL:g} in its own unit for a single number, {RELATIVE:g} of the largest entry for a list",
        "seconds": round(seconds, 1),
        "values": values,
        "floors": {n: floor_of(v) for n, v in values.items() if isinstance(v, list) and floor_of(v) > 1e-300},
    }
    path = FROZEN / f"{name}.json"
    partial = path.with_suffix(".part")
    partial.write_text(_compact(document), encoding="utf-8")
    partial.replace(path)
    return path


def _compact(document: dict[str, Any]) -> str:
    """JSON with one line an entry: short, and a change shows in a diff."""
    values = ",\n".join(f"  {json.dumps(n)}: {json.dumps(v)}" for n, v in document["values"].items())
    rest = {key: value for key, value in document.items() if key not in ("values", "floors")}
    head = json.dumps(rest, indent=1)[:-2]
    return f'{head},\n "values": {{\n{values}\n }}\n}}\n'


def _compute_here(out: Path, names: Sequence[str]) -> None:
    results = {}
    for name in names:
        begun = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            values = plain(CASES[name].compute(Path(folder)))
        results[name] = {"values": values, "seconds": time.monotonic() - begun}
        out.write_text(json.dumps(results), encoding="utf-8")


def _asked(arguments: argparse.Namespace) -> list[str]:
    names = list(arguments.cases)
    if arguments.all or arguments.light or arguments.heavy:
        names += [n for n, c in CASES.items() if arguments.all or c.light == arguments.light]
    unknown = [name for name in names if name not in CASES]
    if unknown:
        sys.exit(f"no case {', '.join(unknown)}; --list says which there are")
    return names


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE")
    for name in ("list", "check", "light", "heavy", "all"):
        parser.add_argument(f"--{name}", action="store_true")
    parser.add_argument("--compute", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.compute:
        _compute_here(arguments.compute, arguments.cases)
        return 0
    if arguments.list:
        for name, one in CASES.items():
            there = "" if (FROZEN / f"{name}.json").exists() else "not frozen"
            print(f"{name:38s} {'light' if one.light else 'heavy'} {there}")
        return 0
    bad = 0
    for name in _asked(arguments):
        lacking = missing(CASES[name])
        if lacking:
            print(f"{name}: left out, for it needs {lacking}")
            continue
        try:
            done = compute([name])[name]
        except RuntimeError as failure:
            bad += 1
            print(f"{name}: {failure}", flush=True)
            continue
        if not arguments.check:
            print(f"{write(name, done['values'], done['seconds']).name}: {done['seconds']:.1f} s", flush=True)
            continue
        away = deviations(frozen(name)["values"], done["values"])
        over = [d for d in away if d.size > 1.0]
        bad += bool(over)
        print(f"{name}: {len(over)} of {len(away)} numbers beyond {RELATIVE:g}", flush=True)
        for deviation in over[:10] or away[:1]:
            print(f"   {deviation}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
