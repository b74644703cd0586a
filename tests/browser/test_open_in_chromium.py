"""The page of `swash open` in Chromium: logs dropped onto it, plotted, mended, looked at, on a desk and a telephone."""

from __future__ import annotations

import base64
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `live` is not installed")

import chromium
from logs_page import table
from swashplate.links.web.libraries import PAGE

SIZES = {"desk": (1400, 900), "telephone": (390, 844)}
servers: dict[str, int] = {}
"""Process by address."""
_WAIT = 60.0  # s; a busy machine draws slowly


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not (PAGE / "vendor" / "uPlot.esm.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    yield from chromium.running_browser(webgl=True)


@contextmanager
def served(*arguments: str | Path, cwd: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "swashplate", "open", *map(str, arguments), "--port", "0"]
    with subprocess.Popen(command, cwd=cwd, stdout=subprocess.PIPE, text=True, env=os.environ) as process:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        servers[found[0]] = process.pid
        try:
            yield found[0]
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=20.0)


@pytest.fixture(scope="module")
def address(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with served(cwd=tmp_path_factory.mktemp("open")) as url:
        yield url


class Visit:
    """The opened page, what it complained about, and how often it was clicked."""

    def __init__(self, browser: Any, url: str, size: str = "desk", theme: str = "light", *, clear: bool = True) -> None:
        width, height = SIZES[size]
        self.page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.said.append(f"error: {error}"))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.url, self.width = url, width
        self.page.goto(url, timeout=1000.0 * _WAIT)
        self.until("document.documentElement.dataset.ready")
        if clear and self.of("swash.state.logs.size"):  # an earlier test failed half way
            self.of("Promise.all([...swash.state.logs.keys()].map(log => swash.post('/close', {log})))")
            self.page.reload()
            self.until("document.documentElement.dataset.ready")
            self.said.clear()

    def of(self, expression: str) -> Any:
        return self.page.evaluate(expression)

    def until(self, condition: str, *, seconds: float = _WAIT) -> None:
        """Asks again and again: a condition as text may not run inside a page that forbids `eval`."""
        end = time.monotonic() + seconds
        while not self.of(f"Boolean({condition})"):
            assert time.monotonic() < end, f"never came true: {condition}"
            self.page.wait_for_timeout(50)

    def drop(self, *files: Path) -> None:
        """Files dropped onto the page, as a hand does it."""
        contents = [[path.name, base64.b64encode(path.read_bytes()).decode()] for path in files]
        self.page.evaluate(
            """files => {
                const carried = new DataTransfer();
                for (const [name, text] of files)
                    carried.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
                for (const kind of ["dragenter", "drop"])
                    window.dispatchEvent(new DragEvent(kind, {dataTransfer: carried, bubbles: true, cancelable: true}));
            }""",
            contents,
        )

    def view(self, name: str) -> None:
        self.page.click(f"#views [data-view={name}]")

    def text(self, selector: str) -> str:
        return str(self.page.locator(selector).inner_text())

    def close(self, *, complaints: int = 0) -> None:
        errors = chromium.complaints(self.said)
        assert len(errors) == complaints, errors
        assert all(url.startswith((self.url, "data:")) for url in self.asked)
        assert self.of("document.documentElement.scrollWidth") <= self.width
        self.of("Promise.all([...swash.state.logs.keys()].map(log => swash.post('/close', {log})))")
        self.page.close()


def drawn(visit: Visit, *, logs: int = 1) -> None:
    checked = "swash.state.ready().every((log) => log.checked)"
    visit.until(f"swash.state.ready().length === {logs} && {checked} && document.documentElement.dataset.drawn")
    visit.until("document.querySelectorAll('.chart canvas').length > 0")


