"""The documentation's pages as programs: what is generated is generated anew, what is shown as output is run.

    python scripts/docs_pages.py           writes the generated pages and refreshes every quick output
    python scripts/docs_pages.py --real docs/tutorials/first-model.md ...
                                           only these pages, with what identifies from the real flights (minutes)

On a page,

* a fence `python` is run, in the page's order and one namespace; a fence `text` right after it is what it prints;
* a fence `console` holds commands `$ swash ...` and under each what it prints (`| head -n N` and `| tail -n N` work);
* a comment `<!-- file: NAME -->` before a fence writes the fence into the page's folder as NAME;
* a comment `<!-- package: NAME -->` installs `examples/NAME` while the page runs;
* what lies between `<!-- generated: NAME -->` and `<!-- end -->` is made by the function NAME of `GENERATED`.
"""

from __future__ import annotations

import contextlib
import inspect
import io
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any
from unittest import mock

from own_package import EXAMPLES, installed
from real_results import results_text, trusted_text

from swashplate.atomic import write_bytes, write_text

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
_FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"<!-- file: (\S+) -->\s*$")
_PACKAGE = re.compile(r"<!-- package: (\w+) -->")
_REGION = re.compile(r"(<!-- generated: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
_SLOW = ("identify", "validate", "demo")
_REAL = "coax56/"


def pages() -> list[Path]:
    """Every page with something to run or to generate."""
    return [ROOT / "README.md", *sorted(p for p in DOCS.rglob("*.md") if p.name != "proof.md")]


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
    found: list[Fence] = []
    end = 0
    for match in _FENCE.finditer(page):
        before = page[end : match.start()]
        file = _FILE.search(before)
        found.append(
            Fence(match[1], match[2], match.start(2), match.end(2), file[1] if file else "", not before.strip())
        )
        end = match.end()
    return found


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
        long = _REAL in self.line or self.words[1] == "demo" or "raptor" in self.line
        return self.words[0] == "swash" and self.words[1] in _SLOW and long

    @property
    def runs(self) -> bool:
        return self.words[0] == "swash" and not self.line.startswith(("swash data fetch", "swash live", "swash replay"))


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
    found = fences(text)
    programs = [f for f in found if f.language == "python"]
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
        for number, fence in enumerate(found):
            if fence.file:
                Path(fence.file).write_text(fence.text, encoding="utf-8")
            elif fence.language == "python":
                if _REAL in fence.text and not (data_is_here or standing_in):
                    yield Shown(fence.text, "", None, fence)
                    return  # what comes after builds on it
                printed = run_python(fence, namespace)
                following = found[number + 1] if number + 1 < len(found) else None
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
    flown = sp.simulate_maneuver(
        vehicle, "multisine:roll+pitch,0.4-4Hz,8s,0.1", controller=sp.hover_hold, lead=1.0, tail=1.0
    )
    log = sp.observe(flown, vehicle, sensors=QUIET, seed=len(name))
    return replace(log, provenance=replace(log.provenance, source=name))


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
        vehicle, flights = asked.arguments["model"], asked.arguments["flights"]
        question = {name: asked.arguments[name] for name in ("ties", "fixed", "priors")}
        parameterize(vehicle, asked.arguments["free"] or "full", **question)  # are the names right?
        small = {"free": ["tau_f_upper", "linkage_lower"], "method": "output-error", "iterations": 3}
        return _once(("identify", flights.provenance.source), lambda: identify(vehicle, flights, **small))

    def validating(*given: Any, **options: Any) -> Any:
        asked = inspect.signature(validate).bind(*given, **options).arguments
        small = {**options, "every": 0.5, "horizons": (0.5, 1.0)}
        key = ("validate", type(asked["model"]).__name__, asked["flights"].provenance.source)
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


# ---- generated parts -------------------------------------------------------------------------------------------------
def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)])


def commands_text() -> str:
    """`--help` of every command."""
    import typer

    from swashplate.cli.app import app

    verbs: list[tuple[str, ...]] = [()]
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        verbs.append((name,))
        verbs += [(name, inner) for inner in getattr(command, "commands", {})]
    parts = []
    for verb in verbs:
        title = " ".join(("swash", *verb))
        parts.append(f"## {title}\n\n```text\n{run_command(Command(f'{title} --help', ''))}\n```")
    return "\n\n".join(parts)


def parameters_text() -> str:
    """The coax card as a table."""
    from swashplate.models.card import packaged_cards
    from swashplate.reporting.glossary import meaning

    rows = []
    for name, p in packaged_cards()["coax"].parameters.items():
        bounds = "" if p.lower is None and p.upper is None else f"{_bound(p.lower)} to {_bound(p.upper)}"
        source = p.source + (f" ({p.note})" if p.note else "")
        rows.append((f"`{name}`", f"{p.value:.6g}", p.unit, bounds, p.status, meaning(name), source))
    return _table(
        ("parameter", "value", "unit", "physical bounds", "status", "meaning [symbol in the paper]", "source"), rows
    )


def _bound(value: float | None) -> str:
    return "…" if value is None else f"{value:g}"


def trust_text() -> str:
    """What the coax card says of itself."""
    from swashplate.models.card import packaged_cards

    card = packaged_cards()["coax"]
    options = ", ".join(f"`{name} = {str(value).lower()}`" for name, value in card.options.items())
    return f"**{card.title}.** {card.trust}\n\nOptions of the equations: {options}."


