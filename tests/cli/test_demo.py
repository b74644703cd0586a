"""`swash demo`, as `make demo` runs it: a flight as an object goes through the verb that takes names of logs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from commands import swash

import chromium
import swashplate as sp
from flown_here import World
from page_flights import flies_the_same, opened
from swashplate.api.asking import called, drawn
from swashplate.flights.flight import Flight
from swashplate.links.web.libraries import PAGE


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("main") / "demo"
    outcome = swash("demo", "--out", folder, "--quiet")
    assert outcome.code == 0, outcome.err
    return folder


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    if find_spec("ziglang") is None:
        pytest.skip("the extra 'compiler' is not installed: nothing makes WebAssembly")
    yield from chromium.running_browser(webgl=True)


def test_the_main_job_leaves_its_files(demo: Path) -> None:
    assert {"report.html", "model.toml", "fit.json", "validation.json"} <= {f.name for f in demo.iterdir()}
    assert json.loads((demo / "fit.json").read_text())["estimates"]


def test_its_model_flies_from_the_disk_with_the_network_off(demo: Path, browser: Any) -> None:
    """With its delays, its sensors and five models drawn from its fit, ten seconds as here."""
    page, model, fit = demo / "page.html", demo / "model.toml", demo / "fit.json"
    outcome = swash("export", model, "--format", "web", "--out", page, "--settings", f"posterior={fit}")
    assert outcome.code == 0, outcome.err
    assert page.stat().st_size < 1_000_000
    opened_page, said = opened(browser, page)
    vehicle = sp.vehicle(model)
    world = World(vehicle, draws=drawn(vehicle, fit, count=5))
    assert world.delays.any()
    assert any(world.sensors[0].sigma)
    flies_the_same(opened_page, world)
    assert not chromium.complaints(said)


def test_logs_are_called_what_the_user_calls_them() -> None:
    flight = Flight.from_arrays([0.0, 0.01, 0.02], {"p": [0.0, 0.1, 0.2]})
    assert called("a.bin") == ["a.bin"]
    assert called(("a.bin", Path("b.bin"))) == ["a.bin", "b.bin"]
    assert called(None) == []
    assert called(flight) is None
    assert called([flight, "a.bin"]) is None
