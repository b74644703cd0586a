"""The site: it builds without a warning, its links and pictures are there, a browser searches and follows a door.

Building all of it takes half a minute: that is `proof`. What runs always is a site of the pages that a reader comes to
first, and a look at every page's source for what Sphinx would complain about.
"""

from __future__ import annotations

import json
import posixpath
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from html import unescape
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

import swashplate as sp
from chromium import running_browser
from swashplate.models.card import packaged_cards

sphinx = pytest.importorskip("sphinx", reason="the site's packages are not installed")

import build_site  # noqa: E402
import docs_running  # noqa: E402
import real_results  # noqa: E402
import site_pages  # noqa: E402
import site_reference  # noqa: E402
from pygments.filters import ErrorToken  # noqa: E402
from pygments.lexers import get_lexer_by_name  # noqa: E402
from pygments.lexers.special import TextLexer  # noqa: E402
from pygments.util import ClassNotFound  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
_TARGET = re.compile(r'<(?:a|img|script|link)\b[^>]*?\b(?:href|src)="([^"]*)"')
_FENCED = re.compile(r"^(`{3,}).*?^\1$\n?", re.DOTALL | re.MULTILINE)
_ID = re.compile(r'\bid="([^"]+)"')


PAGES = {str(page.relative_to(ROOT / "docs")): page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md")}
_FIRST = ("index.md", "doors/", "notebooks/", "learn.md", "explanation/index.md", "reference/index.md")
_ALSO = ("developers/index.md", "howto/fly-a-sweep.md", "howto/identify-from-a-sweep.md")
_AWAY = ["-D", "suppress_warnings=myst.xref_missing,toc.not_readable"]
"""A small site lacks pages that others lead to; whether they are in the sources is asked of every page's text."""


def built(folder: Path, *options: str, docs: Path = DOCS) -> Path:
    """A site, built as `make site` builds it but for the options."""
    command = [*build_site.command(folder / "site", folder / "known"), *options]
    command[command.index(str(DOCS))] = str(docs)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr + done.stdout
    return folder / "site"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site of `make site`."""
    assert "docs/site/build_site.py" in (ROOT / "Makefile").read_text(encoding="utf-8").partition("\nsite:")[2][:80]
    return built(tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A site of the pages that a reader comes to first."""
    folder = tmp_path_factory.mktemp("site")
    docs = folder / "docs"
    for name in (name for name in PAGES if name.startswith((*_FIRST, *_ALSO))):
        (docs / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(DOCS / name, docs / name)
    shutil.copytree(DOCS / "pictures", docs / "pictures")
    return built(folder, *_AWAY, docs=docs)


def dead_links(site: Path) -> list[str]:
    """Links, pictures and scripts of every page that lead nowhere inside the site, or out of it without http."""
    pages = (page for page in site.rglob("*.html") if "_static" not in page.parts)  # there lie the theme's templates
    texts = {page.resolve(): page.read_text(encoding="utf-8") for page in pages}
    ids = {page: {unescape(name) for name in _ID.findall(text)} for page, text in texts.items()}
    dead = []
    for page, text in texts.items():
        for target in map(unescape, _TARGET.findall(text)):
            if target.startswith(("http://", "https://", "mailto:", "data:")) or target == "#":
                continue
            path, _, anchor = target.partition("#")
            place = (page.parent / unquote(path.partition("?")[0])).resolve() if path else page
            inside = place.is_relative_to(site.resolve()) and place.is_file()
            if not inside or (anchor and place in ids and unquote(anchor) not in ids[place]):
                dead.append(f"{page.relative_to(site.resolve())}: {target}")
    return dead


@pytest.mark.proof
def test_every_page_is_on_the_site_and_every_link_leads_somewhere(whole: Path) -> None:
    pages = {Path(name).with_suffix(".html") for name in PAGES}
    assert {page for page in pages if not (whole / page).is_file()} == set()
    assert dead_links(whole) == []


def test_a_page_of_a_vehicle_flies_it(site: Path) -> None:
    page = (site / "doors" / "get-a-model.html").read_text(encoding="utf-8")
    if find_spec("ziglang") is None:
        assert "<iframe" not in page, "nothing leads to a page that is not there"
        return
    assert 'src="../fly/raptor50.html"' in page
    assert "Content-Security-Policy" in (site / "fly" / "raptor50.html").read_text(encoding="utf-8")
    assert dead_links(site / "fly") == []


def test_every_ready_vehicle_flies_from_the_list_and_the_readme_s_third_door_leads_there(read: dict[str, str]) -> None:
    if find_spec("ziglang") is None:
        pytest.skip("the extra 'compiler' is not installed: nothing makes WebAssembly")
    listed = read["reference/vehicles.md"]
    assert re.findall(r'href="\.\./fly/(\w+)\.html"', listed) == list(packaged_cards())
    opening = (ROOT / "README.md").read_text(encoding="utf-8").partition("\n## Get a model")[2].partition("\n## ")[0]
    assert {"docs/doors/get-a-model.md", "docs/reference/vehicles.md"} <= set(re.findall(r"\]\(([^)]+)\)", opening))
    for page, name in (("doors/get-a-model", "raptor50"), ("explanation/coax-model", "coax")):
        assert f'src="../fly/{name}.html"' in read[f"{page}.md"]


def _headings(page: str) -> list[tuple[int, str]]:
    prose = _FENCED.sub("", page)
    return [(len(marks), words) for marks, words in re.findall(r"^(#+) (.+)$", prose, re.MULTILINE)]


def _coloured(fence: docs_running.Fence) -> str:
    """What the colouring of a fence stumbles over; "" where nothing."""
    try:
        lexer = TextLexer() if fence.language == "csv" else get_lexer_by_name(fence.language)
        lexer.add_filter("raiseonerror")
        list(lexer.get_tokens(fence.text))
    except (ClassNotFound, ErrorToken) as wrong:
        return f"{fence.language}: {wrong}"
    return ""


def complaints(name: str, pages: Mapping[str, str]) -> list[str]:
    """What Sphinx would say about a page: its headings, links, pictures and fences."""
    page = pages[name]
    levels = [level for level, _ in _headings(page)]
    said = [_coloured(fence) for fence in docs_running.fences(page)]
    if levels[:1] != [1] or any(after > before + 1 for before, after in pairwise(levels)):
        said.append(f"headings of the levels {levels}")
    for target in re.findall(r"\]\(([^)\s]+)\)", _FENCED.sub("", page)):
        path, _, anchor = target.partition("#")
        place = posixpath.normpath(posixpath.join(posixpath.dirname(name), path)) if path else name
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        if not (place in pages if place.endswith(".md") else (DOCS / place).is_file()):
            said.append(f"{target} is not there")
        elif anchor:
            slugs = {re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-") for _, words in _headings(pages[place])}
            said += [] if anchor in slugs else [f"{target} has no such heading"]
    return [each for each in said if each]


@pytest.fixture(scope="module")
def read() -> dict[str, str]:
    """Every page as Sphinx gets it."""
    made = {name: [text] for name, text in PAGES.items()}
    for name, source in made.items():
        site_pages._read(None, name.removesuffix(".md"), source)
    return {name: source[0] for name, source in made.items()}


def test_no_page_gives_sphinx_a_reason_to_complain(read: dict[str, str]) -> None:
    assert {name: said for name in read if (said := complaints(name, read))} == {}


def test_every_page_is_in_the_navigation(read: dict[str, str]) -> None:
    """Sphinx says so too, when it builds the whole site."""
    seen, waiting = set(), ["index"]
    while waiting:
        page = waiting.pop()
        seen.add(page)
        trees = re.findall(r"^```\{toctree\}\n(?::[^\n]*\n)*\n(.*?)\n```", read[f"{page}.md"], re.DOTALL | re.MULTILINE)
        below = [posixpath.normpath(posixpath.join(posixpath.dirname(page), n)) for t in trees for n in t.split()]
        waiting += [each for each in below if each not in seen]
    assert sorted(name for name in read if name.removesuffix(".md") not in seen) == []


def test_what_sphinx_would_complain_about_is_found() -> None:
    pages = {
        "a/one.md": "# One\n\n### Deep\n\n[x](two.md#here) [y](two.md#gone) [z](three.md)\n\n![p](../pictures/no.png)",
        "a/two.md": "# Two\n\n## Here\n\n```jsonn\n{}\n```\n\n```json\n{'a'}\n```\n",
    }
    assert complaints("a/one.md", pages) == [
        "headings of the levels [1, 3]",
        "two.md#gone has no such heading",
        "three.md is not there",
        "../pictures/no.png is not there",
    ]
    assert [said.split(":")[0] for said in complaints("a/two.md", pages)] == ["jsonn", "json"]


def test_a_dead_link_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text('<a href="b.html#here">b</a><a href="#gone">x</a><img src="c.png">')
    (tmp_path / "b.html").write_text(
        '<p id="here"></p><a href="../away.html">out</a><a href="https://example.org">y</a>'
    )
    assert sorted(dead_links(tmp_path)) == ["a.html: #gone", "a.html: c.png", "b.html: ../away.html"]


def test_the_python_reference_has_every_public_name_with_its_signature(read: dict[str, str]) -> None:
    assert set(site_reference.places()) == set(sp.__all__) - {"__version__"}
    text = read["reference/python.md"]
    defined = set(re.findall(r"^`{5}\{py:\w+\} (\w+)", text, re.MULTILINE))
    assert defined == set(site_reference.places())
    assert re.search(r"^`{5}\{py:function\} \w+\(.*keep_unexcited: bool = False", text, re.MULTILINE)
    assert "in SI units, radians, NED and FRD" in text


@pytest.mark.proof
def test_the_reference_on_the_site_has_every_public_name_with_its_signature(whole: Path) -> None:
    text = (whole / "reference" / "python.html").read_text(encoding="utf-8")
    missing = [name for name in site_reference.places() if f'id="swashplate.{name}"' not in text]
    assert missing == []
    plain = unescape(re.sub(r"<[^>]+>", "", text))
    assert "keep_unexcited: bool = False" in plain
    assert "in SI units, radians, NED and FRD" in plain


def test_a_worked_example_is_a_notebook_too(site: Path) -> None:
    made = sorted((site / "notebooks").glob("*.ipynb"))
    assert [file.stem for file in made] == sorted(page.stem for page in (ROOT / "docs" / "notebooks").glob("*.md"))
    page = (ROOT / "docs" / "notebooks" / f"{made[0].stem}.md").read_text(encoding="utf-8")
    cells = json.loads(made[0].read_text(encoding="utf-8"))["cells"]
    code = [cell["source"] + "\n" for cell in cells if cell["cell_type"] == "code"]
    assert code == [fence.text for fence in docs_running.fences(page) if fence.language == "python"]
    assert cells[0]["source"].startswith("# ")


def test_navigation_is_the_pages_own_lists() -> None:
    page = (
        "# A\n\n<!-- navigation -->\n\n## Fly\n\n* [One](one.md): first\n* no page\n\n## Rest\n\nSee [two](two.md).\n"
    )
    assert site_pages.navigation(page) == "```{toctree}\n:hidden:\n:caption: Fly\n\none\n```"


def test_the_navigation_above_is_by_door(site: Path) -> None:
    """What stands first on every page: the three doors, then learning, explanations, reference, developers."""
    above = re.search(r'<ul class="bd-navbar-elements.*?</ul>', (site / "index.html").read_text(), re.DOTALL)
    assert above is not None
    found = [" ".join(text.split()) for text in re.findall(r"<a[^>]*>([^<]+)</a>", above[0])]
    doors = ["Tune an autopilot", "Identify from flights", "Get a model"]
    assert found == [*doors, "Learn", "Explanations", "Reference", "For developers"]


def test_verdicts_that_have_another_form_are_refused() -> None:
    page = real_results.PAGE.read_text(encoding="utf-8")
    assert len(real_results.directions(page)) == 2
    with pytest.raises(ValueError, match="two directions"):
        real_results.directions(page.replace("**poor**", "**splendid**"))
    with pytest.raises(ValueError, match="two directions"):
        real_results.directions(page.replace("## Learnt in July, predicting August", "## The other way round"))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    yield from running_browser()


@pytest.mark.parametrize("size", [(1280, 900), (390, 844)], ids=["desk", "telephone"])
def test_a_reader_searches_a_word_and_follows_a_door(browser: Any, site: Path, size: tuple[int, int]) -> None:
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    said: list[str] = []
    asked: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url))
    page.goto((site / "index.html").as_uri())
    for door in ("Tune an autopilot", "Identify from motion capture", "Get a model"):
        assert page.locator("h2", has_text=door).is_visible()
    assert page.locator(".bd-article img").count() >= 3

    page.locator("button.search-button__button:visible, button.search-button:visible").first.click()
    page.locator("dialog input[name=q], .search-button__search-container input[name=q]").first.fill("coherence")
    page.keyboard.press("Enter")
    page.wait_for_url("**/search.html?*")
    page.locator("#search-results li a[href*='howto/identify-from-a-sweep.html']").first.wait_for()
    weighed = "name => Scorer.score([name, '', '', '', 100, ''])"
    user, decision, proof = (page.evaluate(weighed, n) for n in ("howto/install", "decisions/0001-x", "proof"))
    assert user == 100 > decision > proof, "pages of users come first"

    page.goto((site / "index.html").as_uri())
    page.locator(".bd-article a[href='doors/tune-an-autopilot.html']").first.click()
    page.wait_for_url("**/doors/tune-an-autopilot.html")
    page.locator(".bd-article a[href$='howto/fly-a-sweep.html']").click()
    page.wait_for_url("**/howto/fly-a-sweep.html")
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert said == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in asked)
    page.close()
