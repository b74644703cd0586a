"""Wheel and source archive: the same bytes twice, every file of the package, a program that runs in another folder.

`proof` installs both into empty environments with what they need, and runs the demo, and the pages there.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tarfile
import urllib.request
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "swashplate"


def _built(folder: Path, kind: str = "wheel") -> Path:
    """A wheel, or a source archive, of the sources as they are; the page's libraries are not fetched."""
    environment = {**os.environ, "SWASHPLATE_WITHOUT_PAGE": "1", "SOURCE_DATE_EPOCH": "1577836800"}
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    (made,) = folder.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return made


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
    assert held - {"swashplate/commit.txt"} == wanted, "and the commit, where git tells it"


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
    assert "raptor50" in said("-m", "swashplate", "vehicle", "list")
    script = "import swashplate as sp; print(sp.structure('thirteen_state').structure.name)"
    assert "thirteen_state" in said("-c", script)


def test_the_source_archive_builds_the_same_wheel(wheel: Path, tmp_path: Path) -> None:
    archive = _built(tmp_path / "made", "sdist")
    with tarfile.open(archive) as packed:
        packed.extraction_filter = getattr(tarfile, "data_filter", None)  # Python before 3.11.4 has none
        packed.extractall(tmp_path)
    (source,) = (path for path in tmp_path.iterdir() if path.name.startswith("swashplate-"))
    environment = {**os.environ, "SWASHPLATE_WITHOUT_PAGE": "1", "SOURCE_DATE_EPOCH": "1577836800"}
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path / "again")]
    subprocess.run(command, cwd=source, env=environment, check=True, capture_output=True)
    (again,) = (tmp_path / "again").glob("*.whl")
    assert _content(again) == _content(wheel), "in another order: the archive holds the commit as a file"


def _content(wheel: Path) -> dict[str, bytes]:
    """Every file of a wheel; lines of its list of files sorted."""
    with zipfile.ZipFile(wheel) as archive:
        found = {name: archive.read(name) for name in archive.namelist()}
    return {n: b"".join(sorted(c.splitlines())) if n.endswith("/RECORD") else c for n, c in found.items()}


@pytest.mark.proof
@pytest.mark.parametrize("kind", ["wheel", "sdist"])
def test_an_empty_environment_runs_all_of_it_elsewhere(kind: str, tmp_path: Path) -> None:
    """Installed by pip with nothing but what it asks for; pip must reach an index or a folder of wheels."""
    made, there, elsewhere = _built(tmp_path / "made", kind), tmp_path / "there", tmp_path / "elsewhere"
    elsewhere.mkdir()
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    plain["SWASHPLATE_WITHOUT_PAGE"] = "1"  # for the wheel that pip builds of the source archive
    subprocess.run([sys.executable, "-m", "venv", str(there)], check=True)
    python, swash = there / "bin" / "python", there / "bin" / "swash"
    asked = [python, "-m", "pip", "install", "--quiet", "--no-compile"]
    installed = subprocess.run([*asked, str(made)], env=plain, capture_output=True, text=True, check=False)
    if installed.returncode:
        pytest.skip(f"pip cannot install it here: {installed.stderr[-200:]}")

    def said(*command: str | Path) -> str:
        done = subprocess.run([*command], cwd=elsewhere, env=plain, capture_output=True, text=True, check=True)
        return done.stdout

    assert str(there) in said(python, "-c", "import swashplate; print(swashplate.__file__)")
    assert "casadi not installed" in said(swash, "--version")
    assert "coax" in said(swash, "vehicle", "list")
    _serves(swash, "open", cwd=elsewhere, env=plain)
    subprocess.run([*asked, f"{made}[model]"], env=plain, capture_output=True, check=True)
    assert "casadi not installed" not in said(swash, "--version")
    _serves(swash, "live", "raptor50", cwd=elsewhere, env=plain)
    said(swash, "demo", "--out", "demo", "--quiet")
    assert (elsewhere / "demo" / "report.html").is_file()


def _serves(*command: str | Path, cwd: Path, env: dict[str, str]) -> None:
    """A page that answers; the libraries that it draws with are fetched elsewhere."""
    if not (PACKAGE / "links" / "live" / "page" / "vendor").is_dir():
        return  # without npm there are no libraries to put into the wheel, and the page says so
    asked = [*map(str, command), "--port", "0"]
    with subprocess.Popen(asked, cwd=cwd, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            found = re.search(r"http://\S+", server.stdout.readline())
            assert found is not None
            with urllib.request.urlopen(found[0], timeout=60.0) as answer:
                assert b"<html" in answer.read().lower()
        finally:
            server.send_signal(signal.SIGINT)
            server.communicate(timeout=60.0)
