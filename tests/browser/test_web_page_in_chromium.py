"""A model exported as one HTML file, opened from the disk with the network off: it flies as it flies here."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import chromium
import swashplate as sp
from flown_here import World
from page_flights import FLY, flies_the_same, opened, wait_until
from swashplate.api.verbs.export import ExportModel
from swashplate.links.live.axes import STICKS
from swashplate.links.web.libraries import PAGE
from swashplate.models.vehicle import Vehicle


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    if find_spec("ziglang") is None:
        pytest.skip("the extra 'compiler' is not installed: nothing makes WebAssembly")
    yield from chromium.running_browser(webgl=True)


APART = """document.getElementById("views").getBoundingClientRect().left
  - document.getElementById("instruments").getBoundingClientRect().right"""
"""Between the numbers and the buttons beside them [px]; four rotors' speeds are long."""


def fitted(**nuisance: float) -> Vehicle:
    """A CoaX with delays and sensors as a fit remembers them."""
    coax = sp.vehicle("coax")
    usual = {"delay_motor": 0.0417, "delay_servo": 0.0233, "lever_x": 0.02, "lever_z": -0.05, "level_psi": 0.1}
    noise = {"sensor_position": 3e-4, "sensor_angle": 1.5e-3, "sensor_rate": 0.04}
    return coax.with_card(replace(coax.card, observer={"nuisance": {**usual, **nuisance}, "noise": noise}))


@pytest.mark.parametrize("name", ["coax", "raptor50", "crazyflie", "fitted"])
def test_it_flies_as_here_with_the_network_off(browser: Any, name: str, tmp_path: Path) -> None:
    """The last one with delays, sensors and their noise as identified, and two drawn models with others."""
    vehicle = fitted() if name == "fitted" else sp.vehicle(name)
    draws = [fitted(delay_servo=0.01), fitted(level_theta=0.05)] if name == "fitted" else []
    (file,) = sp.export_model(vehicle, "web", name=name, draws=draws).save(tmp_path)
    assert file.stat().st_size < 1_000_000
    page, said = opened(browser, file, (390, 844) if name == "crazyflie" else (1280, 860))
    world = World(vehicle, draws=draws)
    assert page.evaluate(APART) > 0.0
    assert world.delays.any() == (name == "fitted")
    assert world.not_held == ""
    shown = "a point (20, 0, -50) mm ahead, right and below" if draws else "the true states"
    assert shown in page.locator("#sensors").text_content()
    x = flies_the_same(page, world)
    fan = [row[:12] for row in world.moment().fan if row is not None]
    assert all(np.abs(row - x[:12]).max() > 1e-3 for row in fan), "each with delays and sensors of its own"
    assert not chromium.complaints(said)


def test_a_gamepad_flies_it_and_one_that_is_gone_lets_the_sticks_go(browser: Any, tmp_path: Path) -> None:
    """A stand-in of what browsers tell; axes point right and down, as the standard has them."""
    (file,) = sp.export_model("coax", "web").save(tmp_path)
    page, said = opened(browser, file)
    page.evaluate("window.pads = []; navigator.getGamepads = () => window.pads")
    tell = "axes => (window.pads = [null, { connected: true, id: 'stand-in', axes }], swash.sticks.read(0))"
    for place, (axis, sense) in enumerate([("yaw", 1.0), ("heave", -1.0), ("roll", 1.0), ("pitch", -1.0)]):
        for pushed in (-1.0, 0.8):
            found = page.evaluate(tell, [pushed * (k == place) + 0.05 * (k != place) for k in range(4)])
            expected = sense * math.copysign((abs(pushed) - 0.06) / 0.94, pushed)
            assert found == pytest.approx(dict.fromkeys(STICKS, 0.0) | {axis: expected}), "no other axis than this"
    page.evaluate(tell, [0, 0, 0.9, 0])
    wait_until(page, "swash.now.own.x[4] > 0.1")  # to the right
    assert page.evaluate("swash.sticks.right.knob.style.transform").startswith("translate(35.7")
    assert page.locator("#gamepad").text_content() == "Gamepad: stand-in"
    for gone in ("[]", "[null]", "[{ ...window.pads[1], connected: false }]"):
        page.evaluate(tell, [0, 0, 0.9, 0])
        page.evaluate(f"window.pads = {gone}")
        wait_until(page, "swash.sticks.right.knob.style.transform === 'translate(0%, 0%)'")
        wait_until(page, "swash.now.setting.sticks.roll === 0")
    page.get_by_text("No gamepad").wait_for(state="attached")
    page.evaluate("navigator.getGamepads = undefined")
    assert page.evaluate("swash.sticks.read(0).roll") == 0.0
    assert not chromium.complaints(said)


