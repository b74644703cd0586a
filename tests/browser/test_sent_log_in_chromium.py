"""A log exported as one HTML file, opened from the disk with the network off: plots, fit, sliders that move margins."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import chromium
import swashplate as sp
from swashplate.api.web_log import export_log
from swashplate.flights.flight import Flight
from swashplate.links.logs.bins import gaps, trace
from swashplate.links.web.libraries import PAGE

LOG = "examples/coax_flight"
SLIDE = """(name) => {
  const slider = document.querySelector(`[data-gain=${name}]`);
  slider.value = 0.3 * slider.value;
  slider.dispatchEvent(new Event("input"));
}"""
ASKED = "([wanted, bins]) => swash.post('/traces', {wanted, bins}).then((told) => told.traces)"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    yield from chromium.running_browser(webgl=True)


@pytest.fixture(scope="module")
def sent(tmp_path_factory: pytest.TempPathFactory) -> Path:
    (file,) = export_log(LOG).save(tmp_path_factory.mktemp("sent"))
    assert file.name == "log.html"
    assert file.stat().st_size <= 5_000_000
    return file


def opened(browser: Any, file: Path, size: tuple[int, int] = (1400, 900)) -> tuple[Any, list[str]]:
    """The page, and what it said and asked for elsewhere than in its own file."""
    context = browser.new_context(offline=True, viewport={"width": size[0], "height": size[1]})
    page, said = context.new_page(), []
    own = (file.as_uri(), "blob:", "data:")
    page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(f"error: {error}"))
    page.on(
        "request", lambda asked: None if asked.url.startswith(own) else said.append(f"error: asked for {asked.url}")
    )
    page.goto(file.as_uri())
    page.locator("html[data-sent=yes][data-drawn]").wait_for(state="attached", timeout=90_000)
    return page, said


def margin(page: Any) -> str:
    row = page.locator("[data-loop=YAW] table.gains tr", has_text="phase margin [deg]")
    return str(row.locator("td").last.inner_text())


def test_plots_are_there_and_sliders_move_margins(browser: Any, sent: Path) -> None:
    page, said = opened(browser, sent)
    assert page.locator(".chart canvas").count() >= 2
    assert "Left out: latitude, longitude, x, y, the map" in page.locator("#sent").text_content()
    assert not page.locator("#choose").is_visible()
    page.locator("[data-loop=YAW][data-drawn]").wait_for()
    before = margin(page)
    page.evaluate(SLIDE, "P")
    end = time.monotonic() + 60.0
    while margin(page) == before:
        assert time.monotonic() < end, "the slider moves no margin"
    assert float(margin(page)) != pytest.approx(float(before), rel=1e-3)
    for view, drawn in (
        ("review", "What happened"),
        ("findings", "log.bin"),
        ("spectrum", "Of the whole log"),
        ("map", "The place was left out of this page."),
        ("track", "The log has no place"),
        ("parameters", "ATC_RAT_YAW_P"),
    ):
        page.click(f"#views [data-view={view}]")
        page.locator(f"#{view}", has_text=drawn).wait_for()
    page.click("#views [data-view=spectrum]")
    page.select_option("#spectrum select", "phi")
    page.locator("#spectrum", has_text="This page holds spectra of p, q, r").wait_for()
    page.click("#views [data-view=identify]")
    page.locator("#identify button.first").first.click()
    page.locator("[data-loop=YAW]").wait_for()
    assert page.locator("#trouble").is_hidden()
    assert not chromium.complaints(said)


def test_on_a_telephone(browser: Any, sent: Path) -> None:
    page, said = opened(browser, sent, (390, 844))
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.click("#views [data-view=plots]")
    page.locator(".chart canvas").first.wait_for()
    assert not chromium.complaints(said)


def test_curves_are_those_of_the_server(browser: Any, sent: Path) -> None:
    """At any zoom, to the 32 bits that a page keeps of a number."""
    page, _ = opened(browser, sent)
    flight = sp.read(LOG)
    for name, start, stop, bins in (
        ("r", 0.0, 1e3, 200),
        ("r", flight.start + 5.0, flight.start + 8.0, 2000),
        ("z", 0.0, 1e3, 100),
    ):
        (found,) = page.evaluate(ASKED, [[[1, name, start, stop]], bins])
        moments, values = flight.time(name), flight.values(name) * (180.0 / np.pi if name == "r" else 1.0)
        wanted = trace(moments, values, start=start, stop=stop, bins=bins, breaks=gaps(moments))
        got = np.array([np.nan if v is None else v for v in found["values"]])
        assert got.size == wanted.values.size
        np.testing.assert_allclose(found["time"], wanted.time, atol=2e-6)
        np.testing.assert_allclose(got, wanted.values, rtol=1e-6, atol=1e-30)
        assert found["thinned"] == wanted.thinned


def test_gaps_stay_and_a_hostile_name_is_text(browser: Any, tmp_path: Path) -> None:
    hostile = "<img src=x onerror=alert(1)>"
    moments = np.concatenate([np.arange(0.0, 8.0, 0.01), np.arange(12.0, 20.0, 0.01)])
    waves = {"p": np.sin(moments), "q": np.cos(moments), hostile: np.sin(2.0 * moments)}
    Flight.from_arrays(moments, waves, source=hostile).save(tmp_path / "<b>log.nc")
    (file,) = export_log(tmp_path / "<b>log.nc", keep=("names", "others"), name="log").save(tmp_path)
    page, said = opened(browser, file)
    assert page.locator("#logs .name").inner_text() == "<b>log.nc"
    page.locator("#search").fill("onerror")
    page.locator("#groups label", has_text=hostile).wait_for()
    (found,) = page.evaluate(ASKED, [[[1, "p", 0.0, 20.0]], 50])
    assert found["values"].count(None) == 1
    assert 8.0 < found["time"][found["values"].index(None)] < 12.0
    assert page.locator("img").count() == 0
    assert not chromium.complaints(said)
