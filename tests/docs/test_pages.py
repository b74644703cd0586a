"""The documentation runs: every Python block, every `$ swash ...` line, every generated part and every link."""

from __future__ import annotations

import ast
import inspect
import re
import runpy
from functools import lru_cache
from pathlib import Path
from typing import Any

import block_diagram as diagram
import docs_pages as docs
import docs_running as running
import matplotlib as mpl
import pytest
import typer

import report_samples
import swashplate as sp
from swashplate.cli.app import app
from swashplate.cli.generate import asked
from swashplate.flights import datasets
from swashplate.reporting.compose import compose

ROOT = Path(__file__).resolve().parents[2]
_FLIGHTS = ("flight_2011-08-01_vertical.mat", "flight_2011-07-25_hover_crash.mat")


PAGES = {str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in docs.pages()}
HEAVY = {
    "docs/explanation/flights-under-feedback.md",
    "docs/explanation/lpv.md",
    "docs/howto/check-a-controller.md",
    "docs/howto/decouple-and-hold.md",
    "docs/howto/fly-under-ardupilot-or-px4.md",
    "docs/notebooks/log-to-flight.md",
}
"""Pages that fly and compile long for themselves alone; what they call is run in short by tests/cli and tests/unit."""
COMMANDS = [
    (name, command)
    for name, text in PAGES.items()
    for fence in running.fences(text)
    if fence.language == "console"
    for command in running.commands(fence)
]


def _anchors(text: str) -> set[str]:
    """Anchors that a Markdown page's headings get."""
    headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def _run(name: str) -> Any:
    """A page as a parameter."""
    return pytest.param(name, marks=[pytest.mark.proof] if name in HEAVY else [])


@pytest.mark.parametrize("name", [_run(name) for name, text in PAGES.items() if running.runs_something(text)])
def test_a_page_runs_and_prints_what_it_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    here = all(datasets.find("coax56", file) for file in _FLIGHTS)
    left_out = []
    for shown in running.run_page(PAGES[name], real=False, data_is_here=here):
        if shown.came is None:
            left_out.append(shown.what.strip().splitlines()[0])
        elif shown.said:
            assert running.same(shown.said, shown.came), f"{name}: {shown.what}\nprints now:\n{shown.came}"
    if left_out and not here:
        pytest.skip(f"the flights of coax56 are not here; not run: {'; '.join(left_out)}")


def calls_that_fail(program: str) -> list[str]:
    """Public names that a program uses and that there are not, and arguments by name that they do not take."""
    wrong = []
    for node in ast.walk(ast.parse(program)):
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "sp" and not hasattr(sp, node.attr):
            wrong.append(node.attr)
        elif isinstance(node, ast.Call) and (name := ast.unparse(node.func))[:3] == "sp." and hasattr(sp, name[3:]):
            taken = inspect.signature(getattr(sp, name[3:])).parameters
            if not any(each.kind is each.VAR_KEYWORD for each in taken.values()):
                wrong += [f"{name}: {k.arg}" for k in node.keywords if k.arg and k.arg not in taken]
    return wrong


@pytest.mark.parametrize("name", sorted(HEAVY))
def test_a_heavy_page_calls_what_there_is(name: str) -> None:
    programs = [fence.text for fence in running.fences(PAGES[name]) if fence.language == "python"]
    assert programs or [command for page, command in COMMANDS if page == name]
    assert [wrong for program in programs for wrong in calls_that_fail(program)] == []


def test_a_call_of_what_there_is_not_is_found() -> None:
    assert calls_that_fail("import swashplate as sp\nsp.trim(sp.no_vehicle('coax'), spead=2.0, **more)") == [
        "sp.trim: spead",
        "no_vehicle",
    ]


@pytest.mark.parametrize("example", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.name)
def test_an_example_runs(example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(example), run_name="__main__")
    assert list(tmp_path.iterdir()), "an example leaves something to look at"


@lru_cache
def _command_line() -> Any:
    """Building it takes a quarter of a second."""
    return typer.main.get_command(app)