def test_a_dropped_log_is_drawn_zoomed_and_searched(browser: Any, address: str, tmp_path: Path) -> None:
    table(tmp_path / "flight.csv")
    visit = Visit(browser, address)
    assert "Drop a flight log here" in visit.text("#empty")
    visit.drop(tmp_path / "flight.csv")
    drawn(visit)
    titles = visit.of("[...document.querySelectorAll('.chart strong')].map(e => e.textContent)")
    assert titles == ["Rates [deg/s]", "Attitude [deg]"]
    over = visit.page.locator(".u-over").first.bounding_box()
    visit.page.mouse.move(over["x"] + 0.25 * over["width"], over["y"] + 50)
    visit.page.mouse.down()
    visit.page.mouse.move(over["x"] + 0.5 * over["width"], over["y"] + 55, steps=4)
    visit.page.mouse.up()
    visit.until("swash.state.seen.high - swash.state.seen.low < 8")
    low, high = visit.of("[swash.state.seen.low, swash.state.seen.high]")
    assert (low, high) == pytest.approx((7.5, 15.0), abs=0.3)
    assert re.fullmatch(r"7\.\d\d to 1[45]\.\d\d s", visit.text("#span"))
    visit.page.mouse.move(over["x"] + 0.5 * over["width"], over["y"] + 50)
    visit.until("document.querySelector('.chart output').textContent !== ''")
    visit.page.click("[data-do=back]")
    visit.until("swash.state.seen.high - swash.state.seen.low > 29")
    visit.page.fill("#search", "pitch rate")
    visit.until("document.querySelectorAll('#groups input').length === 1")
    visit.page.uncheck("[data-channel=q]")
    visit.until("[...document.querySelectorAll('.chart .key')].length === 3")
    visit.close()


def test_a_card_opens_a_flight_that_ships_and_names_its_command(browser: Any, address: str) -> None:
    visit = Visit(browser, address)
    assert visit.of("getComputedStyle(document.getElementById('views')).display") == "none", "nothing to view yet"
    visit.page.click("[data-try='helicopter_sweeps.bin']")
    drawn(visit)
    titles = visit.of("[...document.querySelectorAll('.chart strong')].map(e => e.textContent)")
    assert titles[:3] == ["Roll rate [deg/s]", "Pitch rate [deg/s]", "Yaw rate [deg/s]"], "target and actual first"
    visit.page.fill("#search", "vibe")
    visit.until("document.querySelector('[data-channel=\"VIBE.VibeX\"]')")
    visit.page.check("[data-channel='VIBE.VibeX']")
    visit.until("document.querySelector('[data-chart=VIBE] canvas')")
    over = visit.page.locator(".u-over").first.bounding_box()
    visit.page.mouse.click(over["x"] + 0.25 * over["width"], over["y"] + 50)
    visit.page.mouse.move(over["x"] + 0.5 * over["width"], over["y"] + 50, steps=3)
    visit.until("/Δ 2[23]\\.\\d+ s/.test(document.getElementById('cursor').textContent)")
    assert visit.of("document.querySelectorAll('.chart output i').length") >= 6
    visit.view("map")
    visit.until("document.getElementById('map').dataset.drawn")
    visit.page.keyboard.press("Escape")
    visit.until("!/Δ/.test(document.getElementById('map').innerText)")
    visit.until("document.querySelector('#sweeps button')?.textContent === 'Identify them together'")
    visit.view("code")
    codes = visit.of("[...document.querySelectorAll('[data-code=\"Command line\"]')].map(e => e.textContent)")
    assert "swash inspect examples/helicopter_sweeps.bin" in codes
    visit.close()


@pytest.mark.parametrize(("size", "theme"), [("desk", "dark"), ("telephone", "light")])
def test_an_ordinary_flight_is_answered(size: str, theme: str, browser: Any, address: str) -> None:
    """On a desk unasked; an incident is a time in the plots."""
    visit = Visit(browser, address, size, theme)
    visit.page.click("[data-try='ordinary_flight.bin']")
    drawn(visit)
    if size == "telephone":
        visit.view("review")
    visit.until("document.getElementById('review').dataset.drawn")
    told = visit.text("#review")
    for words in ("oscillat", "Step response, roll", "Noise of p", "SID_AXIS"):
        assert words in told
    visit.page.locator("#review tr.go").first.click()
    visit.until("swash.state.seen.low > 90 && swash.state.seen.high < 120")
    visit.close()


