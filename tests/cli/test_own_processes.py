"""Processes that commands start: none imports from the folder it works in, and each door is explained."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from swashplate import progress_lines
from swashplate.control.kinds import save_controller
from swashplate.control.laws.autopilot import autopilot
from swashplate.links.web import libraries
from swashplate.models.catalogue import vehicle
from swashplate.simulation.trim import trim
from told_rows import told

SWASH = "import sys\nfrom swashplate.__main__ import main\nif __name__ == '__main__':\n    sys.exit(main())\n"
"""As pip writes `swash`: Python then puts the script's folder on its path, and not the one it works in."""
PLANTED = sorted({*sys.stdlib_module_names, "sitecustomize", "usercustomize", "numpy", "scipy", "jax", "h5py", "xarray",
                  "msgspec", "typer", "rich", "pyarrow", "casadi", "swashplate"} - {"__main__"})  # fmt: skip
CAMPAIGN = """
kind = "campaign"
of = "monte-carlo"
count = 2
batch = 1
vehicle = "coax"
maneuver = "hover:0.2s"
controller = "place.toml"
vary = {mass = "5%"}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where a stranger's files lie: every module that Python or we import, each leaving a mark when it is run."""
    place = tmp_path / "logs"
    place.mkdir()
    for name in PLANTED:
        (place / f"{name}.py").write_text(f"open({str(place / f'ran-{name}')!r}, 'w').close()\n")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "swash").write_text(SWASH)
    return place


def write_campaign(folder: Path, text: str = CAMPAIGN) -> None:
    """A campaign's file and the controller that it names."""
    coax = vehicle("coax")
    save_controller(autopilot(coax, trim(coax)), folder / "place.toml")
    (folder / "c.toml").write_text(text)


def marks(folder: Path) -> list[str]:
    """Planted modules that were run."""
    return sorted(path.name for path in folder.glob("ran-*"))


def command(folder: Path, *words: str) -> list[str]:
    return [sys.executable, str(folder.parent / "bin" / "swash"), *words]


