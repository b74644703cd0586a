"""The first commands of a journey on this machine, whatever it is, and on one without what only POSIX has.

The public workflow runs this file on Linux, macOS and Windows with the README's installation and pytest alone. In
`make test` the other tests of the command line stand for this machine as it is.
"""

from __future__ import annotations

import os
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from other_machine import hide_posix, started


@pytest.fixture(scope="module", params=[pytest.param("as it is", marks=pytest.mark.proof), "without POSIX"])
def machine(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, str], Path]:
    """The environment of its processes, and a folder to work in with a flight."""
    folder = tmp_path_factory.mktemp("machine")
    environment = dict(os.environ) if request.param == "as it is" else hide_posix(folder / "hiding")
    here = folder / "here"
    here.mkdir()
    flown = ("simulate", "--vehicle", "coax", "--maneuver", "multisine:roll+pitch,0.4-4Hz,15s,0.1", "-o", "flight.nc")
    started(environment, here, "-P", "-m", "swashplate", *flown)
    return environment, here


def swash(machine: tuple[dict[str, str], Path], *words: str) -> str:
    return started(machine[0], machine[1], "-P", "-m", "swashplate", *words)


def test_help_and_inspect(machine: tuple[dict[str, str], Path]) -> None:
    assert "identify" in swash(machine, "--help")
    assert "coax, simulated" in swash(machine, "inspect", "flight.nc")


def test_respond(machine: tuple[dict[str, str], Path]) -> None:
    swash(machine, "respond", "flight.nc", "--inputs", "servo_roll", "--outputs", "p", "-o", "response", "--quiet")
    assert (machine[1] / "response" / "report.html").is_file()


def test_identify(machine: tuple[dict[str, str], Path]) -> None:
    asked = ("--vehicle", "coax", "--flight", "flight.nc", "--free", "tau_f_upper")
    swash(machine, "identify", *asked, "--out", "fit", "--quiet")
    assert (machine[1] / "fit" / "model.toml").is_file()


def test_control_gains(machine: tuple[dict[str, str], Path]) -> None:
    assert "ATC_RAT_RLL_P" in swash(machine, "control", "gains", "coax", "--settings", "fly=false")


def test_export(machine: tuple[dict[str, str], Path]) -> None:
    swash(machine, "export", "coax", "--format", "c", "-o", "firmware")
    assert (machine[1] / "firmware" / "coax.c").is_file()


def test_open(machine: tuple[dict[str, str], Path]) -> None:
    environment, here = machine
    command = [sys.executable, "-P", "-m", "swashplate", "open", "flight.nc", "--port", "0"]
    with subprocess.Popen(command, cwd=here, env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            address = next(word for word in process.stdout.readline().split() if word.startswith("http"))
            with urllib.request.urlopen(address) as page:
                assert b"swash" in page.read()
        finally:
            process.terminate()