def test_a_designed_controller_flies_it(browser: Any, tmp_path: Path) -> None:
    """With the noise of its own sensors, so no two flights are alike: it stays where it is held."""
    coax = sp.vehicle("coax")
    controller = sp.design_controller(coax).controller
    (file,) = sp.export_model(coax, "web", controller=controller).save(tmp_path)
    page, said = opened(browser, file)
    plan = {"sticks": [[0.0] * 4] * 1000, "axes": list(STICKS), "wind": False}
    found = page.evaluate(FLY, plan)
    assert found["trouble"] == ""
    assert np.linalg.norm(np.array(found["x"][:3]) - World(coax, controller=controller).trim.state[:3]) < 0.5
    assert not chromium.complaints(said)


def test_a_recording_is_a_log(browser: Any, tmp_path: Path) -> None:
    """On a telephone's screen; what is saved is read like any table, and holds what was flown."""
    (file,) = sp.export_model("coax", "web").save(tmp_path)
    page, said = opened(browser, file, (390, 844))
    page.locator("#record").click()
    page.locator("[data-maneuver=doublet]").click()
    page.get_by_text("Stop and save").wait_for()
    wait_until(page, "swash.now.recording >= 1.5")
    with page.expect_download() as coming:
        page.locator("#record").click()
    coming.value.save_as(tmp_path / "coax.csv")
    flight = sp.read(tmp_path / "coax.csv")
    assert np.ptp(flight.values("servo_roll")) > 0.05, "the doublet is in it"
    with (tmp_path / "coax.csv").open(encoding="utf-8") as text:
        assert next(csv.reader(text))[:2] == ["time [s]", "x [m]"]
    page.get_by_text("coax.csv is saved").wait_for(timeout=90_000)  # with the next turn of the page
    assert not chromium.complaints(said)