def environment(**more: str) -> Mapping[str, str]:
    return {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"} | more


def ran(folder: Path, *words: str) -> str:
    """What a command prints, in the folder of planted modules."""
    done = subprocess.run(
        command(folder, *words), cwd=folder, env=environment(), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_what_is_planted_is_run_where_python_looks_there(folder: Path) -> None:
    """The test's own test: an unguarded process of Python does run it."""
    for name in ("json", "multiprocessing"):
        subprocess.run([sys.executable, "-c", f"import {name}"], cwd=folder, env=environment(), check=True)
    assert marks(folder) == ["ran-json", "ran-multiprocessing"]


def test_reading_and_campaigns_import_nothing_from_the_folder(folder: Path) -> None:
    write_campaign(folder)
    ran(folder, "simulate", "--vehicle", "coax", "--maneuver", "hover:1s", "-o", "a.nc")  # compiles
    assert "coax, simulated" in ran(folder, "inspect", "a.nc")  # the process of HDF5
    assert "2 of 2 tasks done" in ran(folder, "campaign", "run", "c.toml", "-o", "out", "--workers", "1")
    assert "a task: " in ran(folder, "campaign", "run", "c.toml", "--dry-run")
    ran(folder, "campaign", "replay", "out", "1", "-o", "one.nc")
    assert marks(folder) == []


def test_programs_in_the_folder_are_not_started(folder: Path) -> None:
    """h5py starts `uname` by its name; with "." on the PATH a shell would take one that lies beside a log."""
    for name in ("uname", "cc", "gcc", "clang", "ldconfig", "ffmpeg"):
        (folder / name).write_text(f"#!/bin/sh\n: > {folder}/ran-{name}\n")
        (folder / name).chmod(0o755)
    words = command(folder, "simulate", "--vehicle", "coax", "--maneuver", "hover:1s", "-o", "a.nc")
    here = environment(PATH=os.pathsep.join((".", "", os.environ["PATH"])))
    subprocess.run(words, cwd=folder, env=here, check=True, capture_output=True)
    assert marks(folder) == []
    subprocess.run(["uname"], cwd=folder, env={**here, "PATH": "."}, check=True)  # the test's own test
    assert marks(folder) == ["ran-uname"]


def test_as_a_module_only_what_python_loads_first_is_taken_from_the_folder(folder: Path) -> None:
    """`python -m swashplate` looks in the folder until it is at work (documented); what it starts does not."""
    for name in PLANTED:
        if name not in ("sitecustomize", "usercustomize", "numpy", "h5py", "xarray", "rich", "typer", "pyarrow"):
            (folder / f"{name}.py").unlink()
    words = [
        sys.executable,
        "-m",
        "swashplate",
        "simulate",
        "--vehicle",
        "coax",
        "--maneuver",
        "hover:1s",
        "-o",
        "a.nc",
    ]
    subprocess.run(words, cwd=folder, env=environment(), check=True, capture_output=True)
    subprocess.run([*words[:3], "inspect", "a.nc"], cwd=folder, env=environment(), check=True, capture_output=True)
    assert marks(folder) == []


@contextmanager
def served(folder: Path, *words: str, **more: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A command that serves a page, and its address; it is interrupted after the block."""
    process = subprocess.Popen(
        command(folder, *words), cwd=folder, env=environment(**more), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    with process:
        assert process.stdout is not None
        assert process.stderr is not None
        found = re.search(r"http://(\S+)/", process.stdout.readline())
        try:
            assert found is not None, process.stderr.read()
            yield process, found[1]
        finally:
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=120)
            assert process.returncode == 0
            assert "Traceback" not in said


def test_an_identification_on_the_live_page_imports_nothing_from_the_folder(folder: Path) -> None:
    connect = pytest.importorskip("websockets.sync.client").connect
    if not (libraries.PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py")
    with (
        served(folder, "live", "coax", "--port", "0") as (_, host),
        connect(f"ws://{host}/socket", origin=f"http://{host}") as page,
    ):

        def say(**message: object) -> None:
            page.send(json.dumps(message))

        def until(what: object) -> None:
            while True:
                moment = json.loads(page.recv(timeout=120.0))
                if moment["type"] == "told" and what(moment):  # type: ignore[operator]
                    return

        version = json.loads(page.recv(timeout=120.0))["version"]
        say(type="record", value=True)
        page.send(told(version, 1, 350))  # which it flew
        until(lambda m: (m["recording"] or 0.0) > 3.0)
        say(type="record", value=False)
        until(lambda m: m["recordings"])
        say(type="identify", recording=1, how="responses")
        until(lambda m: m["job"] is not None and m["job"][1] != "running")
    assert marks(folder) == []


# ---- doors ----------------------------------------------------------------------------------------------------------
def doors(process: int) -> set[tuple[str, str]]:
    """What a process and those that it has started can be reached by: (kind, address)."""
    psutil = pytest.importorskip("psutil", reason="psutil is not installed")
    one = psutil.Process(process)
    found = set()
    for member in (one, *one.children(recursive=True)):
        for seen in member.net_connections(kind="all"):
            if seen.family == socket.AF_UNIX:
                if seen.laddr:
                    found.add(("unix", seen.laddr.lstrip("\0@")))
            elif seen.status == psutil.CONN_LISTEN or seen.type == socket.SOCK_DGRAM:
                found.add(("tcp" if seen.type == socket.SOCK_STREAM else "udp", seen.laddr.ip))
    return found


def test_a_campaign_opens_no_door(folder: Path) -> None:
    write_campaign(folder, CAMPAIGN.replace("count = 2", "count = 100").replace("0.2s", "2s"))
    process = subprocess.Popen(
        command(folder, "campaign", "run", "c.toml", "-o", "out", "--workers", "2"), cwd=folder,
        env=environment(**{progress_lines.SWITCH: "lines"}), stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    with process:
        assert process.stderr is not None
        try:
            for line in process.stderr:
                told = progress_lines.parse(line.rstrip())
                if told is not None and told.done:
                    break
            assert process.poll() is None, "it is at work"
            opened = doors(process.pid)
        finally:
            process.terminate()
    assert opened == set()


def test_a_page_is_one_door_of_this_machine(folder: Path) -> None:
    if not (libraries.PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py")
    (folder / "a.csv").write_text("time [s],p [rad/s]\n" + "".join(f"{0.01 * i},{i % 7}\n" for i in range(300)))
    for words in (("live", "coax"), ("open", "a.csv")):
        with served(folder, *words, "--port", "0") as (process, host):
            assert doors(process.pid) == {("tcp", "127.0.0.1")}, words
            assert host.startswith("127.0.0.1:")
