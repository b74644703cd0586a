"""A disk of its own that is full, has no room for names, or may not be written to: a small tmpfs, mounted for the test.

Mounting needs rights: the campaign runs in a name space of its own (`unshare --mount`), and says so where it may not.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path

from .found import ROOT, Found, progress
from .kills import QUICK, SLOW, Case, Command, Siege, _files, _inputs, _litter, _made_inputs, _put

SIZE = 64 << 20
"""Bytes of the disk."""
COMMANDS: Mapping[str, Command] = {
    **QUICK,
    **{name: SLOW[name] for name in ("bench simulate", "simulate", "linearize", "export, C", "stitch")},
}
SHARES = (0.0, 0.02, 0.1, 0.25, 0.4, 0.55, 0.7, 0.8, 0.9, 0.95)
"""Of the bytes that a command writes, that are free."""


@contextmanager
def _mounted(place: Path) -> Iterator[None]:
    place.mkdir(parents=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(place)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=True)


@contextmanager
def _full(place: Path, *, free: int) -> Iterator[None]:
    """So many bytes left, in whole pages."""
    filler, disk = place / "filler", os.statvfs(place)
    with filler.open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, max(disk.f_bavail * disk.f_bsize - free, disk.f_bsize))
    try:
        yield
    finally:
        filler.unlink()


@contextmanager
def _remounted(place: Path, option: str, back: str) -> Iterator[None]:
    subprocess.run(["mount", "-o", f"remount,{option}", str(place)], check=True)
    try:
        yield
    finally:
        subprocess.run(["mount", "-o", f"remount,{back}", str(place)], check=True)


@contextmanager
def _without_names(place: Path, *, left: int) -> Iterator[None]:
    """Room for so many more files and folders."""
    disk = os.statvfs(place)
    with _remounted(place, f"nr_inodes={disk.f_files - disk.f_ffree + left}", "nr_inodes=100000"):
        yield


def _troubles(place: Path, need: int) -> dict[str, list[Callable[[], AbstractContextManager[None]]]]:
    free = sorted({int(share * need) // 4096 * 4096 for share in SHARES})
    return {
        "no space": [partial(_full, place, free=bytes_) for bytes_ in free],
        "no room for names": [partial(_without_names, place, left=left) for left in range(4)],
        "read-only": [partial(_remounted, place, "ro", "rw")],
    }


def _struck(case: Case, siege: Siege, trouble: Callable[[], AbstractContextManager[None]]) -> tuple[int, list[str]]:
    """How a command ends on such a disk, and what is wrong then and after the next run on a whole one."""
    _put(case.old, case.out)
    with trouble():
        told, said = siege.run(case.asked, stopped=case.stopped)
        found = _files(case.out)
    same = found == case.old
    wrong = case.judged(found, complete=told["code"] == 0)
    if told["code"] not in (0, 2):
        wrong.append(f"ends with {told['code']}: {said.strip()[-200:]!r}")
    elif told["code"] == 2 and ("Error: " not in said or "Traceback" in said or "bug" in said):
        wrong.append(f"says {said.strip()[-200:]!r}")
    if told["code"] == 2:
        wrong += [f"leaves {name}" for name in _litter(case.out, siege.temporary)]
        wrong += [] if same else ["the old results are not as they were"]
    after, said = siege.run(case.asked, stopped=case.stopped)
    if after["code"] != 0:
        wrong.append(f"the next run ends with {after['code']}: {said.strip()[-200:]!r}")
    else:
        wrong += [f"after the next run: {problem}" for problem in case.judged(_files(case.out), complete=True)]
    wrong += [f"after the next run {name} is left" for name in _litter(case.out, siege.temporary)]
    return told["code"], wrong


def besiege_here(commands: Mapping[str, Command]) -> Found:
    """The campaign, in a process that may mount."""
    runs, refused = Counter[tuple[str, str]](), Counter[str]()
    bad: list[str] = []
    with tempfile.TemporaryDirectory(prefix="siege-") as name:
        folder = Path(name)
        inputs, area = folder / "inputs", folder / "cases" / "area"
        inputs.mkdir()
        _inputs(inputs)
        with _mounted(area):
            siege = Siege(folder)
            try:
                _made_inputs(siege, inputs)
                for command, words in commands.items():
                    case = Case(siege, command, words, inputs)
                    need = sum(len(content) + 4096 for content in case.new.values())
                    for kind, troubles in _troubles(area, need).items():
                        for trouble in troubles:
                            code, wrong = _struck(case, siege, trouble)
                            runs[command, kind] += 1
                            refused[command] += code == 2
                            bad += [f"{command}, {kind}: {problem}" for problem in wrong]
                            progress(f"{command}: {runs.total()} runs, {len(bad)} bad")
                    shutil.rmtree(case.out)
            finally:
                siege.close()
    kinds = ("no space", "no room for names", "read-only")
    rows = [
        [name, *(runs[name, kind] for kind in kinds), refused[name], sum(b.startswith(f"{name}, ") for b in bad)]
        for name in commands
    ]
    rows.append(["all", *(sum(row[k] for row in rows) for k in range(1, 6))])
    text = (
        f"{runs.total()} runs on a disk of its own (tmpfs): from none to 95 % of the bytes free that a command writes, "
        "no room for further names, or mounted read-only. Wanted are a message and exit code 2 with the old results as "
        "they were and nothing left, or a whole result; and a whole result from the next run on a disk with room."
    )
    columns = ["command", "no space", "no room for names", "read-only", "refused in words", "wrong"]
    return Found("Siege: full and read-only disks, mounted", text, columns, rows, bad)


def besiege() -> dict[str, object] | None:
    """The campaign as a section of the page; None where this machine does not let us mount."""
    places = [str(ROOT / "tests"), str(ROOT), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(places)}
    done = subprocess.run(
        ["unshare", "--mount", "--propagation", "private", sys.executable, "-m", "tests.siege.disks"],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        check=False,
    )
    lines = done.stdout.splitlines()
    return json.loads(lines[-1]) if done.returncode == 0 and lines else None


if __name__ == "__main__":
    print(json.dumps(besiege_here(COMMANDS).to_document()))
