"""A real browser for tests of pages, and a page that was opened and drawn in it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

PROGRAMS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
"""First the same engine without the windows of a browser: the pages take it four fifths of the processor time."""

ARGUMENTS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


NO_CARD = ["--disable-gpu"]
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
"""WebGL without a graphics card, for pages that draw in three dimensions; all else is drawn without WebGL."""
_OF_THE_BROWSER = re.compile(
    r"debug|info|warning: \[GroupMarker|warning: \[\.WebGL-\w+\]GL Driver Message .*: GPU stall due to ReadPixels"
)


def complaints(said: list[str]) -> list[str]:
    """Lines of a page's console, less what the browser itself notes about drawing in software."""
    return [line for line in said if not _OF_THE_BROWSER.match(line)]


def running_browser(*, webgl: bool = False) -> Iterator[Any]:
    """Chromium, headless; skips where it or playwright is not installed."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if chromium is None:
        pytest.skip(f"chromium is not installed (Debian: apt-get install {PROGRAMS[0]})")
    with sync_api.sync_playwright() as playwright:
        running = playwright.chromium.launch(
            executable_path=chromium, args=[*ARGUMENTS, *(SOFTWARE if webgl else NO_CARD)]
        )
        yield running
        running.close()


class Visit:
    """A page that was opened and drawn, with what it said and what it asked for."""

    def __init__(self, browser: Any, path: Path, size: tuple[int, int]) -> None:
        self.page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.said.append(f"error: {error}"))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("html[data-drawn=all]", state="attached", timeout=60_000)
