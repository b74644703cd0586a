"""Fuzzing of every container, guided by outcomes and by the lines of Python that run: `fuzzed` is the loop."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from .found import ROOT, Found, progress

FUZZED = (sys.executable, "-m", "tests.siege.fuzzed")
PLACES = (str(ROOT / "tests"), str(ROOT), os.environ.get("PYTHONPATH", ""))
SLICE = 240.0
"""s for a container at a time: then it is another process, which takes up the inputs that were kept."""


def _named(name: str) -> str:
    """A container's name as that of a file."""
    return name.replace("/", "-")


class Fuzz:
    """The campaign: the container that had the least time is next, until each has its inputs.

    Args:
        names: of the containers.
        inputs: for each of them.
        seconds: after which no more is begun.
        folder: where kept inputs, those that fell and the counts lie; a folder with counts is gone on with, and what
            fell is tried again.
        workers: processes at a time.
        seed: other inputs.
    """

    def __init__(
        self, names: Sequence[str], *, inputs: int, seconds: float, folder: Path, workers: int = 2, seed: int = 0
    ) -> None:
        self.names, self.inputs, self.folder, self.workers, self.seed = names, inputs, folder, workers, seed
        self.until = time.monotonic() + seconds
        self.counts = {name: Counter[str]() for name in names}
        self.spent = dict.fromkeys(names, 0.0)
        self.bad: list[str] = []
        self.contained = Counter[str]()
        self._busy, self._lock = set[str](), threading.Lock()
        self._kept = folder / "counts.json"
        folder.mkdir(parents=True, exist_ok=True)
        if self._kept.exists():
            before = json.loads(self._kept.read_text(encoding="utf-8"))
            self.contained = Counter(before["contained"])
            for name in before["counts"].keys() & self.counts.keys():
                self.counts[name].update(before["counts"][name] | {"fell": 0})
                self.spent[name] = before["spent"][name]
        self._again = {name: fell for name in names if (fell := sorted((folder / "fell").glob(f"{_named(name)} *")))}

    def run(self) -> Found:
        threads = [threading.Thread(target=self._work) for _ in range(self.workers)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return self.found()

    def _next(self) -> str | None:
        with self._lock:
            open_ = [n for n in self.names if n not in self._busy and self.counts[n]["inputs"] < self.inputs]
            again = [name for name in self._again if name not in self._busy]
            if not again and (not open_ or time.monotonic() > self.until):
                return None
            name = min(again or open_, key=self.spent.__getitem__)
            self._busy.add(name)
            return name

    def _work(self) -> None:
        while (name := self._next()) is not None:
            begun = time.monotonic()
            seconds = max(min(SLICE, self.until - begun), 1.0)
            kept, again = self.folder / "kept" / _named(name), self._again.pop(name, [])
            kept.mkdir(parents=True, exist_ok=True)
            left = self.inputs - self.counts[name]["inputs"]
            seed = f"{self.seed * 1_000_000_007 + self.counts[name]['inputs']}"
            ended = subprocess.run(
                [*FUZZED, name, seed, str(left), f"{seconds:g}", str(kept), *map(str, again)],
                cwd=ROOT,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(PLACES), "PYTHONHASHSEED": "0"},
                capture_output=True,
                timeout=3600.0,
                check=False,
            )
            for file in again:
                file.unlink()
            with self._lock:
                self._busy.discard(name)
                self.spent[name] += time.monotonic() - begun
                self._take(name, ended)

    def _take(self, name: str, ended: subprocess.CompletedProcess[bytes]) -> None:
        told = [json.loads(line) for line in ended.stdout.splitlines()]
        for one in (one for one in told if "words" in one):
            content = bytes.fromhex(one["input"])
            if one["words"].startswith("contained: "):
                self.contained[f"{name}: {one['words'].partition(': ')[2]}"] += 1
                continue
            fell = self.folder / "fell" / f"{_named(name)} {hashlib.sha256(content).hexdigest()[:16]}"
            fell.parent.mkdir(exist_ok=True)
            fell.write_bytes(content)
            self.bad.append(f"{name} ({fell.name.rpartition(' ')[2]}): {one['words']}")
            print(self.bad[-1], flush=True)
        if ended.returncode or not told or "inputs" not in told[-1]:
            self.bad.append(f"{name}: the loop ended with {ended.returncode}: {ended.stderr.decode()[-500:]}")
            print(self.bad[-1], flush=True)
            self.spent[name] += 60.0
        else:
            self.counts[name].update(told[-1])
        now = {"counts": self.counts, "spent": self.spent, "bad": self.bad, "contained": self.contained}
        made = self._kept.with_suffix(".new")
        made.write_text(json.dumps(now), encoding="utf-8")
        made.replace(self._kept)
        progress(f"{sum(c['inputs'] for c in self.counts.values()):,} inputs, {len(self.bad)} bad")

    def found(self) -> Found:
        """The table of what was done so far."""
        kinds = ("inputs", "read", "refused", "contained", "kept", "whole", "whole read", "whole refused", "fell")
        rows = [[name, *(counts[kind] for kind in kinds)] for name, counts in self.counts.items()]
        total, spent = sum(row[1] for row in rows), sum(self.spent.values())
        ended = "; ".join(f"{words}, {n:,} times" for words, n in sorted(self.contained.items())) or "none"
        return Found(
            title="Siege: containers, fuzzed",
            text=f"{total:,} inputs to the parsers of {len(rows)} containers in {spent / 60:.0f} minutes of a process; "
            f"{self.inputs:,} were wanted for each. An input is a small file, or one that had a new outcome, changed: "
            "bytes cut, doubled, exchanged, overwritten; records left out, doubled and exchanged with all lengths and "
            "checksums right; SQLite's tables by SQLite; packed variables packed again. An outcome is new by the "
            "places that an error went through, by what was read, and at each 16th input by the lines of Python "
            "that ran. Compiled code is not instrumented: for HDF5, SQLite and Arrow this is guided by outcomes alone. "
            "Each input with a new outcome and each 256th goes through the whole reader, too. Contained: another's "
            f"library ended its process or took more than 10 s, and the whole reader said so in words ({ended}). Fell: "
            "an end that is neither a result nor an error of swashplate's, more than 10 s of the processor, or more "
            "than 512 MB of memory.",
            columns=[
                *("container", "inputs", "read", "refused", "contained", "kept for a new outcome"),
                *("whole reader", "read", "refused", "fell"),
            ],
            rows=[*rows, ["all", *(sum(row[k] for row in rows) for k in range(1, 10))]],
            bad=self.bad,
        )
