"""Hard kills and full disks at every place of the commands that write: old results or new ones, nothing between."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.flights.tabular import write_csv

from .found import ROOT, Found, progress

COUNT, KILL, HALF, FAIL = range(4)
ERRORS = {
    "disk full": errno.ENOSPC,
    "quota": errno.EDQUOT,
    "read-only": errno.EROFS,
    "no permission": errno.EACCES,
    "broken disk": errno.EIO,
}
_SECONDS = 120.0
_MARK = ".swash-"
_WHEN = re.compile(rb"20\d\d-\d\d-\d\d[ T]\d\d:\d\d(:\d\d)?")
"""When a page was made, which it says."""


@dataclass(frozen=True)
class Command:
    """A command that writes; `old` and `new` are arguments with other results, with INPUTS and OUT as places."""

    old: Sequence[str]
    new: Sequence[str]

    def asked(self, words: Sequence[str], *, inputs: Path, out: Path) -> list[str]:
        return [word.replace("INPUTS", str(inputs)).replace("OUT", str(out)) for word in words]


def _two(words: str, old: str, new: str) -> Command:
    """A command with a word that differs, "*"; "#" is a star."""
    return Command(*(words.replace("*", word).replace("#", "*").split() for word in (old, new)))


QUICK: Mapping[str, Command] = {
    "maneuver": _two("maneuver sweep:pitch,0.5-4Hz,*s --out OUT/series.csv", "30", "34"),
    "plot to SVG": _two("inspect INPUTS/log.csv --channels * --out OUT/plot.svg", "p", "phi"),
    "plot to HTML": _two("inspect INPUTS/log.csv --channels * --out OUT/plot.html", "p", "phi"),
    "respond": _two("respond INPUTS/log.csv --inputs servo_roll --outputs p --band *Hz --out OUT/found", "1-6", "1-8"),
    "fit-tf": _two("identify --responses INPUTS/responses.nc --input servo_roll --form * --out OUT/fit", "0/1", "1/2"),
    "compare": _two("compare INPUTS/responses.nc INPUTS/*.nc --out OUT/page.html", "responses", "narrow"),
}
"""That start quickly."""
SLOW: Mapping[str, Command] = {
    "bench simulate": _two("bench simulate OUT/bench --only * --seed 1", "thrust", "bar_linkage"),
    "simulate": _two("simulate --vehicle coax --maneuver doublet:roll,0.5s,* --out OUT/flight.nc", "0.1", "0.2"),
    "simulate, CSV": _two("simulate --vehicle coax --maneuver doublet:roll,0.5s,* --out OUT/a.csv", "0.1", "0.2"),
    "linearize": _two("vehicle linearize raptor50 --speed * --out OUT/models", "0-5/5", "0-8/4"),
    "export, C": _two("export * --format c --out OUT/code", "coax", "raptor50"),
    "export, MATLAB": _two("export raptor50 --format matlab --speed * --out OUT/made", "2", "4"),
    "export, FMU": _two("export * --format fmu --out OUT/made", "coax", "raptor50"),
    "track": _two("track INPUTS/log.csv --equation p_dot=Lp#p+bias --out OUT/track --settings rate=*", "40", "50"),
    "identify": _two(
        "identify --vehicle coax --flight INPUTS/flight.nc --free flight --method output-error --rate 20 --out OUT/fit "
        "--settings iterations=*",
        "1",
        "2",
    ),
    "stitch": _two("vehicle stitch INPUTS/at0.toml INPUTS/at5.toml --out OUT/model.toml --settings title=*", "a", "b"),
}


def _inputs(folder: Path) -> None:
    """What the commands read."""
    t = np.arange(0.0, 40.0, 0.02)
    noise = np.random.default_rng(0).standard_normal((3, t.size))
    moved = 0.1 * noise[2]  # nothing before explains it: it is no controller's answer
    p = np.convolve(moved, 5.0 * np.exp(-5.0 * np.arange(0, 2, 0.02)) * 0.02)[: t.size]
    measured = {"p": p + 0.002 * noise[0], "phi": np.cumsum(p) * 0.02 + 0.001 * noise[1], "servo_roll": moved}
    flight = Flight({"log": stream(t, measured)}, Provenance(source="a test", reader="tests", reader_version="1"))
    write_csv(flight, folder / "log.csv")


class Siege:
    """A loaded program that forks for every command."""

    def __init__(self, folder: Path, *, loaded: Sequence[str] = ()) -> None:
        shim = folder / "injected.so"
        source = Path(__file__).with_name("injected.c")
        subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-o", str(shim), str(source), "-ldl"], check=True)
        self.temporary = folder / "cases" / "tmp"
        self.temporary.mkdir(parents=True)
        self.folder = folder
        places = [str(ROOT / "tests"), str(ROOT), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "LD_PRELOAD": str(shim), "PYTHONPATH": os.pathsep.join(places)}
        environment |= {"TMPDIR": str(self.temporary), "NO_COLOR": "1"}
        environment["JE_ARROW_MALLOC_CONF"] = "background_thread:false"  # pandas loads pyarrow; no fork has its thread
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.siege.zygote", *loaded],
            cwd=ROOT,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def run(
        self,
        arguments: list[str],
        *,
        mode: int = COUNT,
        stop: int = 0,
        error: int = 0,
        stopped: bool = False,
        unprivileged: bool = False,
        seconds: float = _SECONDS,
    ) -> tuple[dict[str, Any], str]:
        """How a command ended, and what it said; `stopped`: from where it first wants to write, in a fork.
        `unprivileged`: without the superuser's rights. `seconds`: of processor time, after which it is ended."""
        log = self.folder / "said.txt"
        asked = {"arguments": arguments, "folder": str(self.folder / "cases"), "mode": mode, "stop": stop}
        asked |= {"error": error, "log": str(log), "seconds": seconds, "cwd": str(self.folder)}
        asked |= {"stopped": stopped, "unprivileged": unprivileged}
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline()), log.read_text(errors="replace")

    def close(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()


Files = dict[str, bytes]


def _files(folder: Path) -> Files:
    """What a user sees in a folder, by path."""
    seen = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    names = {path.relative_to(folder).as_posix(): path for path in seen}
    return {name: _WHEN.sub(b"then", path.read_bytes()) for name, path in names.items() if _MARK not in name}


def _litter(*folders: Path) -> list[str]:
    found = [path for folder in folders for path in folder.rglob("*")]
    return [path.name for path in found if _MARK in path.name or path.parent == folders[-1]]


def _put(files: Files, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


class Case:
    """One command: what it leaves when it runs well over old results, and what it leaves when it does not."""

    def __init__(self, siege: Siege, name: str, command: Command, inputs: Path) -> None:
        self._siege, self.name = siege, name
        self.out = siege.folder / "cases" / "area" / "OUT"
        _put({"mine.txt": b"mine"}, self.out)
        self.asked = command.asked(command.new, inputs=inputs, out=self.out)
        self._well(command.asked(command.old, inputs=inputs, out=self.out))
        self.old = _files(self.out)
        told = self._well(self.asked)
        self.new, self.calls = _files(self.out), told["calls"]
        self._well(self.asked)
        again = _files(self.out)
        # Reports say how many seconds a fit took: two runs may agree by chance.
        self.varies = {name for name in self.new if again.get(name) != self.new[name] or name.endswith(".html")}
        # What a command computes is the same whatever is struck: where it can, it is computed once.
        self.stopped = self._can_stop()
        assert self.old != self.new, name

    def _can_stop(self) -> bool:
        _put(self.old, self.out)
        told, _ = self._siege.run(self.asked, stopped=True)
        if told["code"] != 0 or _files(self.out).keys() != self.new.keys() or told["calls"] < 1:
            return False
        self.calls = told["calls"]
        return True

    def _well(self, arguments: list[str]) -> dict[str, Any]:
        told, said = self._siege.run(arguments)
        if told["code"] != 0:
            raise RuntimeError(f"{self.name}: ended with {told['code']}: {said[-500:]}")
        return told

    def struck(self, *, mode: int, stop: int, error: int = 0) -> list[str]:
        """What is wrong after a kill or a failing call, and after the next run."""
        _put(self.old, self.out)
        told, said = self._siege.run(self.asked, mode=mode, stop=stop, error=error, stopped=self.stopped)
        killed = told["code"] == -signal.SIGKILL
        wrong = []
        if told["hang"]:
            wrong.append("hangs")
        elif mode == FAIL and told["code"] not in (0, 2):
            wrong.append(f"ends with {told['code']}: {said.strip()[-200:]!r}")
        elif mode == FAIL and told["code"] == 2 and ("Error: " not in said or "Traceback" in said or "bug" in said):
            wrong.append(f"says {said.strip()[-200:]!r}")
        elif mode != FAIL and not killed and told["code"] != 0:
            wrong.append(f"ends with {told['code']}: {said.strip()[-200:]!r}")
        wrong += self.judged(_files(self.out), complete=told["code"] == 0)
        waits = "All of it is written and waits in .swash-" in " ".join(said.split())
        if mode == FAIL and told["code"] == 2 and error not in (errno.EROFS, errno.EACCES, errno.EIO) and not waits:
            wrong += [f"leaves {name}" for name in _litter(self.out, self._siege.temporary)]
        after, said = self._siege.run(self.asked, stopped=self.stopped)
        if after["code"] != 0:
            wrong.append(f"the next run ends with {after['code']}: {said.strip()[-200:]!r}")
        elif problems := self.judged(_files(self.out), complete=True):
            wrong += [f"after the next run: {problem}" for problem in problems]
        wrong += [f"after the next run {name} is left" for name in _litter(self.out, self._siege.temporary)]
        self._emptied()
        said_so = [f"{self.name}, call {stop} of {self.calls}: {words}" for words in wrong]
        for words in said_so:
            print(words, file=sys.stderr, flush=True)
        return said_so

    def _emptied(self) -> None:
        for path in self._siege.temporary.iterdir():
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink()

    def judged(self, found: Files, *, complete: bool) -> list[str]:
        """What of the files is neither the old result nor the new one."""
        wrong, sides = [], set()
        if found.pop("mine.txt", None) != b"mine":
            wrong.append("the user's own file is gone")
        for name, content in found.items():
            is_old, is_new = content == self.old.get(name), content == self.new.get(name)
            if name in self.varies and not is_old:
                is_new = abs(len(content) - len(self.new[name])) <= 0.02 * len(self.new[name])
            if not is_old and not is_new:
                wrong.append(f"{name} is half-written ({len(content)} bytes)")
            elif is_old != is_new:
                sides.add(is_new)
        if len(sides) > 1:
            wrong.append(f"old and new lie side by side: {sorted(found)}")
        wanted = set(self.new) - {"mine.txt"}
        if complete and (set(found) != wanted or sides - {True}):
            wrong.append(f"is said to be complete and holds {sorted(found)}, expected {sorted(wanted)}")
        return wrong


def besiege(
    commands: Mapping[str, Command],
    *,
    kills: int,
    failures: int,
    seconds: float,
    seed: int = 0,
    loaded: Sequence[str] = (),
    kept: Path | None = None,
) -> list[Found]:
    """Kills and failing calls, spread evenly over commands and their calls.

    Args:
        commands: by name.
        kills, failures: how many of each in all.
        seconds: after which no more is begun.
        seed: of which calls are struck.
        loaded: modules that the program has loaded before it forks; all of them where none is named.
        kept: where the counts are kept after each round, so that a stopped campaign goes on.
    """
    first = 0
    killed, failed = Counter[str](), Counter[str]()
    bad_kills: list[str] = []
    bad_failures: list[str] = []
    if kept is not None and kept.exists():
        before = json.loads(kept.read_text(encoding="utf-8"))
        first, bad_kills, bad_failures = before["round"], before["bad_kills"], before["bad_failures"]
        killed.update(before["killed"])
        failed.update(before["failed"])
    with tempfile.TemporaryDirectory(prefix="siege-") as name:
        folder = Path(name)
        inputs = folder / "inputs"
        inputs.mkdir()
        _inputs(inputs)
        siege = Siege(folder, loaded=loaded)
        try:
            if any("INPUTS" in word for command in commands.values() for word in command.new):
                _made_inputs(siege, inputs)
            begin, cases = time.monotonic(), []
            for name, command in commands.items():
                cases.append(Case(siege, name, command, inputs))
                progress(f"{name}: {cases[-1].calls} calls")
            for k in range(first, max(kills, failures)):
                chance = random.Random(f"{seed} {k}")
                for case in cases:
                    if time.monotonic() - begin > seconds:
                        break
                    at, last = k + chance.random(), case.calls - 1
                    if killed.total() < kills:
                        stop = 1 + min(int(at / -(-kills // len(cases)) * case.calls), last)
                        bad_kills += case.struck(mode=chance.choice((KILL, KILL, HALF)), stop=stop)
                        killed[case.name] += 1
                    if failed.total() < failures:
                        stop = 1 + min(int(at / -(-failures // len(cases)) * case.calls), last)
                        kind = list(ERRORS)[(k + failed.total()) % len(ERRORS)]
                        bad_failures += [
                            f"{kind}, {words}" for words in case.struck(mode=FAIL, stop=stop, error=ERRORS[kind])
                        ]
                        failed[case.name] += 1
                    progress(
                        f"{killed.total()} kills, {failed.total()} failures, {len(bad_kills) + len(bad_failures)} bad"
                    )
                else:
                    if kept is not None:
                        now = {"round": k + 1, "killed": killed, "failed": failed}
                        now |= {"bad_kills": bad_kills, "bad_failures": bad_failures}
                        kept.write_text(json.dumps(now), encoding="utf-8")
                    continue
                break
        finally:
            siege.close()
    return [
        _found("Siege: hard kills", KILLS, killed, bad_kills, cases),
        _found("Siege: disks that are full, read-only or broken", FAILURES, failed, bad_failures, cases),
    ]


KILLS = (
    "kills of processes that had done their work and wanted to write, at calls that open, write, flush, rename, remove "
    "or close files (a third of them in the middle of a write), spread over all calls of a command. Judged are files "
    "that are half-written, old and new ones side by side, the user's own file in the folder, and temporary files or a "
    "wrong result after the next run."
)
FAILURES = (
    "runs in which a call fails, and all later ones: no space, quota, read-only, no permission, input or output error. "
    "Wanted are a message and exit code 2, the old results untouched, nothing left, and a next run that is complete. "
    "Where complete results are just being moved to their places, the message has to say that they wait beside them."
)


def _made_inputs(siege: Siege, inputs: Path) -> None:
    """What commands make for other commands."""
    out = siege.folder / "made"
    made = [
        f"respond {inputs}/log.csv --inputs servo_roll --outputs p --band 1-8Hz --out {out}",
        f"respond {inputs}/log.csv --inputs servo_roll --outputs p --band 2-6Hz --out {out}/narrow",
        f"vehicle linearize raptor50 --speed 0-5/5 --out {out}/models",
        f"simulate --vehicle coax --maneuver sweep:pitch,0.5-4Hz,8s --out {out}/flight.nc",
    ]
    for words in made:
        told, said = siege.run(words.split())
        if told["code"] != 0:
            raise RuntimeError(f"{words}: {said}")
    shutil.copy(out / "responses.nc", inputs / "responses.nc")
    shutil.copy(out / "flight.nc", inputs / "flight.nc")
    shutil.copy(out / "narrow" / "responses.nc", inputs / "narrow.nc")
    for k, path in enumerate(sorted((out / "models").glob("*.toml"))):
        shutil.copy(path, inputs / f"at{5 * k}.toml")
    with contextlib.suppress(OSError):
        shutil.rmtree(out)


def _found(title: str, text: str, counts: Counter[str], bad: list[str], cases: Sequence[Case]) -> Found:
    rows = [[case.name, case.calls, counts[case.name], sum(f"{case.name}, call" in b for b in bad)] for case in cases]
    rows.append(["all", sum(case.calls for case in cases), counts.total(), len(bad)])
    return Found(title, f"{counts.total():,} {text}", ["command", "its calls", "struck", "wrong"], rows, bad)
