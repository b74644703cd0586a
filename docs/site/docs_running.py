"""The documentation's pages as programs: fences and commands, run with what they print beside what the page shows.

On a page,

* a fence `python` is run, in the page's order and one namespace; a fence `text` right after it is what it prints;
* a fence `console` holds commands `$ swash ...` and under each what it prints (`| head -n N` and `| tail -n N` work);
* a comment `<!-- file: NAME -->` before a fence writes the fence into the page's folder as NAME;
* a comment `<!-- package: NAME -->` installs `examples/NAME` while the page runs.
"""

from __future__ import annotations

import contextlib
import inspect
import io
import os
import re
import shlex
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any
from unittest import mock

from own_package import installed

_FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"<!-- file: (\S+) -->\s*$")
_PACKAGE = re.compile(r"<!-- package: (\w+) -->")
_SLOW = ("identify", "validate", "demo")
_REAL = "coax56/"


# ---- fences ----------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Fence:
    """One fenced block: language, text, where its text lies on the page, the file it is written to ("" for none)."""

    language: str
    text: str
    start: int
    stop: int
    file: str = ""
    follows: bool = False  # directly after the fence before it


def fences(page: str) -> list[Fence]:
    fenced: list[Fence] = []
    end = 0
    for match in _FENCE.finditer(page):
        before = page[end : match.start()]
        file = _FILE.search(before)
        fenced.append(
            Fence(match[1], match[2], match.start(2), match.end(2), file[1] if file else "", not before.strip())
        )
        end = match.end()
    return fenced


@dataclass(frozen=True)
class Command:
    """One command of a `console` fence and what the page says that it prints."""

    line: str
    shown: str

    @property
    def words(self) -> list[str]:
        return shlex.split(self.line.partition("|")[0])

    @property
    def slow(self) -> bool:
        """Minutes long: real flights are identified from, or predicted; a helicopter's derivatives are compiled."""
        long = _REAL in self.line or "demo" in self.words[:2] or "raptor" in self.line
        return self.words[0] == "swash" and long and set(self.words[1:2]) <= set(_SLOW)

    @property
    def runs(self) -> bool:
        """Whether it ends by itself, without a network."""
        served = self.line == "swash" or self.line.startswith("swash live")
        return self.words[0] == "swash" and not served and not self.line.startswith("swash data fetch")


def commands(fence: Fence) -> list[Command]:
    parts = re.split(r"^\$ ", fence.text, flags=re.MULTILINE)[1:]
    made = []
    for part in parts:
        line, _, shown = re.sub(r"\\\n\s*", "", part).partition("\n")
        made.append(Command(line.strip(), shown.strip("\n")))
    return made


# ---- running ---------------------------------------------------------------------------------------------------------
def run_command(command: Command) -> str:
    """What `swash ...` prints, in this process; lines are stripped at their right."""
    from typer.testing import CliRunner

    from swashplate.cli import console
    from swashplate.cli.app import app

    with mock.patch.object(console, "_STAGES_AFTER", 1e6):  # how long something takes is no output
        result = CliRunner().invoke(app, command.words[1:], env={"COLUMNS": "80"})
    if result.exit_code not in (0, 2):
        raise AssertionError(f"`{command.line}` ended with {result.exit_code}: {result.output}") from result.exception
    text = result.output.replace(str(Path.cwd()) + os.sep, "")
    lines = [line.rstrip() for line in text.splitlines()]
    for pipe in command.line.split("|")[1:]:
        kind, _, n = pipe.split()
        lines = lines[: int(n)] if kind == "head" else lines[-int(n) :]
    return "\n".join(lines).strip("\n")


