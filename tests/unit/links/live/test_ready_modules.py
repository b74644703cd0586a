"""The WebAssembly that ships is that of the ready vehicles' equations on this day, whatever the numbers on the card."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from importlib import metadata
from pathlib import Path

import pytest

import swashplate as sp
from swashplate import compiler
from swashplate.errors import MissingLibraryError
from swashplate.links.live.frame_code import EXPORTS, READY, frame_code, module_name, web_assembly
from swashplate.links.live.world import World
from swashplate.models.catalogue import packaged_cards
from swashplate.models.vehicle import Vehicle

LOCK = Path(__file__).parents[4] / "lock" / "dev.txt"


def source(vehicle: Vehicle) -> str:
    return frame_code(World(vehicle, controller=None))


@lru_cache(maxsize=1)
def sources() -> dict[str, str]:
    """C by the file that must ship, of every ready vehicle, with and without its bar."""
    vehicles = [sp.vehicle(name) for name in packaged_cards()]
    barred = [name for name in packaged_cards() if "bar" in sp.vehicle(name).traits.switches]
    vehicles += [sp.vehicle(name, bar=on) for name in barred for on in (True, False)]
    every = [source(vehicle) for vehicle in vehicles]
    return {module_name(text, EXPORTS): text for text in every}


def test_what_ships_is_of_todays_equations_and_nothing_else() -> None:
    """Otherwise: python scripts/ready_modules.py."""
    assert {file.name for file in READY.glob("*.wasm")} == set(sources())


def test_without_a_compiler_a_fitted_vehicle_flies_and_other_equations_name_the_extra(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(compiler, "ziglang", lambda: None)
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    fitted = sp.vehicle("coax").with_values({"tau_f_upper": 0.7, "linkage_lower": 0.2})
    card = replace(fitted.card, observer={"nuisance": {"delay_motor": 0.06, "delay_servo": 0.03}})
    late = World(fitted.with_card(card), draws=[fitted] * 5)
    assert web_assembly(frame_code(late))[:4] == b"\0asm", "with its delays and the models drawn from its fit"
    with pytest.raises(MissingLibraryError, match=r"swashplate\[compiler\]"):
        web_assembly(source(sp.vehicle("thirteen_state")))
    with pytest.raises(MissingLibraryError):
        web_assembly(source(fitted) + "\n/* other equations */")


def test_a_compiler_makes_the_same_bytes() -> None:
    pinned = re.search(r"^ziglang==(\S+)", LOCK.read_text(encoding="utf-8"), re.MULTILINE)
    assert pinned is not None
    try:
        here = metadata.version("ziglang")
    except metadata.PackageNotFoundError:
        pytest.skip("the extra 'compiler' is not installed")
    if here != pinned[1]:
        pytest.skip(f"ziglang is {here}; the modules were made by {pinned[1]}")
    for name, text in sources().items():
        assert web_assembly(text, ready=False) == (READY / name).read_bytes(), name