def test_the_flight_it_was_learnt_from_flies_beside_it(browser: Any, tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    flight = sp.simulate(coax, "doublet:roll,0.5s,0.1", controller=sp.autopilot, tail=4)
    flight.save(tmp_path / "flight.nc")
    ExportModel("coax", "web", out=tmp_path, flight=tmp_path / "flight.nc").answer()
    page, said = opened(browser, tmp_path / "coax.html")
    page.locator("#logged").check()
    wait_until(page, "swash.now.logged && swash.now.t > 1.5 && swash.scene.crafts.logged")
    now = page.evaluate("({ x: swash.now.logged.x, t: swash.now.t, from: swash.connection.flight.loggedFrom })")
    north, east, down, ticks = now["from"]
    at = flight.time("phi")[0] + now["t"] - 0.01 * ticks
    expected = [np.interp(at, flight.time(name), flight.values(name)) for name in ("x", "y", "z", "phi")]
    found = [now["x"][0] - north, now["x"][1] - east, now["x"][2] - down, now["x"][6]]
    np.testing.assert_allclose(found, expected, atol=3e-3)
    assert page.evaluate("swash.charts.charts[0].data.at(-1).at(-1) !== null"), "dashed in the charts"
    page.locator("#logged").uncheck()
    wait_until(page, "!swash.now.logged && !swash.scene.crafts.logged")
    assert not chromium.complaints(said)


def test_draws_fly_beside_it(browser: Any, tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    heavier = [coax.with_values({"mass": coax.card.values()["mass"] * share}) for share in (0.95, 1.05)]
    (file,) = sp.export_model(coax, "web", draws=heavier).save(tmp_path)
    page, said = opened(browser, file)
    page.locator("#fan").wait_for(state="visible")
    wait_until(page, "swash.now.t >= 0.5")
    own, (light, heavy) = page.evaluate("[swash.now.own.x[2], swash.now.fan.x.map(x => x[2])]")
    assert light < own < heavy, json.dumps([light, own, heavy])  # down is positive: the heavier one sinks
    assert not chromium.complaints(said)


def test_a_hostile_card_is_shown_as_text(browser: Any, tmp_path: Path) -> None:
    hostile = "</script><img src=x onerror='window.caught = 1'><script>window.caught = 2</script>&\"'"
    coax = sp.vehicle("coax")
    mass = replace(coax.card.parameters["mass"], source=hostile)
    card = replace(coax.card, title=hostile, trust=hostile, parameters={**coax.card.parameters, "mass": mass})
    (file,) = sp.export_model(coax.with_card(card), "web", name="coax").save(tmp_path)
    page, said = opened(browser, file)
    assert page.evaluate("window.caught") is None
    assert page.locator("#title").text_content() == hostile
    assert hostile in page.locator("#trust").text_content()
    assert page.locator("details td", has_text="onerror").count() == 1
    assert page.evaluate("document.images.length") == 0
    assert not chromium.complaints(said)


TRIES = """async () => {
  await new Promise((done) => setTimeout(done, 0)); // while playwright asks, evaluation is allowed
  const refused = [], ran = [];
  document.addEventListener("securitypolicyviolation", (event) => refused.push(event.effectiveDirective));
  window.caught = (what) => ran.push(what);
  for (const evaluated of [() => eval("caught('eval')"), () => new Function("caught('Function')")()])
    try { evaluated(); } catch (error) { if (error.name !== "EvalError") throw error; }
  const script = document.createElement("script");
  script.textContent = "caught('inline')";
  document.body.append(script);
  const button = document.createElement("button");
  button.setAttribute("onclick", "caught('attribute')");
  document.body.append(button);
  button.click();
  await fetch("data:text/plain,x").then(() => ran.push("fetch"), () => {});
  await import("data:text/javascript,caught('import')").catch(() => {});
  const image = new Image();
  image.src = "http://127.0.0.1:9/x.png";
  await new Promise((done) => setTimeout(done, 300));
  return { ran, refused: [...new Set(refused)].sort() };
}"""


@pytest.mark.parametrize("kept", [True, False])
def test_the_page_s_policy_stops_what_is_put_into_it(browser: Any, kept: bool, tmp_path: Path) -> None:
    """No evaluation, no script of another text, nothing fetched: tried from inside, and without the policy too."""
    (file,) = sp.export_model("coax", "web").save(tmp_path)
    text, count = re.subn(r"<meta http-equiv=.Content-Security-Policy.[^>]*>", "", file.read_text(encoding="utf-8"))
    assert count == 1
    if not kept:
        file.write_text(text, encoding="utf-8")
    page, _ = opened(browser, file)
    tried = page.evaluate(TRIES)
    if kept:
        assert tried["ran"] == []
        assert {"script-src", "script-src-elem", "script-src-attr", "connect-src", "img-src"} <= set(tried["refused"])
    else:
        assert tried["ran"] == ["eval", "Function", "inline", "attribute", "fetch", "import"]
        assert tried["refused"] == []


def test_a_browser_without_webassembly_says_so(browser: Any, tmp_path: Path) -> None:
    (file,) = sp.export_model("coax", "web").save(tmp_path)
    page = browser.new_context(offline=True).new_page()
    page.add_init_script("delete window.WebAssembly")
    page.goto(file.as_uri())
    page.locator("#trouble").wait_for(state="visible")
    assert "This browser lacks WebAssembly" in page.locator("#trouble").text_content()
