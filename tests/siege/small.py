"""Small and odd machines: little memory, few files, no home, closed streams, no compiler or a bad one."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .found import Found, progress
from .plain import COMMANDS, Machine, machine


@dataclass(frozen=True)
class Around:
    """What is other than usual: words of the shell before and after a command, environment, compiler."""

    before: str = ""
    after: str = ""
    environment: Mapping[str, str | None] = field(default_factory=dict)
    compiler: str | None = None


def _compiler(script: str) -> Around:
    return Around(compiler=f"#!/bin/sh\n{script}\n")


NO_PLACE = "/nowhere/at/all"
USUAL = "as it is"
MACHINES: Mapping[str, Around] = {
    USUAL: Around(),
    "1 GB of memory": Around(before="ulimit -v 1048576;"),
    "64 open files": Around(before="ulimit -n 64;"),
    "no home": Around(environment={"HOME": NO_PLACE}),
    "no HOME and no PATH": Around(environment={"HOME": None, "PATH": None, "USER": None}),
    "a home that others can write to": Around(before='chmod 777 "$HOME";'),
    "no standard output": Around(after=">&-"),
    "no standard streams": Around(after="<&- >&- 2>&-"),
    "no compiler": Around(environment={"PATH": NO_PLACE}),
    "a compiler that hangs": _compiler("exec sleep 1000"),
    "a compiler that says yes and writes nothing": _compiler("exit 0"),
    "a compiler that writes rubbish": _compiler(
        'while [ $# -gt 1 ]; do [ "$1" = -o ] && echo rubbish >"$2"; shift; done'
    ),
    "a compiler that refuses": _compiler("echo 'error: no' >&2; exit 1"),
}


def _tried(on: Machine, words: str, around: Around, tools: Path) -> list[str]:
    """What is wrong with a command on a machine."""
    environment = dict(around.environment)
    if around.compiler is not None:
        for name in ("cc", "gcc", "clang"):
            (tools / name).write_text(around.compiler)
            (tools / name).chmod(0o755)
        environment["PATH"] = f"{tools}:/usr/bin:/bin"
    ended = on.run(words, environment=environment, before=around.before, after=around.after)
    silent = "2>&-" in around.after and ended.code == 2
    wrong = [] if silent else [words for words in [ended.wrong()] if words]
    on.home.chmod(0o700)
    return wrong + [f"leaves {name}" for name in on.clear()] + (["done"] if ended.code == 0 else [])


def besiege(
    *, commands: Sequence[str] = tuple(COMMANDS), machines: Sequence[str] = tuple(MACHINES), seconds: float = 3600.0
) -> Found:
    """Each command on each machine; no further command after `seconds`."""
    bad: list[str] = []
    counts = {name: Counter[str]() for name in machines}
    with machine(commands) as on:
        tools = on.home.with_name("tools")
        tools.mkdir()
        until, used = time.monotonic() + seconds, 0
        for command in commands:
            if time.monotonic() > until:
                break
            used += 1
            for name in machines:
                wrong = _tried(on, COMMANDS[command], MACHINES[name], tools)
                counts[name].update(["runs", *(["done"] if "done" in wrong else [])])
                problems = [words for words in wrong if words != "done"]
                if name == USUAL and wrong == []:
                    problems = ["is refused on a usual machine"]
                counts[name]["wrong"] += bool(problems)
                bad += [f"{command}, {name}: {words}" for words in problems]
                progress(f"{command}: {sum(count['runs'] for count in counts.values())} runs, {len(bad)} bad")
    rows = [[name, c["runs"], c["done"], c["runs"] - c["done"] - c["wrong"], c["wrong"]] for name, c in counts.items()]
    text = (
        f"{used} of {len(commands)} commands, each a process of its own. Wanted is the result, or a message and exit "
        "code 2 (on the machine as it is the result), within two minutes; never a traceback, a process that dies, or a "
        "file that nobody asked for."
    )
    return Found(
        "Siege: small and odd machines", text, ["machine", "runs", "done", "refused in words", "wrong"], rows, bad
    )