def run_python(fence: Fence, namespace: dict[str, Any]) -> str:
    """What a `python` fence prints."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(fence.text, "page", "exec"), namespace)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()).strip("\n")


@dataclass(frozen=True)
class Shown:
    """An output on a page: where it stands, what the page says, what came out (None: not run)."""

    what: str
    said: str
    came: str | None
    fence: Fence


def runs_something(text: str) -> bool:
    return any(f.language in ("python", "console") for f in fences(text))


def run_page(text: str, *, real: bool, data_is_here: bool = True) -> Iterator[Shown]:
    """Run a page in the current folder; commands that take minutes only where `real`, those on real flights only where
    `data_is_here`.

    A page whose Python identifies from real flights runs on short simulated ones instead unless `real`; what it prints
    is then of no interest.
    """
    fenced = fences(text)
    programs = [f for f in fenced if f.language == "python"]
    standing_in = (
        not real
        and any(f"{verb}(" in f.text for f in programs for verb in ("identify", "validate"))
        and any(_REAL in f.text for f in programs)
    )
    namespace: dict[str, Any] = {}
    with contextlib.ExitStack() as around:
        if standing_in:
            around.enter_context(stand_ins())
        for name in _PACKAGE.findall(text):
            site = Path(around.enter_context(tempfile.TemporaryDirectory()))
            around.enter_context(installed(name, site))
        for number, fence in enumerate(fenced):
            if fence.file:
                Path(fence.file).write_text(fence.text, encoding="utf-8")
            elif fence.language == "python":
                if _REAL in fence.text and not (data_is_here or standing_in):
                    yield Shown(fence.text, "", None, fence)
                    return  # what comes after builds on it
                printed = run_python(fence, namespace)
                following = fenced[number + 1] if number + 1 < len(fenced) else None
                if following and following.language == "text" and following.follows:
                    yield Shown(fence.text, following.text.strip("\n"), None if standing_in else printed, following)
            elif fence.language == "console":
                for command in commands(fence):
                    if not command.runs or (command.slow and not real):
                        continue
                    missing = _REAL in command.line and not data_is_here
                    came = None if missing else run_command(command)
                    yield Shown(command.line, command.shown, came, fence)


@lru_cache
def _log(name: str) -> Any:
    """A short simulated log that stands in for a real one."""
    import swashplate as sp
    from swashplate.simulation.sensors import QUIET

    vehicle = sp.vehicle("coax")
    flown = sp.simulate(vehicle, "multisine:roll+pitch,0.4-4Hz,8s,0.1", lead=1.0, tail=1.0)
    log = sp.observe(flown, vehicle, sensors=QUIET, seed=len(name))
    return replace(log, provenance=replace(log.provenance, source=name))


_HELD = {"ties": "tie", "fixed": "fix", "priors": "prior"}
"""What holds parameters, as `parameterize` and as `sp.identify` call it."""


@contextlib.contextmanager
def stand_ins() -> Iterator[None]:
    """Short simulated logs in place of the real flights, a small fit in place of a long one: the calls are tried."""
    import swashplate as sp
    from swashplate.identification.core.parameters import parameterize

    read, identify, validate = sp.read, sp.identify, sp.validate

    def reading(name: str, **options: Any) -> Any:
        return _log(str(name)) if str(name).startswith(_REAL) else read(name, **options)

    def identifying(*given: Any, **options: Any) -> Any:
        asked = inspect.signature(identify).bind(*given, **options)
        asked.apply_defaults()
        vehicle, flights = asked.arguments["vehicle"], asked.arguments["flight"]
        question = {plural: asked.arguments[name] for plural, name in _HELD.items() if asked.arguments[name]}
        parameterize(vehicle, asked.arguments["free"] or "full", **question)  # are the names right?
        small = {"free": ["tau_f_upper", "linkage_lower"], "method": "output-error", "iterations": 3}
        return _once(("identify", flights.provenance.source), lambda: identify(vehicle, flights, **small))

    def validating(*given: Any, **options: Any) -> Any:
        asked = inspect.signature(validate).bind(*given, **options).arguments
        small = {**options, "every": 0.5, "horizons": (0.5, 1.0)}
        key = ("validate", type(asked["vehicle"]).__name__, asked["flight"].provenance.source)
        return _once(key, lambda: validate(*given, **small))

    with mock.patch.multiple(sp, read=reading, identify=identifying, validate=validating):
        yield


_DONE: dict[tuple[str, ...], Any] = {}


def _once(key: tuple[str, ...], work: Callable[[], Any]) -> Any:
    """What a stand-in found the first time: pages ask the same of the same logs."""
    if key not in _DONE:
        _DONE[key] = work()
    return _DONE[key]


def same(said: str, came: str, *, tolerance: float = 2e-2) -> bool:
    """Whether two outputs agree word by word, numbers to a relative tolerance; times that a run took may differ."""
    left, right = ([_timeless(line).split() for line in text.splitlines() if line.strip()] for text in (said, came))
    if [len(line) for line in left] != [len(line) for line in right]:
        return False
    pairs = ((a, b) for one, other in zip(left, right, strict=True) for a, b in zip(one, other, strict=True))
    return all(_same_word(a, b, tolerance) for a, b in pairs)


def _timeless(line: str) -> str:
    return re.sub(r"\(\d+ s\)|converged, [\d.]+ s", "", line)


def _same_word(a: str, b: str, tolerance: float) -> bool:
    try:
        x, y = float(a.strip("(),%")), float(b.strip("(),%"))
    except ValueError:
        return a == b
    return x == y or (x != x and y != y) or abs(x - y) <= max(tolerance * max(abs(x), abs(y)), 1e-9)