def test_a_strangers_table_is_mapped_in_a_dialog(browser: Any, address: str, tmp_path: Path) -> None:
    wave = np.sin(0.04 * np.arange(500))
    rows = (f"{0.01 * k:.2f};{20 * x:.3f};{-50 * x:.3f}".replace(".", ",") for k, x in enumerate(wave.tolist()))
    (tmp_path / "flug.csv").write_text("\n".join(["Zeit;Rollrate (deg/s);Querruder %", *rows]) + "\n")
    visit = Visit(browser, address)
    visit.drop(tmp_path / "flug.csv")
    visit.until("document.getElementById('columns').open")
    row = "tr[data-column=Querruder]"
    assert visit.page.locator(f"{row} input[list]").input_value() == "mixer_roll"
    before = visit.page.locator(f"{row} polyline").get_attribute("points")
    visit.page.check(f"{row} input[type=checkbox]")
    assert visit.page.locator(f"{row} polyline").get_attribute("points") != before, "the curve turns with its sign"
    visit.page.click("#map-apply")
    visit.until("!document.getElementById('columns').open")
    visit.until("swash.state.ready()[0].groups.map((g) => g.title).join() === 'Rates,Commands'")
    visit.drop(tmp_path / "flug.csv")
    drawn(visit, logs=2)
    assert not visit.of("document.getElementById('columns').open"), "the next one opens by itself"
    visit.close()


def test_a_flipped_gyro_is_told_and_mended_by_its_button(browser: Any, address: str, tmp_path: Path) -> None:
    table(tmp_path / "flipped.csv", flip=True)
    visit = Visit(browser, address)
    visit.drop(tmp_path / "flipped.csv")
    drawn(visit)
    assert "p: has the other sign" in visit.text("#findings")
    visit.page.click("[data-remedy='--unit p=-rad/s']")
    visit.until("document.getElementById('findings').innerText.includes('Nothing was found wrong')")
    visit.view("code")
    codes = visit.of("[...document.querySelectorAll('[data-code=\"Command line\"]')].map(e => e.textContent)")
    assert "swash inspect flipped.csv --unit p=-rad/s" in codes
    visit.close()


def test_two_logs_lie_over_each_other_and_are_aligned(browser: Any, address: str, tmp_path: Path) -> None:
    table(tmp_path / "one.csv", seed=4)
    table(tmp_path / "two.csv", seed=4, shift=2.5)
    visit = Visit(browser, address)
    visit.drop(tmp_path / "one.csv", tmp_path / "two.csv")
    drawn(visit, logs=2)
    offsets = "[...swash.state.offsets.values()]"
    assert visit.of(offsets) == [-2.5], "they begin together"
    box = visit.page.locator("#logs input[type=number]")
    box.fill("1")
    table(tmp_path / "three.csv", seed=5)
    visit.drop(tmp_path / "three.csv")
    drawn(visit, logs=3)
    assert box.first.input_value() == "1", "what is typed stays while another log is read"
    box.first.press("Enter")
    visit.until(f"{offsets}[0] === 1")
    visit.page.locator("text=Align by motion").first.click()
    visit.until(f"Math.abs({offsets}[0] + 2.5) < 0.01")
    assert "correlation" in visit.text("#state")
    visit.page.click("[aria-label='close three.csv']")
    drawn(visit, logs=2)
    assert visit.of("document.querySelectorAll('.chart')[0].querySelectorAll('.key').length") == 4
    visit.page.click("[aria-label='close one.csv']")
    drawn(visit)
    assert visit.of("swash.state.offset(swash.state.ready()[0])") == 0, "what stays first is on its own clock"
    assert visit.text("#span").startswith("2.50 to")
    visit.close()


def test_what_is_no_log_gives_a_message(browser: Any, address: str, tmp_path: Path) -> None:
    """One after the other on one page."""
    visit = Visit(browser, address)
    for name, content, words in (
        ("photo.jpg", b"\xff\xd8\xff\xe0" + bytes(200), "no flight log that is known"),
        ("words.csv", b"these are words\nno numbers\n", "It cannot be read"),
        ("empty.bin", b"", "is empty"),
    ):
        (tmp_path / name).write_bytes(content)
        visit.drop(tmp_path / name)
        visit.until(f"document.body.innerText.split({name!r}).at(-1).includes({words!r})")
        assert "Traceback" not in visit.text("body")
        assert len(chromium.complaints(visit.said)) == (0 if content else 1)  # of a request that was refused
    visit.close(complaints=1)


