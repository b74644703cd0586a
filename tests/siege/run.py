"""Besieges the program and writes what came out into docs/proof.md, between its two marks: `make siege` (an hour).

    python -m tests.siege.run [--minutes M] [--only NAME] [--files N] [--kills N] [--packets N] ...

Campaigns: `files` (damaged logs and documents), `kills` (hard kills, and disks that break), `disks` (a small disk that
is full or read-only, mounted for it), `places` (paths that are no file), `packets` (everything that listens), `pages`
(hostile pages), `fuzz` (containers), `neighbours` (other users of the machine), `small` (machines with little of
everything), `options` (odd values of every option). Each ends at its number or at its share of the minutes, whichever
is first, and the page says what was reached. Exit code 1 where anything fell. `make proof` leaves the section as it is.

What is found on top of these (a soak of links, say) is a JSON file build/siege/NAME.json in the form of
`tests/proof.py`; all that are there are written.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from tests import proof

ROOT = proof.ROOT
FOLDER = ROOT / "build" / "siege"
_SHARES = {"files": 0.35, "fuzz": 0.15, "kills": 0.3, "disks": 0.05, "places": 0.04, "packets": 0.04, "pages": 0.02}
SHARES = _SHARES | {"neighbours": 0.01, "small": 0.1, "options": 0.03}
"""Of the minutes; disks, places, pages and neighbours take what they take."""
_LEAST = 120.0
"""s that small machines have at least: what a command needs on one is not much less."""


def campaigns(chosen: argparse.Namespace) -> dict[str, Callable[[float], list[dict[str, object]]]]:
    """What runs, by name, from its seconds to sections of the page."""
    sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
    from tests.siege import disks, files, fuzz, kills, neighbours, odd_options, packets, pages, places, small
    from tests.siege.containers import CONTAINERS
    from tests.siege.targets import TARGETS

    def besiege_files(seconds: float) -> list[dict[str, object]]:
        siege = files.Files(
            list(TARGETS),
            files=chosen.files,
            seconds=seconds,
            workers=chosen.workers,
            seed=chosen.seed,
            kept=FOLDER / "files.kept",
        )
        return [siege.run().to_document()]

    def besiege_containers(seconds: float) -> list[dict[str, object]]:
        if not chosen.resume:
            (FOLDER / "fuzz" / "counts.json").unlink(missing_ok=True)
        workers, seed = chosen.workers, chosen.seed
        siege = fuzz.Fuzz(
            list(CONTAINERS),
            inputs=chosen.inputs,
            seconds=seconds,
            folder=FOLDER / "fuzz",
            workers=workers,
            seed=seed,
        )
        return [siege.run().to_document()]

    def besiege_writers(seconds: float) -> list[dict[str, object]]:
        every = {**kills.QUICK, **kills.SLOW}
        counts = {"kills": chosen.kills, "failures": chosen.failures}
        results = kills.besiege(every, **counts, seconds=seconds, seed=chosen.seed, kept=FOLDER / "kills.kept")
        for one in (one for one in results if not one.rows[-1][2]):
            print(f"No time was left to strike ({one.title}): its section stays as it is.", file=sys.stderr)
        return [one.to_document() for one in results if one.rows[-1][2]]

    def besiege_disks(seconds: float) -> list[dict[str, object]]:
        outcome = disks.besiege()
        if outcome is None:
            print("Not allowed to mount a disk here: the section of `disks` is left out.", file=sys.stderr)
        return [] if outcome is None else [outcome]

    def besiege_places(seconds: float) -> list[dict[str, object]]:
        return [places.besiege().to_document()]

    def besiege_links(seconds: float) -> list[dict[str, object]]:
        return [packets.besiege(packets=chosen.packets, seconds=seconds, seed=chosen.seed).to_document()]

    def besiege_pages(seconds: float) -> list[dict[str, object]]:
        return [pages.besiege(half_open=chosen.half_open).to_document()]

    def besiege_neighbours(seconds: float) -> list[dict[str, object]]:
        return [neighbours.besiege().to_document()]

    def besiege_small(seconds: float) -> list[dict[str, object]]:
        return [small.besiege(seconds=max(seconds, _LEAST)).to_document()]

    def besiege_options(seconds: float) -> list[dict[str, object]]:
        return [odd_options.besiege(count=chosen.options, seconds=seconds, seed=chosen.seed).to_document()]

    return {
        "files": besiege_files,
        "fuzz": besiege_containers,
        "kills": besiege_writers,
        "disks": besiege_disks,
        "places": besiege_places,
        "packets": besiege_links,
        "pages": besiege_pages,
        "neighbours": besiege_neighbours,
        "small": besiege_small,
        "options": besiege_options,
    }


def stamp(*, resumed: bool) -> str:
    """When and on what code a campaign begins, for its text on the page."""
    words = ("git", "describe", "--always", "--abbrev=10", "--dirty= with changes that are not committed")
    told = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    version = proof.metadata.version("swashplate")
    code = f"commit {told.stdout.strip()}" if told.returncode == 0 else f"version {version}"
    now = datetime.datetime.now(tz=datetime.UTC)
    return f"{'Gone on with' if resumed else 'Begun'} on {now:%Y-%m-%d} at {now:%H:%M} UTC, {code}."


def siege_section(folder: Path, page: str) -> str:
    """All that was found, as one part of the page; campaigns that have not run here stay as the page has them."""
    parts = [
        f"# Siege\n\nWritten by `make siege`; do not edit. {platform.machine()}, {os.cpu_count()} cores. Each campaign "
        "says when and on what code it ran. Other programs on the machine make the numbers smaller, and nothing else."
    ]
    found = [json.loads(file.read_text(encoding="utf-8")) for file in sorted(folder.glob("*.json"))]
    titles = {document["title"] for document in found}
    before = page.partition(proof.BEGIN)[2].partition(proof.END)[0].split("\n## ")[1:]
    parts += [f"## {part.strip()}" for part in before if part.splitlines()[0] not in titles]
    parts += map(proof.section, found)
    return "\n\n".join(parts)


def main() -> int:
    parser = argparse.ArgumentParser(description="Besiege the program and write what came out into docs/proof.md.")
    parser.add_argument("--files", type=int, default=1_000_000, help="damaged files and documents")
    parser.add_argument("--inputs", type=int, default=1_000_000, help="fuzzed inputs for each container")
    parser.add_argument("--options", type=int, default=100_000, help="odd values of options, all there are at most")
    parser.add_argument("--kills", type=int, default=1_000, help="hard kills of commands that write")
    parser.add_argument("--failures", type=int, default=500, help="runs on full and broken disks")
    parser.add_argument("--packets", type=int, default=1_000_000, help="mutated packets for each link")
    parser.add_argument("--half-open", type=int, default=1_000, help="connections that never ask")
    parser.add_argument("--minutes", type=float, default=60.0, help="for all of it")
    parser.add_argument("--workers", type=int, default=2, help="processes that read files")
    parser.add_argument("--seed", type=int, default=0, help="other mutants, other kills")
    parser.add_argument("--resume", action="store_true", help="go on with the counts of a stopped run")
    parser.add_argument("--only", action="append", choices=list(SHARES), help="this campaign; may be repeated")
    parser.add_argument("--assemble-only", action="store_true", help="write the page from build/siege as it is")
    chosen = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in (chosen.only or SHARES) if not chosen.resume else ():
        (FOLDER / f"{name}.kept").unlink(missing_ok=True)
    fell = False
    for name, run in campaigns(chosen).items() if not chosen.assemble_only else ():
        if chosen.only and name not in chosen.only:
            continue
        for old in FOLDER.glob(f"{name}-*.json"):
            old.unlink()
        share = SHARES[name] / sum(SHARES[n] for n in (chosen.only or SHARES))
        began = stamp(resumed=chosen.resume)
        for k, outcome in enumerate(run(60.0 * chosen.minutes * share)):
            outcome["text"] = f"{outcome['text']} {began}"
            (FOLDER / f"{name}-{k}.json").write_text(json.dumps(outcome), encoding="utf-8")
            fell = fell or not outcome["passed"]
            print(proof.section(outcome), flush=True)
    page = proof.PAGE.read_text(encoding="utf-8") if proof.PAGE.exists() else ""
    proof.PAGE.write_text(proof.with_siege(page, siege_section(FOLDER, page)), encoding="utf-8")
    print(f"Written: {proof.PAGE.relative_to(ROOT)}")
    return 1 if fell else 0


if __name__ == "__main__":
    sys.exit(main())
