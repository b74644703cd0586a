"""Decisions and studies: short pages that hold, and no reference to one that is not there."""

from __future__ import annotations

import ast
import posixpath
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DECISIONS = {page.name: page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "decisions").glob("[0-9]*.md")}
NUMBERS = {int(name[:4]) for name in DECISIONS}
STUDIES = {f"research/{page.name}": page.read_text(encoding="utf-8") for page in (ROOT / "research").glob("*.md")}
_REFERENCE = re.compile(r"\b[Dd]ecisions? (\d+)\b|docs/decisions/(\d{4})|decisions/(\d{4}-[\w-]+\.md)")
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_HISTORY = ("tests/golden/CHANGED.md", "docs/proof.md")
"""What was written on a day and stays as it was."""


def texts() -> Iterator[tuple[str, str]]:
    """Every text of the repository that may refer to a decision, by its path."""
    for folder in ("src", "docs", "tests", "scripts", "benchmarks", "examples", "research", "lock"):
        for path in sorted((ROOT / folder).rglob("*")):
            name = path.relative_to(ROOT).as_posix()
            if path.suffix in (".py", ".md", ".toml", ".c", ".js") and "/vendor/" not in name and name not in _HISTORY:
                yield name, path.read_text(encoding="utf-8")
    for path in (*ROOT.glob("*.md"), *ROOT.glob("*.toml"), ROOT / "Makefile"):
        yield path.name, path.read_text(encoding="utf-8")


def missing(text: str) -> list[str]:
    """References of a text to decisions that are not there."""
    wrong = []
    for match in _REFERENCE.finditer(text):
        number, short, page = match.groups()
        known = page in DECISIONS if page else int(number or short) in NUMBERS
        wrong += [] if known else [match[0]]
    return wrong


def test_every_reference_to_a_decision_leads_to_its_page() -> None:
    here = Path(__file__).relative_to(ROOT).as_posix()
    assert {name: wrong for name, text in texts() if name != here and (wrong := missing(text))} == {}


def test_a_reference_that_leads_nowhere_is_found() -> None:
    assert missing("see decision 9999 and docs/decisions/9998") == ["decision 9999", "docs/decisions/9998"]
    assert missing("[x](../decisions/0154-nothing.md), decision 154") == ["decisions/0154-nothing.md"]


@pytest.mark.parametrize("name", sorted(DECISIONS))
def test_a_decision_is_a_short_page_that_names_its_code(name: str) -> None:
    text = DECISIONS[name]
    assert text.startswith(f"# {int(name[:4])}. ")
    assert all(f"**{part}.**" in text for part in ("Rule", "Why", "Consequence")), "rule, why, consequence"
    assert len(text.splitlines()) <= 40, "what was tried and measured belongs into research/"
    code = text.partition("**In the code.**")[2]
    for path in re.findall(r"`([\w/.-]+\.\w+)`", code):
        assert (ROOT / "src" / "swashplate" / path).is_file() or (ROOT / path).is_file(), path


def slugs(page: str) -> set[str]:
    """Anchors of a Markdown page's headings."""
    headings = re.findall(r"^#+ (.+)$", page, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("name", sorted(STUDIES))
def test_a_studys_links_lead_somewhere(name: str) -> None:
    for target in _LINK.findall(STUDIES[name]):
        path, _, anchor = target.partition("#")
        place = posixpath.normpath(posixpath.join("research", path)) if path else name
        assert (ROOT / place).is_file(), target
        assert not anchor or anchor in slugs((ROOT / place).read_text(encoding="utf-8")), target


def test_pages_lead_to_studies_that_are_there() -> None:
    for name, text in texts():
        for path, anchor in re.findall(r"\]\((?:\.\./)+(research/[\w./-]+\.md)(?:#([^)]*))?\)", text):
            assert path in STUDIES, f"{name}: {path}"
            assert not anchor or anchor in slugs(STUDIES[path]), f"{name}: {path}#{anchor}"


def test_the_index_of_studies_names_every_study_and_script() -> None:
    index = STUDIES["research/README.md"]
    shared = {"README.md", "flights.py", "held_out.py"}
    there = {path.name for path in (ROOT / "research").iterdir() if path.suffix in (".md", ".py")} - shared
    assert {name for name in there if name not in index} == set()


def test_the_changes_are_short_and_have_no_heading_twice() -> None:
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 150
    for version in "\n".join(lines).split("\n## ")[1:]:
        headings = [line for line in version.splitlines() if line.startswith("### ")]
        assert len(headings) == len(set(headings)), version.splitlines()[0]


def test_no_test_imports_a_script() -> None:
    scripts = {path.stem for path in (ROOT / "scripts").glob("*.py")} - {"docs_pages"}  # that one calls docs/site
    word = re.compile(rf"\b({'|'.join(scripts)})\b")  # only what has one is parsed
    for path in (ROOT / "tests").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if word.search(text) else ():
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not scripts & set(names), path


def test_the_generated_proof_is_out_of_the_readers_path() -> None:
    leading = [name for name, text in texts() if re.search(r"\]\([^)]*proof\.md", text)]
    assert leading.count("README.md") == 1
    users = [n for n in leading if n.startswith("docs/") and not n.startswith(("docs/developers/", "docs/decisions/"))]
    assert users == []
    assert (ROOT / "README.md").read_text(encoding="utf-8").count("docs/proof.md") == 1
