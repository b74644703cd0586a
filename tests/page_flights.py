"""Exported pages opened from the disk with the network off, and the same flight there and here."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from flown_here import World
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.links.live.axes import STICKS
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Euler, Vector, local_to_body

FLY = """plan => {
  const { connection } = swash, { flight } = connection;
  connection.runs = false;
  flight.reset();
  let seed = 1;
  Math.random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  for (let k = 0; k < plan.sticks.length; k += 1) {
    flight.setting.sticks = Object.fromEntries(plan.axes.map((axis, i) => [axis, plan.sticks[k][i]]));
    if (k === plan.maneuver) flight.flyManeuver("3211", "roll", 1);
    if (k === plan.mode) flight.setMode("velocity");
    if (k === plan.blow && plan.wind) flight.setting.wind = [1, -0.5, 0];
    flight.step();
  }
  const result = { x: [...flight.places[0].x], u: [...flight.places[0].inputs], trouble: flight.trouble };
  return { ...result, air: flight.airSpeed(), fan: flight.fanned()?.x ?? [] };
}"""
MANEUVER, BLOW, MODE = 300, 500, 700


def opened(browser: Any, file: Path, size: tuple[int, int] = (1280, 860)) -> tuple[Any, list[str]]:
    """The page, flying, and what it said and asked for elsewhere."""
    context = browser.new_context(offline=True, viewport={"width": size[0], "height": size[1]})
    page, said = context.new_page(), []
    page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(f"error: {error}"))
    page.on(
        "request",
        lambda request: said.append(f"error: asked for {request.url}") if request.url.startswith("http") else None,
    )
    page.goto(file.as_uri())
    page.locator("html[data-drawn]").wait_for(state="attached", timeout=90_000)
    return page, said


def wait_until(page: Any, condition: str) -> None:
    """Until an expression of the page holds; the page's own policy forbids playwright's way to ask."""
    end = time.monotonic() + 90.0
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        page.wait_for_timeout(50)


def plan_of(world: World) -> dict[str, Any]:
    at = np.arange(round(10.0 / world.period)) * world.period
    waves = (0.5 * np.sin(2.0 * at), 0.4 * np.sin(1.3 * at), 0.3 * np.cos(at), 0.2 * np.sin(0.7 * at))
    known = {"axes": list(STICKS), "maneuver": MANEUVER, "mode": MODE, "blow": BLOW}
    return {**known, "sticks": np.stack(waves, axis=1).tolist(), "wind": world.vehicle.traits.wind}


def air_speed(world: World) -> float:
    """Of the craft in the wind of the sliders [m/s], by the package's own rotation."""
    x = np.array(world.moment().crafts["own"][0])
    u, v, w, *angles = (float(x[world.vehicle.index(name)]) for name in ("u", "v", "w", "phi", "theta", "psi"))
    wind = local_to_body(Vector(*world.setting.wind), Euler(*angles), FloatBackend())
    return float(np.linalg.norm(np.array([u, v, w]) - np.array(wind)))


def same_normals() -> Callable[[], float]:
    """Normal draws as the page makes them of the uniform ones of `FLY`: Lehmer's with Park and Miller's numbers."""
    seed = 1

    def uniform() -> float:
        nonlocal seed
        seed = seed * 48271 % 2147483647
        return seed / 2147483647

    return lambda: math.sqrt(-2.0 * math.log(1.0 - uniform())) * math.cos(2.0 * math.pi * uniform())


def flown_here(world: World, plan: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    world.normal = same_normals()
    for k, sticks in enumerate(plan["sticks"]):
        world.setting.sticks = dict(zip(STICKS, sticks, strict=True))
        if k == MANEUVER:
            pilot = world.pilot
            world.fly_maneuver(Maneuver("3211", (pilot.excited["roll"],), 3.5, pilot.amplitude["roll"]))
        if k == MODE:
            world.set_mode("velocity")
        if k == BLOW and plan["wind"]:
            world.setting.wind = (1.0, -0.5, 0.0)
        world.step()
    own = world.moment().crafts["own"]
    return np.array(own[0]), np.array(own[1])


def flies_the_same(page: Any, world: World) -> np.ndarray:
    """Ten seconds of sticks, a maneuver, wind and another mode, there and here to 1e-9: the state at their end."""
    plan = plan_of(world)
    found = page.evaluate(FLY, plan)
    x, u = flown_here(world, plan)
    assert found["trouble"] == world.trouble == ""
    np.testing.assert_allclose(found["x"], x, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found["u"], u, rtol=1e-9, atol=1e-9)
    fan = [row[:12] for row in world.moment().fan if row is not None]
    assert len(fan) == len(world.draws)
    np.testing.assert_allclose(found["fan"], np.reshape(fan, (-1, 12)) if fan else [], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found["air"], air_speed(world), rtol=1e-9)
    return x
