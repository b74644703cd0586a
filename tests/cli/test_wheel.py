"""The wheel: the same bytes twice, every file of the package in it, a program that runs from it in another folder."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "swashplate"


def _built(folder: Path) -> Path:
    """A wheel of the sources as they are; without the page's libraries, which are fetched."""
    environment = {**os.environ, "SWASHPLATE_WITHOUT_PAGE": "1", "SOURCE_DATE_EPOCH": "1577836800"}
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _built(tmp_path_factory.mktemp("wheel"))


def test_it_is_built_the_same_twice(wheel: Path, tmp_path: Path) -> None:
    assert _built(tmp_path).read_bytes() == wheel.read_bytes()


def test_it_holds_every_file_of_the_package(wheel: Path) -> None:
    there = [path.relative_to(PACKAGE.parent) for path in PACKAGE.rglob("*") if path.is_file()]
    wanted = {path.as_posix() for path in there if not {"__pycache__", "vendor"} & set(path.parts)}
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if name.startswith("swashplate/") and "/vendor/" not in name}
    assert held == wanted


def test_it_runs_from_another_folder(wheel: Path, tmp_path: Path) -> None:
    installed, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    elsewhere.mkdir()
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)
    environment = {**os.environ, "PYTHONPATH": str(installed)}

    def said(*command: str) -> str:
        done = subprocess.run(
            [sys.executable, *command], cwd=elsewhere, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout

    assert str(installed) in said("-c", "import swashplate; print(swashplate.__file__)")
    assert "raptor50" in said("-m", "swashplate", "vehicles")
    script = "import swashplate as sp; print(sp.structure('thirteen_state').structure.name)"
    assert "thirteen_state" in said("-c", script)
