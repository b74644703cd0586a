"""Real time on the live page: steps that come late, the processor's share, and how long a stick takes.

A page here is a program that reads every update (what a browser on another machine costs this one), or headless
Chromium that draws in software on the same cores.
"""

from __future__ import annotations

import asyncio
import json
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

MODEL = "coax"
_SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_STIR = "swash.sticks.scripted = {roll: 0.05 * Math.sign(Math.random() - 0.5), pitch: 0, yaw: 0, heave: 0}"


@dataclass(frozen=True)
class Punctual:
    """One run in real time.

    Attributes:
        name: what looked at it.
        late: share of controller steps that ended more than a period after they were due [%].
        target: the most that is promised [%].
        processor: share of one core that the server took [%].
        updates: of the page per second.
        latency: from a stick to the update that answers it, median [ms].
        seconds: how long.
        load: other work on the machine, as its load average before.
    """

    name: str
    late: float
    target: float
    processor: float
    updates: float
    latency: float
    seconds: float
    load: float

    @property
    def met(self) -> bool:
        return self.late <= self.target

    @property
    def note(self) -> str:
        updates = "" if math.isnan(self.updates) else f"{self.updates:.1f} updates/s, "
        return (
            f"{self.seconds:.0f} s, {updates}{self.processor:.1f} % of a core for the server, "
            f"{self.latency:.0f} ms from stick to page, load {self.load:.1f} before"
        )

    def as_json(self) -> dict[str, object]:
        return {**asdict(self), "met": self.met, "note": self.note}


def measure(*, short: bool) -> list[Punctual]:
    """Both kinds of page for 60 s; the first alone for 2 s in the short form and without Chromium."""
    seconds = 2.0 if short else 60.0
    readings = [_reading(seconds)]
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-headless-shell", "chromium-browser"))), None)
    if chromium is not None and not short:
        readings.append(_drawn(seconds, chromium))
    return readings


@contextmanager
def _served() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "swashplate", "live", MODEL, "--port", "0", "--out", f"{folder}/live"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            match = re.search(r"http://(\S+)/", process.stdout.readline())
            assert match is not None
            try:
                yield match[1], process
            finally:
                process.send_signal(signal.SIGINT)


def _processor(process: subprocess.Popen[str]) -> float:
    """Seconds of processor that a process has used."""
    with open(f"/proc/{process.pid}/stat", encoding="ascii") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _reading(seconds: float) -> Punctual:
    load = os.getloadavg()[0]
    with _served() as (host, process):
        first, last, updates, delays, used = asyncio.run(_follow(host, process, seconds))
    return _told("page on another machine", 0.1, first, last, used, updates / seconds, delays, seconds, load)


async def _follow(host: str, process: subprocess.Popen[str], seconds: float) -> Any:
    from websockets.asyncio.client import connect

    async with connect(f"ws://{host}/socket", origin=f"http://{host}") as page:  # type: ignore[arg-type]
        moment = await _moment(page)
        while moment["t"] < 1.0:
            moment = await _moment(page)
        first, begun, used = moment, time.monotonic(), _processor(process)
        updates, number, sent = 0, 0, {}
        delays: list[float] = []
        while time.monotonic() - begun < seconds:
            if updates % 10 == 0:
                number += 1
                sent[number] = time.monotonic()
                stick = {"roll": 0.05 * (-1) ** number, "pitch": 0, "yaw": 0, "heave": 0, "number": number}
                await page.send(json.dumps({"type": "stick", **stick}))
            moment = await _moment(page)
            updates += 1
            if moment["stick"] in sent:
                delays.append(1000.0 * (time.monotonic() - sent.pop(moment["stick"])))
        return first, moment, updates, delays, _processor(process) - used


async def _moment(page: Any) -> dict[str, Any]:
    while (message := json.loads(await page.recv()))["type"] != "moment":
        pass
    return message  # type: ignore[no-any-return]


def _drawn(seconds: float, chromium: str) -> Punctual:
    from playwright.sync_api import sync_playwright

    load = os.getloadavg()[0]
    with _served() as (host, process), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=_SOFTWARE)
        page = browser.new_page(viewport={"width": 1280, "height": 860})
        page.goto(f"http://{host}/")
        while not page.evaluate("Boolean(window.swash?.now?.t > 5)"):
            page.wait_for_timeout(200)
        first, used = page.evaluate("swash.now"), _processor(process)
        delays = []
        begun = time.monotonic()
        while time.monotonic() - begun < seconds:
            page.evaluate(_STIR)
            page.wait_for_timeout(1000)
            delays.append(page.evaluate("swash.latency") or float("nan"))
        last, spent = page.evaluate("swash.now"), time.monotonic() - begun
        used = _processor(process) - used
        browser.close()
    return _told("headless Chromium, software", 1.0, first, last, used, float("nan"), delays, spent, load)


def _told(
    name: str,
    target: float,
    first: dict[str, Any],
    last: dict[str, Any],
    used: float,
    updates: float,
    delays: list[float],
    seconds: float,
    load: float,
) -> Punctual:
    late = 100.0 * (last["late"] - first["late"]) / max(last["steps"] - first["steps"], 1)
    latency = statistics.median(delays) if delays else float("nan")
    return Punctual(name, late, target, 100.0 * used / seconds, updates, latency, seconds, load)
