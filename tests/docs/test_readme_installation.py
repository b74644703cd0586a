"""What the README installs is enough: a fit runs in C with these libraries alone, as its reader gets it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import swashplate as sp
from swashplate.compiler import compiler
from swashplate.simulation.sensors import QUIET

README = Path(__file__).parents[2] / "README.md"
BEGIN = """
import sys
sys.path[:0] = [sys.argv.pop(1)]
from swashplate.__main__ import main
sys.argv[0] = "swash"
main()
"""


def installed_extras() -> set[str]:
    """The extras of the README's first command."""
    named = re.search(r"\$ pip install '\.\[([\w,]+)\]'", README.read_text(encoding="utf-8"))
    assert named is not None
    return set(named[1].split(","))


def required_distributions(name: str, extras: set[str]) -> dict[str, metadata.Distribution]:
    """A distribution with all that pip installs for it, by normalised name."""
    found: dict[str, metadata.Distribution] = {}
    asked: set[tuple[str, frozenset[str]]] = set()
    waiting = [(name, frozenset(extras))]
    while waiting:
        one, wanted = waiting.pop()
        key = re.sub(r"[-_.]+", "-", one).lower()
        if (key, wanted) in asked:
            continue
        asked.add((key, wanted))
        found[key] = metadata.distribution(one)
        for text in found[key].requires or ():
            needed = Requirement(text)
            marker = needed.marker
            if marker is None or any(marker.evaluate({"extra": extra}) for extra in (*wanted, "")):
                waiting.append((needed.name, frozenset(needed.extras)))
    return found


def link_distributions(found: dict[str, metadata.Distribution], site: Path) -> None:
    """A folder of modules with nothing but these distributions and this package."""
    for name, one in found.items():
        if name == "swashplate":
            continue
        tops = {file.parts[0] for file in one.files or () if file.parts[0] not in ("..", "__pycache__")}
        for top in tops:
            place, source = site / top, Path(str(one.locate_file(top)))
            if not place.exists() and source.exists():
                place.symlink_to(source)
    (site / "swashplate").symlink_to(Path(sp.__file__).parent)


def test_the_readme_s_libraries_fit_in_c(tmp_path: Path) -> None:
    if compiler() is None:
        pytest.skip("there is no C compiler")
    site, cache = tmp_path / "site", tmp_path / "cache"
    site.mkdir()
    found = required_distributions("swashplate", installed_extras())
    link_distributions(found, site)
    vehicle = sp.vehicle("coax")
    flown = sp.simulate(vehicle, "multisine:roll+pitch,0.4-4Hz,6s,0.1", controller=sp.hover_hold, lead=1.0, tail=1.0)
    sp.observe(flown, vehicle, sensors=QUIET, seed=0).save(tmp_path / "flight.nc")
    asked = ["identify", "--vehicle", "coax", "--flight", "flight.nc", "--free", "tau_f_upper,linkage_lower"]
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", BEGIN, str(site), *asked, "--out", "fit", "--quiet"],
        cwd=tmp_path,
        env={**os.environ, "XDG_CACHE_HOME": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 2), done.stderr
    assert (tmp_path / "fit" / "model.toml").is_file(), done.stderr
    assert list(cache.glob("swashplate/c/*.so")), "no filter was compiled: the fit ran in something slower"


def test_a_library_that_no_extra_names_is_not_there(tmp_path: Path) -> None:
    found = required_distributions("swashplate", set())
    assert "casadi" not in found
    assert "numpy" in found
    link_distributions(found, tmp_path)
    asked = "import sys; sys.path[:0] = [sys.argv[1]]; import casadi"
    assert subprocess.run([sys.executable, "-I", "-S", "-c", asked, str(tmp_path)], check=False).returncode == 1
