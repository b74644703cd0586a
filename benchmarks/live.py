"""Real time on the live page: time that it loses, its share of the processor, from a stick to its picture.

The page is headless Chromium, which draws in software on the same cores.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any
from urllib.parse import quote

MODEL = "coax"
_SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
# What Chromium itself takes for sixty pictures a second: a canvas of the scene's size, cleared.
_EMPTY = """<canvas width=800 height=500></canvas><script>
const gl = document.querySelector("canvas").getContext("webgl2");
const again = () => { gl.clearColor(Math.random(), 0, 0, 1); gl.clear(16384);
  requestAnimationFrame(again); };
again();
</script>"""
_PICTURES = "Number(document.documentElement.dataset.drawn)"
_ANSWER = """async () => {
  const told = [];
  for (let k = 0; k < 40; k += 1) {
    await new Promise((done) => setTimeout(done, 60 + 40 * Math.random()));
    const before = document.documentElement.dataset.drawn, begun = performance.now();
    swash.sticks.scripted = { roll: 0.05 * (-1) ** k, pitch: 0, yaw: 0, heave: 0 };
    while (document.documentElement.dataset.drawn === before) await new Promise((done) => setTimeout(done));
    told.push(performance.now() - begun);
  }
  return told;
}"""


@dataclass(frozen=True)
class Punctual:
    """One run in real time.

    Attributes:
        name: how it draws.
        late: share of the time that it had to drop [%].
        target: the most that is promised [%].
        pictures: a second.
        page: share of one core that the page took [%].
        empty: that a page took which clears its canvas and does nothing else, in the same run [%].
        drawing: what drawing in software took beside the page [%].
        latency: from a stick to the picture that shows it, median [ms].
        seconds: how long.
        load: other work on the machine, as its load average before.
    """

    name: str
    late: float
    target: float
    pictures: float
    page: float
    empty: float
    drawing: float
    latency: float
    seconds: float
    load: float

    @property
    def met(self) -> bool:
        return self.late <= self.target

    @property
    def note(self) -> str:
        return (
            f"{self.seconds:.0f} s, {self.pictures:.1f} pictures/s, {self.page:.1f} % of a core for the page "
            f"({self.empty:.1f} % for one that only clears its canvas) and "
            f"{self.drawing:.1f} % for drawing, "
            f"{self.latency:.0f} ms from stick to picture, load {self.load:.1f} before"
        )

    def as_json(self) -> dict[str, object]:
        return {**asdict(self), "met": self.met, "note": self.note}


def measure(*, short: bool) -> list[Punctual]:
    """Pictures as without a graphics card, and as many as with one, for 60 s; nothing without Chromium or in short."""
    chromium = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "chromium-browser"))), None)
    if chromium is None or short:
        return []
    return [_drawn(60.0, chromium, every=every) for every in (False, True)]


@contextmanager
def _served() -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "swashplate", "live", MODEL, "--port", "0", "--out", f"{folder}/live"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            match = re.search(r"http://\S+/", process.stdout.readline())
            assert match is not None
            try:
                yield match[0]
            finally:
                process.send_signal(signal.SIGINT)


def _processors() -> dict[str, float]:
    """Seconds of processor that the page and its drawing have used: the youngest of Chromium's processes."""
    found: dict[str, tuple[int, float]] = {}
    for pid in sorted(int(name) for name in os.listdir("/proc") if name.isdigit()):
        try:
            with open(f"/proc/{pid}/cmdline", encoding="utf-8", errors="replace") as words:
                kind = re.search(r"--type=(renderer|gpu-process)", words.read())
            with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
                fields = file.read().rpartition(")")[2].split()
        except OSError:
            continue
        if kind is not None:
            found[kind[1]] = (pid, (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"))
    return {kind: used for kind, (_, used) in found.items()}


def _drawn(seconds: float, chromium: str, *, every: bool) -> Punctual:
    from playwright.sync_api import sync_playwright

    load = os.getloadavg()[0]
    with _served() as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=_SOFTWARE)
        page = browser.new_page(viewport={"width": 1280, "height": 860})
        page.goto(url)
        while not page.evaluate("Boolean(window.swash?.now?.t > 5)"):
            page.wait_for_timeout(200)
        if every:
            page.evaluate("swash.pace.software = false; swash.pace.interval = 0")
        used, before, begun = _processors(), _state(page), time.monotonic()
        time.sleep(seconds)
        after, spent = _state(page), time.monotonic() - begun
        share = {kind: 100.0 * (now - used.get(kind, math.nan)) / spent for kind, now in _processors().items()}
        latency = statistics.median(page.evaluate(_ANSWER))
        page.goto("data:text/html," + quote(_EMPTY))
        time.sleep(2.0)
        used, begun = _processors(), time.monotonic()
        time.sleep(seconds / 6)
        empty = 100.0 * (_processors()["renderer"] - used["renderer"]) / (time.monotonic() - begun)
        browser.close()
    name = "every picture drawn in software" if every else "as without a graphics card"
    lost, pictures = (after[k] - before[k] for k in (0, 1))
    return Punctual(
        name,
        100.0 * lost / spent,
        1.0,
        pictures / spent,
        share["renderer"],
        empty,
        share["gpu-process"],
        latency,
        spent,
        load,
    )


def _state(page: Any) -> list[float]:
    return list(page.evaluate(f"[swash.now.skipped, {_PICTURES}]"))


if __name__ == "__main__":
    for run in measure(short=False):
        print(f"{run.name}: {run.late:.2f} % of the time lost; {run.note}")
