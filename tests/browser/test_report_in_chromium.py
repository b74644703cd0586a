"""The report in a real browser: every plot drawn, no error, nothing fetched, readable on a telephone and on paper."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest

import swashplate as sp
from chromium import Visit, running_browser
from report_samples import fit, modes, validation
from swashplate.control.analysis.check import check_controller
from swashplate.control.analysis.straightness import step_run
from swashplate.reporting.control_check import compose_check
from swashplate.reporting.html import write_page
from swashplate.reporting.report import report
from swashplate.reporting.straightness import compose_straightness
from swashplate.reporting.structure import Report

NASTY = "<script>document.title='broken'</script><img src=x onerror=\"document.title='broken'\">.mat"
SIZES = {"desk": (1200, 900), "telephone": (390, 844)}


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    yield from running_browser()


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("reports")
    return {
        "both": report(fit(name=NASTY), validation(name=NASTY), path=folder / "both.html", modes=modes()),
        "failed": report(fit(failed=True, simulated=True), path=folder / "failed.html", modes=modes()),
        "validation": report(None, validation(), path=folder / "validation.html", modes=modes()),
    }


@pytest.fixture(scope="module")
def controllers(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Reports about a controller, each made when it is asked for: its check, and the paper's comparison of paths."""
    folder = tmp_path_factory.mktemp("controllers")
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)

    def composed(name: str) -> Report:
        if name == "check":
            return compose_check(check_controller(coax, sp.autopilot(coax, hover), hover, duration=6.0))
        runs = {
            law: step_run(coax, sp.autopilot(coax, hover, mode="manual", decoupled=by), hover, command=0.2)
            for law, by in (("without", False), ("with", True))
        }
        return compose_straightness(coax, runs, command=0.2, lag=17.0)

    return lru_cache(lambda name: write_page(folder / f"{name}.html", composed(name)))


@pytest.fixture(scope="module")
def visit(browser: Any, written: dict[str, Path], controllers: Callable[[str], Path]) -> Any:
    """Opens a report at a size, once for all tests: reading plotly takes a browser seconds."""
    visits: dict[tuple[str, str], Visit] = {}

    def open_(name: str, size: str) -> Visit:
        if (name, size) not in visits:
            visits[name, size] = Visit(browser, written.get(name) or controllers(name), SIZES[size])
        return visits[name, size]

    return open_


def asks_for_nothing(seen: Visit) -> None:
    """It neither complains nor fetches anything from outside."""
    assert seen.said == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in seen.asked)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("both", "desk"),
        ("failed", "telephone"),
        pytest.param("both", "telephone", marks=pytest.mark.proof),
        pytest.param("validation", "desk", marks=pytest.mark.proof),
    ],
)
def test_draws_everything_and_fetches_nothing(visit: Any, name: str, size: str) -> None:
    seen = visit(name, size)
    asks_for_nothing(seen)
    drawn = seen.page.evaluate(
        "Array.from(document.querySelectorAll('.canvas'), c => ({svg: c.querySelectorAll('svg.main-svg').length,"
        " marks: c.querySelectorAll('.trace, .hm, .point').length, width: c.clientWidth,"
        " drawing: c.querySelector('svg.main-svg').clientWidth}))"
    )
    assert len(drawn) > 4
    assert all(each["svg"] > 0 and each["marks"] > 0 for each in drawn)
    assert all(abs(each["drawing"] - each["width"]) <= 1 for each in drawn)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("check", "telephone"),
        pytest.param("check", "desk", marks=pytest.mark.proof),
        pytest.param("path", "telephone", marks=pytest.mark.proof),
    ],
)
def test_reports_about_controllers_draw_everything_in_its_place(visit: Any, name: str, size: str) -> None:
    seen = visit(name, size)
    asks_for_nothing(seen)
    page = seen.page
    names = page.evaluate("Array.from(document.querySelectorAll('[id]'), e => e.id)")
    names = [n for n in names if "-" in n or n.isalpha()]  # plotly's own are random
    assert len(names) == len(set(names)), "two things of one name: a plot would land in the other"
    drawn = page.evaluate(
        "Array.from(document.querySelectorAll('.canvas'), c => c.querySelectorAll('svg.main-svg').length > 0"
        " && c.querySelectorAll('.trace').length > 0)"
    )
    assert len(drawn) == {"check": 5, "path": 2}[name]
    assert all(drawn)
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= SIZES[size][0]


