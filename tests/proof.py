"""Runs every proof and writes docs/proof.md from what came out: `make proof`.

Three fifths of its tests took 54 minutes on two slow cores.

    python -m tests.proof [--assemble-only | --put FILE ...]

Tests marked `proof` and the benchmarks leave JSON files in build/proof (the folder that SWASHPLATE_PROOF names):

    {"title": "...", "text": "one paragraph", "columns": ["..."], "rows": [["..."]], "passed": true}

`rows` hold texts or numbers; `passed` may be left out. The benchmarks' file (build/proof/benchmarks.json) is what
`python -m benchmarks.run --out` writes. Files of an earlier run are removed first, so that nothing old is reported.
With `--put`, nothing runs: sections of the given files take the places of those of the same title, and say their day.
Such sections stay where a later run has none of that title: it had no Slurm, no Kubernetes or no older code beside it.
What `make siege` wrote into the page (tests/siege/run.py) is kept.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "build" / "proof"
PAGE = ROOT / "docs" / "proof.md"
PACKAGES = ("swashplate", "casadi", "numpy", "scipy")


def ran(command: Sequence[str]) -> dict[str, Any]:
    """A command's exit code and duration; its output goes to the screen."""
    print("$", " ".join(command), flush=True)
    begin = time.monotonic()
    environment = {**os.environ, "SWASHPLATE_PROOF": str(FOLDER)}
    code = subprocess.run([sys.executable, *command], cwd=ROOT, env=environment, check=False).returncode
    return {"command": "python " + " ".join(command), "code": code, "seconds": time.monotonic() - begin}


