"""The small interactive pictures of the explanation pages: offline, in a frame, and number for number Python's."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import step_picture

import chromium
import swashplate as sp
from swashplate.links.web.libraries import PAGE

LARGEST = 150_000
"""Bytes of one, with all its scripts."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not (PAGE / "vendor" / "uPlot.esm.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    if find_spec("ziglang") is None:
        pytest.skip("the extra 'compiler' is not installed: nothing makes WebAssembly")
    yield from chromium.running_browser()


def flown_here(name: str, *, bar: bool, speed: float, values: dict[str, float], moved: int, size: float) -> np.ndarray:
    """States of each step, shape (n, states)."""
    vehicle = sp.vehicle(name, bar=bar).with_values(values)
    trim = sp.trim(sp.vehicle(name, bar=bar), speed=speed)
    steps = round(step_picture.SECONDS / step_picture.DT)
    low, high = vehicle.input_limits[moved]
    row = np.array(trim.inputs)
    row[moved] += size * (high - low)
    flight = sp.simulate(vehicle, np.tile(row, (steps + 1, 1)), start=trim, rate=1.0 / step_picture.DT, substeps=1)
    return np.stack([flight.values(state) for state in vehicle.state_names], axis=1)


CASES = [
    ("coax", "bar", 2, [({"craft": 0}, {"bar": True}), ({"craft": 1}, {"bar": False})]),
    ("raptor50", "bar", 2, [({"craft": 1}, {"bar": True})]),
    (
        "raptor50",
        "wake_distortion",
        1,
        [({"knob": k_r}, {"bar": False, "values": {"wake_distortion": k_r}}) for k_r in (0.0, 1.5, 3.0)],
    ),
    ("raptor50", "speed", 2, [({"speed": speed}, {"bar": False, "speed": float(speed)}) for speed in (0, 7, 20)]),
]


@pytest.mark.parametrize(
    ("name", "knob", "moved", "settings"), CASES, ids=lambda case: case if isinstance(case, str) else ""
)
def test_it_is_python_number_for_number(
    browser: Any, name: str, knob: str, moved: int, settings: list[Any], tmp_path: Path
) -> None:
    text = step_picture.step_picture(name, knob)
    assert len(text.encode()) <= LARGEST
    (tmp_path / "picture.html").write_text(text, encoding="utf-8")
    may = 'sandbox="allow-scripts allow-downloads"'
    (tmp_path / "frame.html").write_text(f'<iframe src="picture.html" {may}></iframe>', encoding="utf-8")
    page, said = browser.new_context(offline=True).new_page(), []
    page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(f"error: {error}"))
    page.on("request", lambda request: said.append(f"error: {request.url}") if request.url.startswith("http") else None)
    page.goto((tmp_path / "frame.html").as_uri())
    page.frame_locator("iframe").locator("html[data-drawn]").wait_for(state="attached", timeout=60_000)
    frame = page.frames[1]
    sizes = []
    for there, here in settings:
        asked = {"craft": 0, "speed": 0, "knob": 1.5, "input": moved, "size": 0.05, **there}
        states = np.array(frame.evaluate("asked => step.flown(asked)", asked))
        expected = flown_here(name, **{"speed": 0.0, "values": {}, "moved": moved, "size": 0.05, **here})
        assert states.shape == expected.shape
        np.testing.assert_allclose(states, expected, rtol=1e-9, atol=1e-9)
        assert np.ptp(expected[:, 9:12]) > 0.1, "it did turn"
        sizes.append(float(expected[-1, 9]))
    assert len({round(size, 6) for size in sizes}) == len(settings), "what is moved moves the answer"
    assert not chromium.complaints(said)


def test_a_slider_draws_anew_and_speed_beyond_the_card_is_told(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "picture.html").write_text(step_picture.step_picture("raptor50", "speed"), encoding="utf-8")
    page = browser.new_context(offline=True, viewport={"width": 390, "height": 700}).new_page()
    page.goto((tmp_path / "picture.html").as_uri())
    page.locator("html[data-drawn='1']").wait_for(state="attached", timeout=60_000)
    assert "may be trusted" not in page.locator("#words").inner_text()
    page.get_by_label("speed").evaluate("one => { one.value = 20; one.dispatchEvent(new Event('input')); }")
    page.locator("html[data-drawn='2']").wait_for(state="attached")
    assert "20 m/s. Dashed" in page.locator("#words").inner_text()
    assert "The card may be trusted up to 15 m/s only." in page.locator("#words").inner_text()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
