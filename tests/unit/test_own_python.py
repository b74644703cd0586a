"""Python processes of the package are started in one way, which leaves the folder they work in alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import swashplate
from swashplate.own_python import SAFE_PATH, own_python

SOURCE = Path(swashplate.__file__).parent


def test_a_process_has_this_ones_path_without_the_folder_it_works_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "told.py").write_text("import json, sys\ndef main(): print(json.dumps([sys.path, sys.argv[1:]]))\n")
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "json.py").write_text("raise SystemExit('the folder was looked in')\n")
    monkeypatch.setattr(sys, "path", ["", str(tmp_path), "relative", *sys.path])
    monkeypatch.chdir(tmp_path / "here")
    said = subprocess.run(own_python("told", "a b", "-x"), capture_output=True, text=True, check=True).stdout
    path, arguments = json.loads(said)
    assert arguments == ["a b", "-x"]
    assert path == [os.path.abspath(entry) for entry in sys.path if entry]
    unguarded = subprocess.run([sys.executable, "-c", "import json"], capture_output=True, text=True, check=False)
    assert "the folder was looked in" in unguarded.stderr
    subprocess.run([sys.executable, "-c", "import json"], env={**os.environ, **SAFE_PATH}, check=True)


STARTS = {
    "api/campaigns/plan.py": "asks the pool",
    "api/campaigns/pool.py": "spawns workers with SAFE_PATH",
    "api/campaigns/program.py": "asks for its parent",
    "api/campaigns/verbs.py": "asks the pool",
    "compiler.py": "the C compiler; that of ziglang by Python's -I",
    "flights/foreign.py": "own_python",
    "links/ardupilot/sitl.py": "an autopilot that the user names",
    "links/betaflight/binary.py": "an autopilot that the user names",
    "links/live/identifying.py": "own_python",
    "links/logs/cockpit.py": "own_python",
    "links/sitl_binary.py": "ends what an autopilot that the user names has started",
    "systems.py": "ends what sitl_binary.py has started",
}
"""Files that start processes, and what: a new one is looked at here before it is added."""


def test_nothing_else_starts_processes() -> None:
    words = ("subprocess", "multiprocessing", "ProcessPool", "os.system", "os.spawn", "os.exec", "popen")
    found = {}
    for file in sorted(SOURCE.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        if file.name == "own_python.py":
            continue
        assert text.count("sys.executable") == text.count('sys.executable, "-I"'), file
        if any(word in text for word in words):
            found[str(file.relative_to(SOURCE))] = "own_python" if "own_python(" in text else ""
    assert found.keys() == STARTS.keys()
    assert [file for file, how in found.items() if how] == [file for file, how in STARTS.items() if how == "own_python"]