def cell(value: Any) -> str:
    """A number with four figures, or a text, safe inside a Markdown table."""
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: ""}[value]
    text = f"{value:.4g}" if isinstance(value, float) else f"{value:,}" if isinstance(value, int) else str(value)
    return text.replace("|", "\\|").replace("\n", " ")


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    lines = [
        [cell(name) for name in columns],
        ["---"] * len(columns),
        *([cell(value) for value in row] for row in rows),
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def section(document: dict[str, Any]) -> str:
    """One JSON file as a section of the page."""
    verdict = {True: "**Passed.** ", False: "**Missed.** ", None: ""}[document.get("passed")]
    parts = [f"## {document['title']}", verdict + document.get("text", "")]
    if document.get("columns"):
        parts.append(markdown_table(document["columns"], document["rows"]))
    return "\n\n".join(part for part in parts if part)


def benchmarks_as_section(document: dict[str, Any]) -> dict[str, Any]:
    """The benchmarks' own file in the common form."""
    results, machine = document["results"], document["machine"]
    spans, flown = document.get("spans", []), document.get("live", [])
    return {
        "title": "Speed",
        "text": "Vehicle steps per second (best of several repeats), seconds of an identification, time that the "
        "live page lost in percent, all in one run "
        f"({machine['processor']}, {machine['cores']} cores, load {machine['load_before']:.1f} before).",
        "columns": ["what", "steps/s, seconds or %", "promised", "met", "note"],
        "rows": [
            [r["name"], round(r["rate"]), None if r["target"] is None else round(r["target"]), r["met"], r["note"]]
            for r in results
        ]
        + [[s["name"], s["seconds"], s["target"], s["met"], s["note"]] for s in spans]
        + [[f"live, time lost: {run['name']}", run["late"], run["target"], run["met"], run["note"]] for run in flown],
        "passed": all(measured["met"] for measured in (*results, *spans, *flown)),
    }


def heading(runs: Sequence[dict[str, Any]]) -> str:
    """Where and when, and what ran."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    packages = ", ".join(f"{name} {metadata.version(name)}" for name in PACKAGES)
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    told = [
        "# Proof",
        "Written by `make proof`; do not edit.",
        f"{today}; {models[0] if models else platform.machine()}, {os.cpu_count()} cores, {platform.system()}; "
        f"Python {platform.python_version()}, {packages}.",
    ]
    if runs:
        rows = [[f"`{run['command']}`", "passed" if run["code"] == 0 else "FAILED", run["seconds"]] for run in runs]
        told.append(markdown_table(["command", "outcome", "seconds"], rows))
    return "\n\n".join(told)


def assemble(folder: Path, runs: Sequence[dict[str, Any]]) -> str:
    """The page from the JSON files in a folder."""
    sections = []
    for file in sorted(folder.glob("*.json")):
        document = json.loads(file.read_text(encoding="utf-8"))
        sections.append(section(benchmarks_as_section(document) if file.name == "benchmarks.json" else document))
    return "\n\n".join([heading(runs), *sections]) + "\n"


BEGIN, END = "<!-- siege -->", "<!-- end of siege -->"
BY_ITSELF = "Run by itself on "


def siege_of(page: str) -> str:
    """What `make siege` wrote into a page; "" where it did not."""
    return page.partition(BEGIN)[2].partition(END)[0].strip() if END in page else ""


def with_siege(page: str, siege: str) -> str:
    """A page with another part of `make siege`, at its end."""
    head, _, rest = page.partition(BEGIN)
    kept = f"{head.rstrip()}\n\n{rest.partition(END)[2].strip()}".strip()
    return f"{kept}\n\n{BEGIN}\n\n{siege}\n\n{END}\n" if siege else f"{kept}\n"


def kept_from(page: str, fresh: str) -> str:
    """A fresh page with the sections of an earlier one that ran by themselves and that it lacks, at its end."""
    earlier = [part.strip() for part in page.partition(BEGIN)[0].split("\n## ")[1:]]
    titles = {line for line in fresh.splitlines() if line.startswith("## ")}
    kept = [f"## {part}" for part in earlier if BY_ITSELF in part and f"## {part.splitlines()[0]}" not in titles]
    return "\n\n".join([fresh.rstrip(), *kept]) + "\n"


def put(page: str, document: dict[str, Any], today: str) -> str:
    """A page with one section anew, in its place or before those of the siege."""
    fresh = section({**document, "text": f"{BY_ITSELF}{today}. {document.get('text', '')}"})
    head, begin, siege = page.partition(BEGIN)
    before, title, rest = head.partition(f"## {document['title']}\n")
    _, following, after = rest.partition("\n## ") if title else ("", "", "")
    parts = [before.strip(), fresh, f"## {after.strip()}" if following else "", begin + siege.rstrip()]
    return "\n\n".join(part for part in parts if part) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description="Run every proof and write docs/proof.md.")
    parser.add_argument("--assemble-only", action="store_true", help="write the page from build/proof as it is")
    parser.add_argument("--put", nargs="+", type=Path, metavar="FILE", help="put the sections of these files anew")
    options = parser.parse_args()
    if options.put:
        page, today = PAGE.read_text(encoding="utf-8"), datetime.datetime.now(tz=datetime.UTC).date().isoformat()
        for file in options.put:
            document = json.loads(file.read_text(encoding="utf-8"))
            page = put(page, benchmarks_as_section(document) if "results" in document else document, today)
        PAGE.write_text(page, encoding="utf-8")
        return 0
    runs = []
    if not options.assemble_only:
        FOLDER.mkdir(parents=True, exist_ok=True)
        for old in FOLDER.glob("*.json"):
            old.unlink()
        runs.append(ran(["-m", "benchmarks.run", "--out", str((FOLDER / "benchmarks.json").relative_to(ROOT))]))
        runs.append(ran(["-m", "pytest", "-m", "proof", "-q", "-n", "2", "--dist", "loadfile"]))
    PAGE.parent.mkdir(exist_ok=True)
    old = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    PAGE.write_text(with_siege(kept_from(old, assemble(FOLDER, runs)), siege_of(old)), encoding="utf-8")
    print(f"Written: {PAGE.relative_to(ROOT)}")
    return 1 if any(run["code"] for run in runs) else 0


if __name__ == "__main__":
    sys.exit(main())
