"""An exported model in Firefox, from the disk: it flies as it flies in Python."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from firefox import running_firefox
from flown_here import World
from swashplate.links.live.axes import STICKS
from swashplate.links.web.libraries import PAGE

FLIES = """
const { flight } = swash.connection, [sticks, axes] = arguments;
swash.connection.runs = false;
flight.reset();
for (const row of sticks) {
  axes.forEach((axis, i) => (flight.setting.sticks[axis] = row[i]));
  flight.step();
}
return [...flight.places[0].x];
"""


def test_it_flies_as_here(tmp_path: Path) -> None:
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    if find_spec("ziglang") is None:
        pytest.skip("the extra 'compiler' is not installed: nothing makes WebAssembly")
    (file,) = sp.export_model("coax", "web").save(tmp_path)
    at = 0.01 * np.arange(500)
    sticks = np.stack([0.5 * np.sin(2 * at), 0.4 * np.sin(at), 0.3 * np.cos(at), 0.2 * np.sin(0.7 * at)], axis=1)
    world = World(sp.vehicle("coax"))
    for row in sticks:
        world.setting.sticks = dict(zip(STICKS, row, strict=True))
        world.step()
    with running_firefox(tmp_path) as browser:
        browser.ask("WebDriver:Navigate", url=file.as_uri())
        browser.until("swash && swash.now && swash.now.t > 0.2 && document.documentElement.dataset.drawn")
        assert browser.of("return document.getElementById('trouble').textContent;") in ("", None)
        found = browser.of(FLIES, sticks.tolist(), list(STICKS))
    np.testing.assert_allclose(found, world.moment().crafts["own"][0], rtol=1e-9, atol=1e-9)
