"""The live page and the replay in a real browser: they fly, and what is recorded is identified and reported."""

from __future__ import annotations

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

import chromium
import swashplate as sp
from swashplate.compiler import web_compiler
from swashplate.links.web.libraries import PAGE

pytest.importorskip("starlette", reason="the extra `live` is not installed")

SIZES = {"desk": (1280, 860), "telephone": (390, 844)}
_WAIT = 90_000.0  # ms; a busy machine draws slowly


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    if web_compiler() is None:
        pytest.skip("the extra 'compiler' is not installed: nothing makes WebAssembly")
    yield from chromium.running_browser(webgl=True)


@contextmanager
def _served(
    *arguments: str | Path, cwd: Path, python: str | Path = sys.executable, without: tuple[str, ...] = ()
) -> Iterator[str]:
    command = [str(python), "-m", "swashplate", *map(str, arguments), "--port", "0"]
    around = {name: value for name, value in os.environ.items() if name not in without}
    with subprocess.Popen(command, cwd=cwd, stdout=subprocess.PIPE, text=True, env=around) as process:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        try:
            yield found[0]
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(timeout=10.0)
            except subprocess.TimeoutExpired:
                process.kill()


@pytest.fixture(scope="module")
def coax(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with _served("live", "coax", cwd=tmp_path_factory.mktemp("coax")) as url:
        yield url


@pytest.fixture
def visit_(browser: Any) -> Iterator[Any]:
    """Opens pages, and closes them also where a test fails: a page that goes on drawing keeps a processor busy."""
    made: list[Visit] = []

    def open_(*arguments: Any) -> Visit:
        made.append(Visit(browser, *arguments))
        return made[-1]

    yield open_
    for visit in made:
        visit.page.close()


class Visit:
    """An opened page and what it complained about."""

    def __init__(self, browser: Any, url: str, size: str = "desk") -> None:
        self.page = browser.new_page(viewport=dict(zip(("width", "height"), SIZES[size], strict=True)))
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.said.append(f"error: {error}"))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.url = url
        self.page.goto(url, timeout=_WAIT)

    def flies(self) -> Visit:
        self.until("window.swash?.now?.t > 0 && Number(document.documentElement.dataset.drawn) > 3")
        self.of("document.getElementById('reset').click()")  # where it stands: on a telephone that is far below
        self.until("window.swash.now.t < 1.5")
        return self

    def until(self, condition: str, *, seconds: float = _WAIT / 1000.0) -> None:
        """Asks again and again: a condition as text may not run inside a page that forbids `eval`."""
        end = time.monotonic() + seconds
        while not self.page.evaluate(f"Boolean({condition})"):
            assert time.monotonic() < end, f"never came true: {condition}"
            self.page.wait_for_timeout(50)

    def of(self, expression: str) -> Any:
        return self.page.evaluate(expression)

    def stick(self, **axes: float) -> None:
        held = {"roll": 0, "pitch": 0, "yaw": 0, "heave": 0, **axes}
        self.page.evaluate("axes => { window.swash.sticks.scripted = axes; }", held)

    def done(self) -> None:
        assert chromium.complaints(self.said) == []
        assert all(url.startswith((self.url, self.url.replace("http", "ws", 1), "data:")) for url in self.asked)


def test_the_helicopter_moves_under_the_stick_and_charts_advance(visit_: Any, coax: str) -> None:
    visit = visit_(coax).flies()
    charted = visit.of("swash.charts.charts.map(c => c.data[0].length)")
    north = visit.of("swash.now.own.x[0]")
    visit.stick(pitch=0.4)
    visit.until(f"swash.now.own.x[0] > {north + 1.0}")
    visit.until(f"swash.scene.crafts.own.model.group.position.x > {north + 0.9}")  # what is drawn moves as well
    longer = visit.of("swash.charts.charts.map(c => c.data[0].length)")
    assert all(now > then for now, then in zip(longer, charted, strict=True))
    assert visit.of("swash.charts.charts.length") == 4
    assert visit.of("document.querySelectorAll('.chart canvas').length") == 4
    units = visit.of("Array.from(document.querySelectorAll('.chart strong'), e => e.textContent)")
    assert units == ["Attitude [deg]", "Rates [deg/s]", "Velocities [m/s]", "Inputs [1]"]
    turned = visit.of("swash.scene.crafts.own.model.phases[0]")
    visit.until(f"swash.scene.crafts.own.model.phases[0] !== {turned}")
    visit.done()


@pytest.mark.proof
def test_a_linear_model_moves_under_the_stick_and_says_what_it_is(visit_: Any, tmp_path: Path) -> None:
    with _served("live", "thirteen_state", cwd=tmp_path) as url:
        visit = visit_(url).flies()
        about = visit.of("document.getElementById('about').textContent")
        assert about.startswith("A linear model")
        assert "delays are flown" in about
        north = visit.of("swash.now.own.x[0]")
        visit.page.click("[data-mode=velocity]")
        visit.stick(pitch=0.3)
        visit.until(f"swash.now.own.x[0] > {north + 0.5}")
        assert visit.of("swash.scene.crafts.own.model.group.position.x") > north
        assert visit.of("swash.now.trouble") == ""
        visit.done()


