"""The pictures of pages in docs/pictures: those of the newcomers' journeys, the live page and reports, by Chromium.

    python scripts/screenshots.py [NAME ...]

The journeys of tests/browser/test_journeys.py are run and keep their own pictures; `journeys` as NAME runs them alone.
Needs Chromium, playwright, nbclient and the live page's libraries (`make page`). About two minutes of processor time.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"
WIDE = (1280, 800)
CHROMIUM = ("--no-sandbox", "--disable-background-networking", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
SWEEPS = [
    f'simulate --vehicle coax --maneuver "sweep:{axis},0.3-8Hz,40s,0.1" --out {axis}.nc --quiet'
    for axis in ("roll", "pitch")
]
REPORTS: dict[str, tuple[list[str], str]] = {
    # picture: commands, the page that they write
    "report-responses": (
        [
            *SWEEPS,
            "respond roll.nc pitch.nc --inputs servo_roll,servo_pitch --outputs p,q --band 0.3-8 --out responses",
        ],
        "responses/report.html",
    ),
    "report-bench": (
        ["bench simulate records --seed 1 --quiet", "bench records --out card.toml --out bench.html"],
        "bench.html",
    ),
    "report-speed": (["vehicle derivatives raptor50 --speed 0-12/3 --out speed.html"], "speed.html"),
}


def run(line: str, folder: str) -> None:
    """One command of swash; 2 is the exit code of doubts that are part of what it found."""
    import shlex

    done = subprocess.run([sys.executable, "-m", "swashplate", *shlex.split(line)], cwd=folder, check=False)
    if done.returncode not in (0, 2):
        raise SystemExit(f"swash {line}: exit code {done.returncode}")


def picture(browser: Any, url: str, name: str, *, drawn: bool, flying: float = 0.0) -> None:
    """A page's first screen."""
    page = browser.new_page(viewport={"width": WIDE[0], "height": WIDE[1]})
    page.goto(url)
    if drawn:
        page.wait_for_selector("html[data-drawn=all]", state="attached", timeout=60_000)
    if flying:
        page.wait_for_timeout(1e3 * flying)
        page.get_by_role("button", name="Doublet").click()
        page.wait_for_timeout(2.5e3)
    page.wait_for_timeout(500)
    page.screenshot(path=PICTURES / f"{name}.png")
    page.close()
    print("written:", f"docs/pictures/{name}.png")


def live(browser: Any, name: str, vehicle: str) -> None:
    """The live page after a few seconds of flight."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "swashplate", "live", vehicle, "--port", "0"]
        with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True, env=os.environ) as process:
            assert process.stdout is not None
            match = re.search(r"http://\S+", process.stdout.readline())
            try:
                if match is None:
                    raise SystemExit(f"swash live {vehicle} told no address")
                picture(browser, match[0], name, drawn=False, flying=3.0)
            finally:
                process.send_signal(signal.SIGINT)
                process.wait(timeout=20.0)


def journeys() -> None:
    """The newcomers' own pictures, the minute of flight among them."""
    tests = ["tests/browser/test_journeys.py", "-m", "", "-n", "0", "-q", "-k", "not processor and not 5.0"]
    around = {**os.environ, "SWASH_PICTURES": str(PICTURES)}
    subprocess.run([sys.executable, "-m", "pytest", *tests], cwd=PICTURES.parents[1], env=around, check=True)


def main(wanted: list[str]) -> None:
    if not wanted or "journeys" in wanted:
        journeys()
    chromium = next(
        filter(None, map(shutil.which, ("chromium", "chromium-headless-shell", "chromium-browser", "google-chrome"))),
        None,
    )
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(CHROMIUM))
        for name, vehicle in (("live-coax", "coax"),):
            if not wanted or name in wanted:
                live(browser, name, vehicle)
        for name, (lines, page) in REPORTS.items():
            if not wanted or name in wanted:
                with tempfile.TemporaryDirectory() as folder:
                    for line in lines:
                        run(line, folder)
                    picture(browser, (Path(folder) / page).as_uri(), name, drawn=True)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