def test_a_telephone_shows_one_view_at_a_time(browser: Any, address: str, tmp_path: Path) -> None:
    table(tmp_path / "flight.csv")
    visit = Visit(browser, address, "telephone", "dark")
    assert visit.of("document.documentElement.dataset.theme") == "dark"
    visit.drop(tmp_path / "flight.csv")
    drawn(visit)
    for name in ("channels", "plots", "findings", "events", "parameters", "code"):
        visit.view(name)
        assert visit.of("document.documentElement.scrollWidth") <= SIZES["telephone"][0], name
        seen = visit.of("['channels', 'plots', 'detail'].filter(id => document.getElementById(id).offsetParent)")
        assert seen == [name if name in ("channels", "plots") else "detail"]
    visit.page.click("#theme")
    assert visit.of("document.documentElement.dataset.theme") == "light"
    visit.view("channels")
    visit.page.click("#logs button[aria-label^=close]")
    visit.close()


CANCEL_AT_ONCE = """() => new MutationObserver((_, watching) => {
  if (!document.getElementById("cancel")) return;
  watching.disconnect();
  document.getElementById("cancel").click();
}).observe(document.getElementById("identify"), { childList: true, subtree: true })"""
"""The button is clicked when it appears: on a busy machine an identification ends before a hand gets there."""


def test_a_real_log_has_its_sweep_modes_and_parameters(browser: Any, shared_data: Path, tmp_path: Path) -> None:
    """And an identification of its sweep is cancelled."""
    log = shared_data / "ardupilot_sitl" / "heli_sid_allbits_roll_rate.BIN"
    with served(log, cwd=tmp_path) as url:
        visit = Visit(browser, url, clear=False)
        drawn(visit)
        assert "Sweep" in visit.text("#findings")
        visit.page.evaluate(CANCEL_AT_ONCE)
        visit.page.locator("#sweeps button").click()
        visit.until("document.getElementById('identify').innerText.includes('Cancelled. Nothing was kept.')")
        visit.view("parameters")
        visit.page.fill("#parameters input", "ATC_RAT_RLL_P")
        visit.until("document.querySelectorAll('#parameters tbody tr').length >= 1")
        assert "0.06" in visit.text("#parameters")
        visit.view("events")
        visit.page.fill("#events input", "SYSTEMID")
        visit.page.locator("#events tr.go").first.click()
        visit.until("swash.state.seen.high - swash.state.seen.low < 10.01")
        visit.page.click("[data-do=all]")
        visit.view("spectrum")
        visit.page.select_option("#spectrum select", "p")
        visit.until("document.getElementById('spectrum').dataset.drawn === 'p'")
        assert "omega_rotor at 25.0" in visit.text("#spectrum")
        assert "no harmonic stands out" in visit.text("#spectrum")  # the simulated autopilot's rotor does not shake
        visit.view("track")
        visit.until("document.getElementById('track').dataset.drawn > 10")
        first = visit.text("#clock")
        visit.page.click("#play")
        visit.until(f"document.getElementById('clock').textContent !== '{first}'")
        visit.close()


def test_a_shaken_gyro_gets_notches_to_copy(browser: Any, address: str, tmp_path: Path) -> None:
    time = np.arange(0.0, 20.0, 0.005)
    p = 0.1 * np.sin(2.0 * np.pi * 50.0 * time) + 0.01 * np.random.default_rng(1).standard_normal(time.size)
    rows = zip(time.tolist(), p.tolist(), strict=True)
    text = "t [s],p [rad/s],omega_rotor [rpm]\n" + "\n".join(f"{t:.3f},{rate:.6f},1500" for t, rate in rows)
    (tmp_path / "shaken.csv").write_text(text + "\n")
    visit = Visit(browser, address, "telephone")
    visit.drop(tmp_path / "shaken.csv")
    drawn(visit)
    visit.view("spectrum")
    visit.until("document.querySelector('#spectrum .code pre')")
    assert visit.text("#spectrum .code pre").split() == [
        f"INS_HNTCH_{line}" for line in ("ENABLE,1", "MODE,2", "REF,1", "FREQ,22.5", "BW,11.2", "HMNCS,2")
    ]
    visit.close()
