"""Other users of the same machine: names that they could foretell, doors, libraries planted where ours are kept.

Each command runs twice, and each of its Python processes tells what it does (`seen`). What both runs call the same in
the folder for temporary files, somebody else can make before. Then its cache lies where everybody can write, with
libraries under the names that the first run has used; one that is loaded leaves a mark.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .found import Found, progress
from .plain import COMMANDS, Machine, machine

ASKED = ("uname",)
"""Programs that libraries start by name (h5py): `swash` has only absolute folders on its PATH."""
_SYSTEM = ("/lib", "/usr/lib", "/usr/local/lib", "/opt", "/proc/self")
Event = tuple[str, str, Any]


def events(log: Path) -> list[Event]:
    """What was told."""
    return [tuple(json.loads(line)) for line in log.read_bytes().splitlines()] if log.exists() else []


def wrong(first: Sequence[Event], second: Sequence[Event], places: Mapping[str, Path]) -> list[str]:
    """What somebody else could use.

    Args:
        first, second: what two runs of a command told.
        places: "temporary", "cache" and "out".
    """
    found: dict[str, None] = {}
    temporary = places["temporary"]
    again = {_first(path, temporary) for event, path, _ in second if event in ("open", "os.mkdir")} - {None}
    ours = (*places.values(), Path(sys.prefix), Path(sys.base_prefix))
    for event, name, more in first:
        path = Path(name)
        if event in ("open", "os.mkdir"):
            top = _first(name, temporary)
            if top is not None and top in again:
                found[f"{top} in the folder for temporary files has the same name each time"] = None
            if event == "os.mkdir" and path.parent == temporary and more & 0o077:
                found[f"others may look into {'the folder of a random name'} that it makes ({more:o})"] = None
            if name != os.devnull and not any(path.is_relative_to(place) for place in places.values()):
                found[f"writes to {name}"] = None
        elif event in ("os.mkfifo", "socket.bind"):
            found[f"can be reached: {event} {name}"] = None
        elif event == "socket.connect" and more != "AF_UNIX":
            found[f"connects to {name}"] = None
        elif event == "ctypes.dlopen" and "/" in name:
            if not any(path.is_relative_to(place) for place in ours) and not name.startswith(_SYSTEM):
                found[f"loads {name}"] = None
        elif event == "subprocess.Popen" and not path.is_absolute() and name not in ASKED:
            found[f"starts {name}, which has no absolute path"] = None
    return list(found)


def _first(path: str, temporary: Path) -> str | None:
    """The name in the folder for temporary files that a path begins with."""
    whole = Path(path)
    return whole.relative_to(temporary).parts[0] if temporary in whole.parents else None


PLANTED = """
#include <fcntl.h>
#include <unistd.h>
__attribute__((constructor)) static void ran(void) { close(open("MARK", O_CREAT | O_WRONLY, 0600)); }
"""


def _plant(libraries: Sequence[Path], mark: Path) -> None:
    source = mark.with_suffix(".c")
    source.write_text(PLANTED.replace("MARK", str(mark)))
    for library in libraries:
        library.unlink()
        subprocess.run(["gcc", "-shared", "-fPIC", "-o", str(library), str(source)], check=True)


def besiege(*, commands: Sequence[str] = tuple(COMMANDS)) -> Found:
    """Each command, twice and with planted libraries."""
    bad: list[str] = []
    rows: list[list[Any]] = []
    with machine(commands) as on:
        looking, mark = on.home.with_name("looking"), on.home.with_name("mark")
        looking.mkdir()
        (looking / "sitecustomize.py").write_text(Path(__file__).with_name("seen.py").read_text())
        places = {"temporary": on.temporary, "out": on.here, "cache": on.home / ".cache"}
        for command in commands:
            told = []
            for k in range(2):
                log = looking / f"{len(rows)}-{k}"
                ended = on.run(COMMANDS[command], environment={"PYTHONPATH": str(looking), "SWASH_SEEN": str(log)})
                problems = [] if ended.code == 0 else [ended.wrong() or f"is refused: {ended.said.strip()[:300]}"]
                problems += [f"leaves {name}" for name in on.clear()]
                told.append(events(log))
            problems += wrong(told[0], told[1], places)
            kinds = Counter(event for event, _, _ in told[0])
            written = kinds["open"] + kinds["os.mkdir"]
            rows.append([command, written, kinds["socket.bind"], kinds["ctypes.dlopen"], kinds["subprocess.Popen"]])
            rows[-1].append(len(problems))
            bad += [f"{command}: {problem}" for problem in problems]
            progress(f"{command}: {len(bad)} bad")
        bad += _planted(on, commands, mark)
    text = (
        "Every Python process of a command tells what it opens to write, binds, connects to, loads and starts. Wrong "
        "are: a name in the folder for temporary files that two runs share, a folder there that others may look into, "
        "a place that the security page does not name, a door, a connection, a library from elsewhere, a program "
        "without an absolute path; and a library that was planted in a cache that others can write to, and was loaded."
    )
    columns = ["command", "opened to write", "bound", "libraries", "programs", "wrong"]
    return Found("Siege: neighbours on the same machine", text, columns, rows, bad)


def _planted(on: Machine, commands: Sequence[str], mark: Path) -> list[str]:
    """Commands whose planted libraries ran."""
    libraries = list((on.home / ".cache").rglob("*.so"))
    if not libraries:
        return []
    _plant(libraries, mark)
    for place in (on.home / ".cache", on.home):
        place.chmod(0o777)
    bad = []
    for command in commands:
        ended = on.run(COMMANDS[command])
        if mark.exists() or ended.wrong():
            bad.append(f"{command}: {ended.wrong() or 'loads a planted library'}")
        mark.unlink(missing_ok=True)
        on.clear()
    on.home.chmod(0o700)
    return bad