@pytest.mark.parametrize(("name", "command"), COMMANDS, ids=[f"{name}: {c.line[:60]}" for name, c in COMMANDS])
def test_a_command_is_one_that_the_command_line_takes(name: str, command: Any) -> None:
    words = command.words
    if words[:2] == ["pip", "install"] and words[2].startswith("."):
        return
    if words[0] == "make":
        assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE)
        return
    assert words[0] == "swash", f"{name}: `{command.line}` is neither swash nor make"
    parsed, rest, helped = _command_line(), words[1:], "--help" in words
    context = first = parsed.make_context("swash", list(rest), resilient_parsing=helped)
    while hasattr(parsed, "commands") and (rest := [*context._protected_args, *context.args]):
        parsed = parsed.commands[rest[0]]
        context = parsed.make_context(parsed.name, rest[1:], parent=context, resilient_parsing=helped)
    settings = first.params["settings"] or ()
    if hasattr(parsed, "question") and not helped and not any(text.endswith(".toml") for text in settings):
        with context:
            asked(parsed.question, {k: v for k, v in context.params.items() if k != "out_"}, settings=settings)


@pytest.mark.parametrize("name", [name for name, text in PAGES.items() if "<!-- generated:" in text])
def test_what_is_generated_is_current(name: str) -> None:
    assert docs.regenerated(PAGES[name]) == PAGES[name], "run: python docs/site/docs_pages.py"


def test_the_block_diagram_is_that_of_the_equations() -> None:
    assert diagram.as_svg(diagram.Trace()) == diagram.PICTURE.read_text(encoding="utf-8"), (
        "run: python docs/site/block_diagram.py"
    )


def test_the_traced_diagram_has_the_arrows_of_the_paper() -> None:
    arrows = diagram.Trace().arrows
    # Fankhauser et al., Fig. 3: motors and battery drive the drive trains, their speeds the rotors and both phase lags,
    # speed and rates the lower rotor, attitude the bar.
    for side, tilts in (("upper", "stabilizer bar, upper"), ("lower", "swashplate, lower")):
        train, turned = f"drive train, {side}", f"rotor, {side}"
        assert {(f"motor_{side}", train), ("voltage", train), (train, tilts), (train, turned), (tilts, turned)} <= set(
            arrows
        )
        assert (turned, "rigid body") in arrows
    assert {"u", "v", "p", "q"} <= set(arrows["rigid body", "swashplate, lower"])
    assert {"phi", "theta"} <= set(arrows["rigid body", "stabilizer bar, upper"])
    assert not any(name.startswith("servo") and target != "swashplate, lower" for name, target in arrows)


@pytest.mark.parametrize("name", PAGES)
def test_links_lead_somewhere(name: str) -> None:
    page = ROOT / name
    for target in re.findall(r"\]\(([^)\s]+)\)", PAGES[name]):
        if target.startswith(("http:", "https:", "mailto:")):
            continue
        path, _, anchor = target.partition("#")
        place = (page.parent / path).resolve() if path else page
        assert place.exists(), f"{name} links to {target}"
        if anchor:
            assert anchor in _anchors(place.read_text(encoding="utf-8")), f"{name} links to {target}"


def test_every_page_can_be_reached_from_the_index() -> None:
    seen, waiting = set(), [ROOT / "docs" / "index.md"]
    while waiting:
        page = waiting.pop()
        if page in seen or not page.is_file():
            continue
        seen.add(page)
        targets = re.findall(r"\]\(([^)\s#]+\.md)", page.read_text(encoding="utf-8"))
        waiting += [(page.parent / target).resolve() for target in targets if not target.startswith("http")]
    assert [name for name in PAGES if ROOT / name not in seen] == []


def test_the_guide_to_the_report_names_its_sections() -> None:
    page, on_responses = PAGES["docs/howto/read-the-report.md"].split("## Reports on frequency responses")
    named = set(re.findall(r"\*\*(.+?)\*\*", page)) - {"Banners", "Summary"}
    report = compose(report_samples.fit(), report_samples.validation(), modes=report_samples.modes())
    titles = {section.title for section in report.sections}
    assert named <= titles
    made = (ROOT / "src" / "swashplate" / "reporting" / "sections_responses.py").read_text(encoding="utf-8")
    for name in ("sections_verification", "response_report"):
        made += (ROOT / "src" / "swashplate" / "reporting" / f"{name}.py").read_text(encoding="utf-8")
    assert all(f'"{title}"' in made for title in re.findall(r"\*\*(.+?)\*\*", on_responses))