def test_pictures_come_rarer_while_they_take_long_and_more_often_again(visit_: Any, coax: str) -> None:
    visit = visit_(coax).flies()
    assert visit.of("swash.scene.software"), "this browser draws in software"
    some = "(() => {{ const p = new swash.pace.constructor({0}); return {1}.map(ms => (p.took(ms), p.interval)); }})()"
    slower = visit.of(some.format("true", "Array(30).fill(90)"))
    assert slower == sorted(slower)
    assert slower[-1] == pytest.approx(270.0, abs=1.0), "a third of the time"
    back = visit.of(some.format("true", "[...Array(30).fill(900), ...Array(30).fill(1)]"))
    assert (back[29], back[-1]) == (400.0, 100.0)
    assert visit.of(some.format("false", "[900]")) == [0], "a card draws every frame"
    drawn = "Number(document.documentElement.dataset.drawn)"
    before = visit.of(drawn)
    visit.page.wait_for_timeout(1000)
    assert visit.of(drawn) - before <= 11, "ten a second at most"
    visit.done()


def test_nothing_is_between_a_stick_and_the_model(visit_: Any, coax: str) -> None:
    """The turn that reads the sticks flies them: the inputs have moved before the next picture."""
    visit = visit_(coax).flies()
    moved = """() => {
      const { connection, sticks } = swash, { flight } = connection;
      connection.turn(performance.now() + 20);
      const before = flight.places[0].inputs[2];
      connection.say("stick", { roll: 0.5, pitch: 0, yaw: 0, heave: 0 });
      connection.turn(connection.last + 10);
      return Math.abs(flight.places[0].inputs[2] - before);
    }"""
    assert visit.of(moved) > 1e-3
    visit.done()


def test_the_land_lies_still_and_its_posts_are_a_metre_high(visit_: Any, coax: str) -> None:
    """Speed and height are seen against what does not move with the helicopter."""
    visit = visit_(coax).flies()
    places = """far => {
      const { land } = swash.scene, { array } = land.posts.instanceMatrix;
      land.around({ x: far, y: 2, z: 0 }, { x: far, y: 2, z: 0 });
      const posts = Array.from({ length: land.posts.count }, (_, k) => array[16 * k + 12]);
      return { posts, foot: array[13] - 0.5, ground: land.ground.position.x, cell: land.cell };
    }"""
    before, after = (visit.page.evaluate(places, far) for far in (0.0, 9.0))
    assert (before["foot"], before["cell"]) == (0.0, 1)
    assert {x % 4.0 for x in before["posts"] + after["posts"]} == {2.0}, "the same places, seen from further on"
    assert max(after["posts"]) > max(before["posts"])
    assert (before["ground"], after["ground"]) == (0.0, 8.0), "a whole pattern of fields"
    visit.done()


def test_a_recording_is_on_the_server_s_disk(browser: Any, visit_: Any, tmp_path: Path) -> None:
    """All of it, without a gap, and what the equations of this machine make of its inputs."""
    with _served("live", "coax", cwd=tmp_path) as url:
        visit = visit_(url).flies()
        visit.page.click("#record")
        visit.until("swash.now.recording >= 0.1")
        visit.page.click("[data-maneuver='doublet']")
        visit.until("swash.now.recording > 3")
        visit.page.click("#record")
        visit.until("swash.now.recordings.length === 1")
        visit.done()
    coax, truth = sp.vehicle("coax"), sp.read(tmp_path / "live" / "recording-1-truth.nc")
    states = truth.array(coax.state_names)
    assert np.allclose(np.diff(truth.time("x")), 0.01)
    assert np.ptp(truth.values("servo_roll")) > 0.05
    again = sp.simulate(
        coax,
        {name: truth.values(name) for name in coax.input_names},
        start=dict(zip(coax.state_names, states[0], strict=True)),
        substeps=5,
    )
    assert np.max(np.abs(again.array(coax.state_names) - states)) < 1e-9


def test_charts_of_a_single_sample_are_drawn(visit_: Any, coax: str) -> None:
    """A range of no length has ticks without end: uPlot filled an array until there was no memory left."""
    visit = visit_(coax).flies()
    one = "((t) => { swash.charts.clear(); swash.charts.add(t, swash.now.own, null); swash.charts.draw(); })"
    for t in (1.0, 2.22):
        visit.of(f"{one}({t})")
        visit.until("Number(document.documentElement.dataset.drawn) > 3")
    visit.done()


def test_decoupling_changes_the_path_of_the_same_stick(visit_: Any, coax: str) -> None:
    visit = visit_(coax).flies()
    visit.page.check("#ghost")
    visit.until("swash.now.ghost")
    visit.stick(pitch=0.4)
    visit.until("Math.abs(swash.now.own.x[1] - swash.now.ghost.x[1]) > 0.3")
    visit.stick()
    visit.page.uncheck("#ghost")
    visit.until("!swash.now.ghost")
    visit.done()