def choices_text() -> str:
    """The ready choices of free parameters with their priors."""
    import swashplate as sp

    coax = "\n\n".join(map(_choice, sp.CHOICES.values()))
    others = "\n\n".join(map(_choice, sp.vehicle("raptor50", bar=True).choices.values()))
    words = "A single-rotor helicopter's take their priors from its card; here those of `raptor50` with `bar = true`."
    return f"For the CoaX:\n\n{coax}\n\n{words}\n\n{others}"


def _choice(choice: Any) -> str:
    rows = [(f"`{f.name}`", "none" if f.mean is None else f"{f.mean:g} ± {f.sigma:g}", f.source) for f in choice.free]
    set_too = ", ".join(f"`{name} = {value:g}`" for name, value in choice.fixed)
    ties = f"\n\nTies: {', '.join(f'`{tie}`' for tie in choice.ties)}." if choice.ties else ""
    text = f"`{choice.name}`: {choice.description}.\n\n{_table(('free', 'prior (mean ± sigma)', 'from'), rows)}{ties}"
    return text + (f" Set: {set_too}." if set_too else "")


def channels_text() -> str:
    """The schema's channels."""
    from swashplate.flights.schema import CHANNELS

    rows = [
        (f"`{c.name}`", c.unit, c.shown_unit, c.frame.replace("->", " → "), c.description) for c in CHANNELS.values()
    ]
    return _table(("channel", "unit inside", "on screens", "frame", "meaning and sign"), rows)


def thresholds_text() -> str:
    """The verdict's thresholds."""
    from swashplate.identification.time import feedback
    from swashplate.validation.verdict import THRESHOLDS

    rows = [
        (name, f"every channel of the axis at {value:g} % or more, and better than every rival")
        for name, value in THRESHOLDS.items()
    ]
    rows.append(("poor", "otherwise"))
    rows.append(
        (
            "cannot be judged",
            f"past motion explains {100 * feedback.EXPLAINED:g} % or more of the command in every record; or even the "
            f"ceiling stays below {THRESHOLDS['usable']:g} % and the model is as good as it",
        )
    )
    return _table(("verdict", "condition"), rows)


def bench_columns_text() -> str:
    """The columns of a bench record."""
    from swashplate.bench.record import COLUMNS

    return _table(
        ("column", "unit", "meaning and sign"), [(f"`{n}`", unit, words) for n, (unit, words) in COLUMNS.items()]
    )


def bench_procedures_text() -> str:
    """The bench's procedures with what they need."""
    from swashplate.bench.evaluate import PROCEDURES

    rows = [
        (f"`{name}`", module.TITLE, ", ".join(f"`{column}`" for column in module.COLUMNS), module.SOURCE)
        for name, module in PROCEDURES.items()
    ]
    return _table(("procedure", "measures", "needs the columns", "by"), rows)


def package_text(name: str) -> str:
    """An example package: its module, and its entry point."""
    code, project = ((EXAMPLES / name / file).read_text(encoding="utf-8") for file in (f"{name}.py", "pyproject.toml"))
    points = project[project.index("[project.entry-points") :].split("\n\n")[0]
    return f"```python\n{code}```\n\nIts `pyproject.toml` names it:\n\n```toml\n{points}\n```"


def decisions_text() -> str:
    """Every decision's page by its heading, in the order of their numbers."""
    pages = sorted(page for page in (DOCS / "decisions").glob("*.md") if page.name != "index.md")
    headings = [page.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ") for page in pages]
    return "\n".join(f"* [{heading}]({page.name})" for heading, page in zip(headings, pages, strict=True))


PACKAGES = ("ducted_fan", "rate_least_squares", "triax_log", "attitude_pd", "stability_table")


GENERATED: Mapping[str, Callable[[], str]] = {
    "commands": commands_text,
    "parameters": parameters_text,
    "trust": trust_text,
    "choices": choices_text,
    "channels": channels_text,
    "thresholds": thresholds_text,
    "bench_columns": bench_columns_text,
    "bench_procedures": bench_procedures_text,
    "decisions": decisions_text,
    "results": results_text,
    "trusted": trusted_text,
    **{name: partial(package_text, name) for name in PACKAGES},
}


def regenerated(text: str) -> str:
    """A page with its generated parts made anew."""
    return _REGION.sub(lambda m: f"{m[1]}{GENERATED[m[2]]()}\n{m[3]}", text)


# ---- refreshing ------------------------------------------------------------------------------------------------------
def refreshed(text: str, *, real: bool) -> str:
    """A page with the outputs that came out. Run in a folder of its own."""
    edits: dict[int, tuple[Fence, str]] = {}
    for shown in run_page(text, real=real):
        if shown.came is None:
            continue
        fence, now = edits.get(shown.fence.start, (shown.fence, shown.fence.text))
        if fence.language == "text":
            now = shown.came + "\n"
        elif shown.said:
            now = now.replace(shown.said, shown.came, 1)
        edits[fence.start] = (fence, now)
    for fence, now in sorted(edits.values(), key=lambda edit: -edit[0].start):
        text = text[: fence.start] + now + text[fence.stop :]
    return text


def main(arguments: list[str]) -> None:
    real = "--real" in arguments
    named = [Path(name).resolve() for name in arguments if name != "--real"]
    for page in named or pages():
        if not page.exists():
            continue
        text = page.read_text(encoding="utf-8")
        here = Path.cwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                new = refreshed(regenerated(text), real=real)
                for picture in Path(folder).glob("*.png"):
                    if f"pictures/{picture.name}" in text:
                        write_bytes(DOCS / "pictures" / picture.name, picture.read_bytes())
            finally:
                os.chdir(here)
        if new != text:
            write_text(page, new)
            print("changed", page.relative_to(ROOT))


if __name__ == "__main__":
    main(sys.argv[1:])
