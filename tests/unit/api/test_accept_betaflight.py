"""A trial of Betaflight: what is no SITL of it, or never flies, is said in words and leaves nothing behind.

A flight itself needs the firmware: what one gave is in `tests/unit/links/test_betaflight.py`.
"""

from __future__ import annotations

import os
import socket
import stat
import sys
from pathlib import Path
from typing import Any

import pytest

import swashplate as sp
from swashplate.api import accept_betaflight
from swashplate.api.accept_betaflight import accept_multirotor
from swashplate.api.link import write_betaflight_configuration
from swashplate.api.saying import silent
from swashplate.api.verbs.link import Accept, LinkBetaflight
from swashplate.links.betaflight import trial

BINARY = Path(__file__).parents[2] / "betaflight_standin.py"
CRAZYFLIE = sp.vehicle("crazyflie")
GAINS = {"p_roll": 30.0}
pytestmark = pytest.mark.xdist_group("betaflight")
"""Its ports cannot be moved."""


def accept(out: Path, *, binary: Path = BINARY, vehicle: Any = CRAZYFLIE, **more: Any) -> Any:
    say = more.pop("say", silent)
    asked = Accept(vehicle, binary, folder=out, **{"timeout": 20.0, **more})
    return accept_multirotor(asked, asked.flying(vehicle), say, gains=GAINS)


@pytest.fixture(autouse=True)
def found_by_the_binary(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    monkeypatch.setattr(accept_betaflight, "stepped_clock", lambda state, folder: None)  # the stand-in reads no clock
    monkeypatch.setattr(accept_betaflight, "_PACE", 1.0)
    monkeypatch.setattr(trial, "_READY", 2.5)
    monkeypatch.setattr(trial, "_MEASURED", 1.5)
    monkeypatch.setattr(trial, "_STALLED", 2.0)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("", "armed: not within 2.5 s: THROTTLE CLI"),
        ("clock", "its clock runs at"),
        ("silent", "no motor packet came for 2 s"),
        ("dies", "the binary ended by SIGABRT; its last words: "),
    ],
)
def test_what_never_flies_is_a_line_that_fails(
    fault: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SWASH_STANDIN", fault)
    if fault != "clock":
        monkeypatch.setattr(trial, "_OFF", 100.0)  # a busy machine makes the stand-in slow, which is not asked here
    found = accept(tmp_path / "t")
    assert not found.passed
    assert any(words in text for text in found.problems), found.problems
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 9003))  # its process has ended
    assert "bind port" in (tmp_path / "t" / "sitl" / "sitl.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("fault", "words"), [("order", "pulses in another byte order"), ("few", "drives 2 motors, the vehicle has 4")]
)
def test_packets_of_another_kind_are_told_once(
    fault: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SWASH_STANDIN", fault)
    said: list[str] = []
    found = accept(tmp_path / "t", say=said.append)
    assert not found.passed
    assert sum(words in text for text in said) == 1, said


def test_a_refused_line_of_the_configuration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SWASH_STANDIN", "refuses")
    with pytest.raises(sp.SwashError, match="refuses a line of its configuration: ###ERROR IN mixer"):
        accept(tmp_path / "t")


def test_binaries_that_are_none(tmp_path: Path) -> None:
    def program(name: str, text: str, *, executable: bool = True) -> Path:
        path = tmp_path / name
        path.write_text(text)
        if executable:
            path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return path

    cases = {
        tmp_path / "missing": "there is no such file",
        tmp_path: "is no file",
        program("plain", "#!/bin/sh\n", executable=False): "is not executable",
        program("arm", "\x7fELF for another machine"): "cannot be run: Exec format error",
        program("tool", "#!/bin/sh\necho unknown option; exit 3\n"): "and ended; its last words: unknown option",
        program("silent", "#!/bin/sh\nsleep 60\n"): "did not load a configuration within 1 s",
    }
    for k, (binary, words) in enumerate(cases.items()):
        with pytest.raises(sp.SwashError, match=words):
            accept(tmp_path / f"out-{k}", binary=binary, timeout=1.0)


def test_ports_folders_and_vehicles_that_are_wrong(tmp_path: Path) -> None:
    for kind, port in ((socket.SOCK_STREAM, 5761), (socket.SOCK_DGRAM, 9003), (socket.SOCK_DGRAM, 9001)):
        with socket.socket(socket.AF_INET, kind) as taken:
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, kind is socket.SOCK_STREAM)
            taken.bind(("127.0.0.1", port))
            if kind is socket.SOCK_STREAM:
                taken.listen(1)
            with pytest.raises(sp.SwashError, match=f"port {port} .*in use"):
                accept(tmp_path / f"t{port}")
    (tmp_path / "there" / "sitl").mkdir(parents=True)
    with pytest.raises(sp.SwashError, match="is there already"):
        accept(tmp_path / "there")
    with pytest.raises(sp.SwashError, match="'heave' is none of roll, pitch, yaw"):
        accept(tmp_path / "axis", axes=("heave",))
    with pytest.raises(sp.SwashError, match="is no multirotor"):
        accept(tmp_path / "heli", vehicle=sp.vehicle("raptor50"))
    with pytest.raises(sp.SwashError, match=r"speedup: is 0\.01, expected 0\.1 to 100"):
        accept(tmp_path / "slow", speedup=0.01)


def test_a_link_that_nobody_comes_to(tmp_path: Path) -> None:
    with pytest.raises(sp.SwashError, match="no SITL of Betaflight runs here"):
        LinkBetaflight("crazyflie", wait=0.3).answer()
    with pytest.raises(sp.SwashError, match="the folder does not exist"):
        write_betaflight_configuration(CRAZYFLIE, tmp_path / "no" / "cli.txt")