def test_keys_and_touch_are_sticks_and_no_gamepad_is_no_trouble(visit_: Any, coax: str) -> None:
    visit = visit_(coax, "telephone").flies()
    start = visit.of("swash.now.own.x[8]")
    visit.page.keyboard.down("KeyD")
    visit.until(f"swash.now.own.x[8] > {start + 0.1}")
    visit.page.keyboard.up("KeyD")
    stick = visit.page.locator(".stick").nth(1)
    box = stick.bounding_box()
    visit.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    visit.page.mouse.down()
    visit.page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + box["height"] / 2)
    visit.until("swash.now.own.x[4] > 0.1")
    visit.page.mouse.up()
    assert "No gamepad" in visit.of("document.getElementById('gamepad').textContent")
    assert visit.of("document.documentElement.scrollWidth") <= SIZES["telephone"][0]
    visit.done()


def test_time_stops_steps_and_runs_slower(visit_: Any, coax: str) -> None:
    visit = visit_(coax).flies()
    visit.page.click("#pause")
    visit.until("!swash.now.runs")
    t = visit.of("swash.now.t")
    visit.page.click("#step")
    visit.until(f"swash.now.t > {t}")
    assert visit.of("swash.now.t") == pytest.approx(t + 0.01, abs=1e-6)
    visit.page.click("#slower")
    visit.until("swash.now.speed === 0.5")
    visit.page.click("#faster")
    visit.page.click("#pause")
    visit.until("swash.now.runs && swash.now.speed === 1")
    visit.page.click("[data-mode=raw]")
    visit.until("swash.now.setting.mode === 'raw'")
    visit.stick(heave=-1)
    visit.until("document.getElementById('trouble').innerText.includes('Touched the ground')")
    visit.stick()
    visit.page.click("[data-mode=held]")
    visit.page.click("#reset")
    visit.until("!swash.now.trouble && swash.now.t < 2")
    visit.done()


def _identified(visit: Visit, *, seconds: float, axes: tuple[str, ...], how: str = "model") -> None:
    visit.page.click("#faster")
    visit.page.click("#faster")
    visit.page.click("#record")
    visit.until("swash.now.recording !== null")
    for axis in axes:
        visit.page.select_option("#axis", axis)
        visit.page.click("[data-maneuver='3211']")
        visit.until("swash.now.maneuver > 0")
        visit.until("swash.now.maneuver === 0")
    visit.until(f"swash.now.recording > {seconds}")
    visit.page.click("#record")
    visit.until("swash.now.recordings.length > 0")
    visit.page.select_option("#how", how)
    visit.page.click("#identify")
    visit.until("swash.now.job && swash.now.job[1] === 'running'")
    visit.until("document.querySelector('#job progress') && document.getElementById('job').innerText.includes(' s')")
    visit.until("swash.now.job[1] !== 'running'", seconds=900.0)
    assert visit.of("swash.now.job[1]") == "done", visit.of("swash.now.job[2]")
    with visit.page.context.expect_page() as opened:
        visit.page.click("#job a")
    report = opened.value
    report.wait_for_selector("html[data-drawn=all]", state="attached", timeout=_WAIT)
    assert report.locator(".canvas svg.main-svg").count() > 0
    report.close()


@pytest.mark.proof
def test_what_is_recorded_is_identified_and_reported(visit_: Any, coax: str) -> None:
    visit = visit_(coax).flies()
    visit.page.click("[data-mode=held]")
    _identified(visit, seconds=10.0, axes=("roll", "pitch"), how="responses")
    visit.done()


@pytest.mark.proof
def test_a_coax_flown_by_hand_is_identified(visit_: Any, coax: str) -> None:
    visit = visit_(coax).flies()
    visit.page.click("[data-mode=held]")
    _identified(visit, seconds=14.0, axes=("roll", "pitch"))
    visit.done()


def test_replay_scrubs_and_shows_the_prediction(visit_: Any, tmp_path: Path) -> None:
    raptor = sp.vehicle("raptor50", bar=True)
    raptor.save(tmp_path / "barred.toml")
    sp.simulate(raptor, "doublet:roll,0.5s,0.02", controller=sp.state_hold, lead=1, tail=2).save(tmp_path / "flight.nc")
    with _served(
        "live", "barred.toml", "--replay", tmp_path / "flight.nc", "--settings", "ahead=1", cwd=tmp_path
    ) as url:
        visit = visit_(url)
        visit.page.wait_for_selector("html[data-ready]", state="attached", timeout=_WAIT)
        visit.of("swash.go(1.3)")
        visit.until("swash.index === 65")
        drawn = visit.of("swash.scene.crafts.own.model.group.rotation.x")
        assert drawn == pytest.approx(visit.of("swash.flight.moments[65][0][6]"), abs=1e-9)
        assert visit.of("'ghost' in swash.scene.crafts")
        assert visit.of("swash.scene.crafts.own.model.bar !== null")
        visit.page.click("#play")
        visit.until("swash.time > 1.5")
        visit.page.click("#play")
        visit.page.locator(".chart").first.locator(".u-over").click(position={"x": 2, "y": 20})
        visit.until("swash.time < 0.2")
        visit.done()
