"""Damaged files and documents, read in processes of their own: refused in words or read, and nothing else."""

from __future__ import annotations

import json
import os
import random
import selectors
import subprocess
import sys
import time
from collections import Counter, defaultdict
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .found import ROOT, Found, progress

SLOWEST = 10.0
"""s of the processor that one file may take."""
_START = 120.0
"""s that a worker may take for its first file of a kind: it imports, and makes the whole files."""
_LOT = 4.0
"""s of work that is handed out at once."""
_DONE = (
    "Bytes are cut, doubled, exchanged, overwritten by odd numbers; documents have entries left out, renamed, of "
    "another type, huge, not finite, nested; HDF5 and MATLAB files are written whole with odd shapes and numbers."
)
_MOST = 0.15
"""Part of all files that one kind may have: lines of text are read a thousand times quicker than logs."""


@dataclass
class _Lot:
    name: str
    first: int
    count: int
    begun: float


@dataclass
class _Worker:
    """A process, and what it is at."""

    process: subprocess.Popen[bytes]
    lot: _Lot | None = None
    at: int | None = None
    since: float = 0.0
    used: float = 0.0
    buffer: bytes = b""
    known: set[str] = field(default_factory=set)


WORKER = (sys.executable, "-m", "tests.siege.worker")


def _started() -> _Worker:
    places = [str(ROOT / "tests"), str(ROOT), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(places)}
    process = subprocess.Popen(
        WORKER,
        cwd=ROOT,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdout is not None
    os.set_blocking(process.stdout.fileno(), False)
    return _Worker(process)


def _ended(worker: _Worker) -> int:
    """Waits for a process that has nothing more to read; returns its exit code."""
    with suppress(BrokenPipeError):
        worker.process.stdin.close()  # type: ignore[union-attr]
    code = worker.process.wait()
    worker.process.stdout.close()  # type: ignore[union-attr]
    return code


def _processor_time(process: int) -> float:
    """s that a process has used; 0 where it is gone."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Files:
    """The campaign: a kind of file gets the more time the quicker it is read, as one over the root of a file's time.

    Args:
        names: of the targets.
        files: how many in all.
        seconds: after which no more is begun.
        workers: processes at a time.
        seed: of the first file of each kind.
        kept: where the counts are kept, so that a stopped campaign goes on; what fell is tried again then. None: no.
    """

    def __init__(
        self,
        names: list[str],
        *,
        files: int,
        seconds: float,
        workers: int = 2,
        seed: int = 0,
        kept: Path | None = None,
    ) -> None:
        self._names, self._files, self._workers, self._kept = names, files, workers, kept
        self._until = time.monotonic() + seconds
        self._next = dict.fromkeys(names, seed)
        self._spent = dict.fromkeys(names, 0.0)
        self._cost = dict.fromkeys(names, 0.2)
        self.counts: dict[str, Counter[str]] = defaultdict(Counter)
        self.bad: list[str] = []
        self.fell: list[tuple[str, int, str]] = []
        self.warned = Counter[str]()
        self._given = 0
        self._begun = time.monotonic()
        self._again: list[tuple[str, int]] = []
        if kept is not None and kept.exists():
            self._go_on(json.loads(kept.read_text(encoding="utf-8")))

    def _go_on(self, before: dict[str, Any]) -> None:
        """Takes up the counts of a stopped campaign; what fell then counts as it does now."""
        for name, counts in before["counts"].items():
            self.counts[name].update(counts)
        self._next |= {name: seed for name, seed in before["next"].items() if name in self._next}
        self._spent |= {name: spent for name, spent in before["spent"].items() if name in self._spent}
        self._begun -= before["seconds"]
        self._cost |= {name: cost for name, cost in before["cost"].items() if name in self._cost}
        for name, seed, kind in before["fell"]:
            self._again.append((name, seed))
            self.counts[name][kind] -= 1
        self._given = sum(counts.total() for counts in self.counts.values())

    def _keep_counts(self) -> None:
        if self._kept is None:
            return
        fell = self.fell + [(name, seed, "other") for name, seed in self._again]
        again = Counter(name for name, _ in self._again)
        counts = {name: {**c, "other": c["other"] + again[name]} for name, c in self.counts.items()}
        now: dict[str, Any] = {"counts": counts, "fell": fell, "spent": self._spent, "cost": self._cost}
        now |= {"next": self._next, "seconds": time.monotonic() - self._begun}
        made = self._kept.with_suffix(".new")
        made.write_text(json.dumps(now), encoding="utf-8")
        made.replace(self._kept)

    def run(self) -> Found:
        selector = selectors.DefaultSelector()
        workers = [_started() for _ in range(self._workers)]
        for worker in workers:
            selector.register(worker.process.stdout, selectors.EVENT_READ, worker)  # type: ignore[arg-type]
            self._hand_out(worker)
        while any(worker.lot for worker in workers):
            for key, _ in selector.select(0.5):
                self._hear(key.data)
            for k, worker in enumerate(workers):
                if worker.lot is None:
                    continue
                late = self._late(worker)
                if late or worker.process.poll() is not None:
                    selector.unregister(worker.process.stdout)  # type: ignore[arg-type]
                    workers[k] = self._replaced(worker, late=late)
                    selector.register(workers[k].process.stdout, selectors.EVENT_READ, workers[k])  # type: ignore[arg-type]
            if progress(f"{sum(c.total() for c in self.counts.values()):,} files, {len(self.bad)} bad"):
                self._keep_counts()
        for worker in workers:
            _ended(worker)
        self._keep_counts()
        return self._found(time.monotonic() - self._begun)

    def _late(self, worker: _Worker) -> bool:
        """Whether a file takes too long: of processor time, as the machine may be busy, or thirty times as long."""
        assert worker.lot is not None
        if worker.at is None or worker.lot.name not in worker.known:
            return time.monotonic() - worker.since > _START
        used = _processor_time(worker.process.pid) - worker.used
        return used > SLOWEST or time.monotonic() - worker.since > 30.0 * SLOWEST

    def _hand_out(self, worker: _Worker) -> None:
        if self._again:
            name, seed = self._again.pop()
            worker.lot = _Lot(name, seed, 1, time.monotonic())
            worker.at, worker.since = None, time.monotonic()
            self._say(worker)
            return
        if self._given >= self._files or time.monotonic() > self._until:
            worker.lot = None
            return
        few = [n for n in self._names if self.counts[n].total() < max(1.0, _MOST * self._files)] or self._names
        name = min(few, key=lambda n: self._spent[n] * self._cost[n] ** 0.5)
        count = max(1, min(int(_LOT / self._cost[name]), self._files - self._given, 2000))
        worker.lot = _Lot(name, self._next[name], count, time.monotonic())
        self._next[name] += count
        self._given += count
        self._spent[name] += count * self._cost[name]
        worker.at, worker.since = None, time.monotonic()
        self._say(worker)

    def _say(self, worker: _Worker) -> None:
        lot = worker.lot
        assert lot is not None
        with_line = f"{lot.name}\t{lot.first}\t{lot.count}\n".encode()
        worker.process.stdin.write(with_line)  # type: ignore[union-attr]
        worker.process.stdin.flush()  # type: ignore[union-attr]

    def _hear(self, worker: _Worker) -> None:
        data = worker.process.stdout.read()  # type: ignore[union-attr]
        if not data or worker.lot is None:
            return
        *lines, worker.buffer = (worker.buffer + data).split(b"\n")
        for line in lines:
            kind, _, rest = line.decode().partition(" ")
            worker.since = time.monotonic()
            if kind == "?":
                worker.at, worker.used = int(rest), _processor_time(worker.process.pid)
            elif kind == ".":
                lot = worker.lot
                cost = (time.monotonic() - lot.begun) / lot.count
                if lot.name in worker.known:
                    self._cost[lot.name] = max(1e-4, 0.2 * self._cost[lot.name] + 0.8 * cost)
                worker.known.add(lot.name)
                self._hand_out(worker)
            else:
                name = worker.lot.name
                worker.known.add(name)
                self.counts[name][{"a": "accepted", "w": "warned", "r": "refused"}.get(kind, "other")] += 1
                if kind == "x":
                    self._keep(name, rest, "other")
                elif kind == "w":
                    self.warned[rest.partition(" ")[2]] += 1

    def _keep(self, name: str, words: str, kind: str) -> None:
        self.fell.append((name, int(words.split()[0]), kind))
        self.bad.append(f"{name}, seed {words}")
        print(self.bad[-1], flush=True)

    def _replaced(self, worker: _Worker, *, late: bool) -> _Worker:
        """Another worker for one that hangs or is dead; it goes on behind the file that did it."""
        self._hear(worker)
        worker.process.kill()
        code = _ended(worker)
        lot = worker.lot
        fresh = _started()
        if lot is None:
            return fresh
        at = worker.at if worker.at is not None else lot.first
        kind = f"took more than {SLOWEST:g} s" if late else f"ended the process with {code}"
        end = "hang" if late else "crash"
        self.counts[lot.name][end] += 1
        self._keep(lot.name, f"{at} {kind}", end)
        left = lot.first + lot.count - at - 1
        if left > 0:
            fresh.lot = _Lot(lot.name, at + 1, left, time.monotonic())
            fresh.since = time.monotonic()
            self._say(fresh)
        else:
            self._hand_out(fresh)
        return fresh

    def _found(self, seconds: float) -> Found:
        columns = ["what", "damaged files", "read", "read, a library warned", "refused in words", "other ends"]
        kinds = ("accepted", "warned", "refused", "other", "hang", "crash")
        rows = [[n, self.counts[n].total(), *(self.counts[n][kind] for kind in kinds)] for n in self._names]
        total = sum(row[1] for row in rows)
        return Found(
            title="Siege: damaged files and documents",
            text=f"{total:,} files in {seconds / 60:.1f} minutes ({total / max(seconds, 1e-9):.0f} a second). "
            f"{_DONE} Each is read in a process that is watched from outside, with 4 GB of memory. Other "
            "ends: what is no flight, no object and no error of swashplate's of at most 2,000 characters.",
            columns=[*columns, "hangs above 10 s", "dead processes"],
            rows=[*rows, ["all", *(sum(row[k] for row in rows) for k in range(1, 8))]],
            bad=self.bad,
        )


def mutant(name: str, seed: int, path: Path) -> Path:
    """Writes the damaged file of a seed, to look at it."""
    from .targets import TARGETS

    target = TARGETS[name]()
    place = path.with_suffix(target.suffix) if target.suffix else path
    place.write_bytes(target.mutant(random.Random(f"{name} {seed}")))
    return place