@pytest.mark.parametrize("name", ["failed", pytest.param("both", marks=pytest.mark.proof)])
def test_nothing_overflows_a_telephone(visit: Any, name: str) -> None:
    page = visit(name, "telephone").page
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= SIZES["telephone"][0]
    outside = page.evaluate(
        "Array.from(document.querySelectorAll('h1,h2,h3,p,li,dd,dt,figcaption,.canvas,.wide')).filter(e =>"
        " !e.closest('.wide') && e.getBoundingClientRect().right > window.innerWidth + 1)"
        ".map(e => e.outerHTML.slice(0, 80))"
    )
    assert outside == []
    sizes = page.evaluate(
        "Array.from(document.querySelectorAll('p,li,dd,td,th,figcaption'),"
        " e => parseFloat(getComputedStyle(e).fontSize))"
    )
    assert min(sizes) >= 12.0
    scrolling = page.evaluate(
        "Array.from(document.querySelectorAll('.table .wide')).some(e => e.scrollWidth > e.clientWidth)"
    )
    assert scrolling, "wide tables scroll in their own box"


def test_verdict_warnings_and_picture_are_seen_without_scrolling(visit: Any) -> None:
    page = visit("both", "desk").page
    page.evaluate("window.scrollTo(0, 0)")
    for part in (".summary", ".first table", "#key-picture"):
        assert page.evaluate(f"document.querySelector('{part}').getBoundingClientRect().bottom") < SIZES["desk"][1], (
            part
        )
    assert page.locator(".summary dt").all_inner_texts()[:2] == ["Verdict", "Warnings"]


def test_what_is_open_is_short_and_the_rest_opens(browser: Any, written: dict[str, Path]) -> None:
    page = Visit(browser, written["both"], SIZES["desk"]).page
    tall = page.evaluate("document.documentElement.scrollHeight")
    assert tall < 2000
    assert len(page.evaluate("document.body.innerText").split()) < 700
    page.locator("summary", has_text="How well does it predict").click()
    assert page.locator("#prediction figure").first.is_visible()
    assert page.evaluate("document.documentElement.scrollHeight") > tall + 1000
    page.close()


def test_simulated_and_failed_are_the_first_thing_seen(visit: Any) -> None:
    page = visit("failed", "telephone").page
    banners = page.locator(".banner")
    assert banners.nth(0).inner_text().startswith("SIMULATED FLIGHT")
    assert banners.nth(1).inner_text().startswith("FAILED FIT")
    assert banners.nth(0).bounding_box()["y"] <= 1.0


def test_names_from_files_run_nothing(visit: Any) -> None:
    page = visit("both", "desk").page
    assert page.title() != "broken"
    assert page.locator("img").count() == 0
    assert "<script>" in page.locator(".summary").inner_text()


def test_a_parameter_leads_to_its_meaning(visit: Any) -> None:
    page = visit("both", "desk").page
    page.locator("#parameters summary").click()
    page.locator("#parameters a", has_text="tau_f_upper").click()
    target = page.locator("#meaning-tau_f_upper")
    target.wait_for(state="visible", timeout=5000)
    assert "stabilizer bar" in target.locator("xpath=..").inner_text()


def test_panels_zoom_in_time_together(visit: Any) -> None:
    page = visit("both", "desk").page
    page.evaluate("Plotly.relayout('prediction-1-tilt', {'xaxis.range': [3, 5]})")
    ranges = page.evaluate(
        "Object.entries(document.getElementById('prediction-1-tilt')._fullLayout)"
        ".filter(e => /^xaxis/.test(e[0])).map(e => e[1].range)"
    )
    assert len(ranges) == 5
    assert all(found == [3, 5] for found in ranges)


def test_a_reader_chooses_dark_and_the_unit_of_frequency(visit: Any) -> None:
    seen = visit("check", "telephone")
    page = seen.page
    first = "(document.getElementById('loops-bode')._fullData[0].x[0])"
    title = "document.getElementById('loops-bode')._fullLayout.xaxis2.title.text"
    before = page.evaluate(first)
    assert page.evaluate(title) == "frequency [rad/s]"
    page.click("#unit")
    page.wait_for_selector("html[data-drawn=all]", state="attached")
    assert page.evaluate(title) == "frequency [Hz]"
    assert page.evaluate(first) == pytest.approx(before / (2.0 * math.pi))
    light = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.click("#look")
    page.wait_for_selector("html[data-drawn=all]", state="attached")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != light
    assert page.evaluate("document.getElementById('loops-bode')._fullLayout.paper_bgcolor") == "#15191e"
    assert page.evaluate(title) == "frequency [Hz]", "the unit stays"
    page.pdf(format="A4")
    assert page.locator("#look").inner_text() == "Light", "paper is printed light, the screen stays dark"
    assert seen.said == []


def test_paper_shows_folded_sections(visit: Any, tmp_path: Path) -> None:
    page = visit("both", "desk").page  # last, for it is drawn anew
    content = page.pdf(path=str(tmp_path / "report.pdf"), format="A4")
    assert content.startswith(b"%PDF")
    assert page.evaluate("document.querySelectorAll('.canvas svg.main-svg').length") > 0
