"""`swash link`: what it refuses, and a whole flight of packets against a process of its own."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from commands import one_message, saying, swash

import swashplate as sp
from heli_autopilot import servo_packet

IDLE = [1500, 1500, 1500, 1500, 1000, 1000]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["ardupilot", "--vehicle", "nowhere"], "neither a vehicle's name nor a file"),
        (["ardupilot", "--vehicle", "lynx"], "no servo mapping 'lynx'"),
        (["ardupilot", "--vehicle", "coax", "--servos", "raptor50"], "the equations of 'coax'"),
        (["ardupilot", "--vehicle", "coax", "--servos", "none.toml"], "neither the name of a servo mapping nor a file"),
        (["ardupilot", "--vehicle", "coax", "--settings", "listen=nonsense"], "no IPv4 address"),
        (["ardupilot", "--vehicle", "coax", "--record", "flight.txt"], "expected .nc or .csv"),
        (["ardupilot", "--vehicle", "coax", "--record", "nowhere/flight.nc"], "the folder does not exist"),
        (["ardupilot", "--vehicle", "coax", "--settings", "voltage=-1"], "expected 0 to 1000"),
        (["px4", "--vehicle", "lynx"], "no servo mapping 'lynx_px4'"),
        (["px4", "--vehicle", "x8"], "a multirotor's motors have no servo mapping"),
        (["ardupilot", "--vehicle", "crazyflie"], "Fly it with `swash live`"),
    ],
)
def test_what_is_refused(arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert words in one_message(swash("link", *arguments, "--settings", "idle_exit=0.2"))


@pytest.mark.parametrize(("verb", "kind"), [("ardupilot", socket.SOCK_DGRAM), ("px4", socket.SOCK_STREAM)])
def test_a_port_in_use_is_exit_2(verb: str, kind: socket.SocketKind) -> None:
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        if kind is socket.SOCK_STREAM:
            taken.listen(1)
        port = str(taken.getsockname()[1])
        message = one_message(swash("link", verb, "--vehicle", "coax", "--port", port, "--quiet"))
    assert f"port {port} on 127.0.0.1 is in use by another program" in message


@pytest.mark.parametrize("verb", ["ardupilot", "px4"])
def test_a_check_without_an_autopilot_is_exit_2(verb: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"udp:127.0.0.1:{taken.getsockname()[1]}"
        command = ["link", "check", "--firmware", verb, "--vehicle", "coax", "--settings", "timeout=0.3", "--mavlink"]
        assert "is in use by another program" in one_message(swash(*command, address))
    assert "no autopilot was heard within 0.3 s" in one_message(swash(*command, address))


def test_a_link_in_a_process_of_its_own(tmp_path: Path) -> None:
    """Only this machine is listened to, packets are answered, an interrupt ends it well and the flight is kept."""
    record = tmp_path / "flown.nc"
    command = [sys.executable, "-m", "swashplate", "link", "ardupilot", "--vehicle", "coax", "--port", "0"]
    with (
        subprocess.Popen([*command, "--record", str(record)], stderr=subprocess.PIPE, text=True) as link,
        ExitStack() as clean,
    ):
        clean.callback(link.kill)
        assert link.stderr is not None
        said = link.stderr.readline()
        found = re.search(r"UDP (\S+):(\d+)", said)
        assert found, said
        assert found[1] == "127.0.0.1"
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(10.0)
            client.connect(("127.0.0.1", int(found[2])))
            for count in range(400):
                client.send(servo_packet(400, count, [*IDLE[:4], 1300, 1300]))
                told = json.loads(client.recv(4096))
        link.send_signal(signal.SIGINT)
        _, said = link.communicate(timeout=30)
    assert link.returncode == 0, said
    assert told["timestamp"] == pytest.approx(1.0)
    assert told["rpm"]["rpm_1"] > 500.0
    assert "400 exchanges" in said
    flight = sp.read(record)
    assert flight.duration == pytest.approx(1.0, abs=0.02)
    assert flight.values("omega_lower")[-1] == pytest.approx(told["rpm"]["rpm_1"] * 3.141592653589793 / 30.0, rel=0.02)
    assert flight.values("motor_lower")[-1] == pytest.approx(0.3)


@pytest.mark.proof  # files that grow and are cut off are in tests/unit/links/test_recorder.py
def test_a_killed_link_loses_nothing_of_what_it_answered(tmp_path: Path) -> None:
    """`kill -9` in flight, beside an older file of that name; the next link saves the flight before it begins."""
    record = tmp_path / "flown.nc"
    record.write_text("an older flight")
    command = [sys.executable, "-m", "swashplate", "link", "ardupilot", "--vehicle", "coax", "--port", "0"]
    with (
        subprocess.Popen([*command, "--record", str(record)], stderr=subprocess.PIPE, text=True) as link,
        ExitStack() as clean,
    ):
        clean.callback(link.kill)
        assert link.stderr is not None
        found = re.search(r"UDP (\S+):(\d+)", link.stderr.readline())
        assert found
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(10.0)
            client.connect(("127.0.0.1", int(found[2])))
            for count in range(400):
                client.send(servo_packet(400, count, [*IDLE[:4], 1300, 1300]))
                told = json.loads(client.recv(4096))
        link.send_signal(signal.SIGKILL)
    left = sp.read(tmp_path / "flown-2.growing")
    assert left.stop == pytest.approx(told["timestamp"], abs=0.006)
    assert left.provenance.damage == ()
    again = swash(
        "link", "ardupilot", "--vehicle", "coax", "--port", "0", "--settings", "idle_exit=0.1", "--record", record
    )
    assert again.code == 0, again.err
    assert "an earlier recording was cut off; its 1.0 s are saved" in " ".join(again.err.split())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flown-2.nc", "flown.nc"]
    assert sp.read(tmp_path / "flown-2.nc").streams["uniform"].identical(left.streams["uniform"])
    assert record.read_text() == "an older flight"


def test_a_model_file_is_a_vehicle(tmp_path: Path) -> None:
    file = tmp_path / "model.toml"
    sp.vehicle("coax").with_values({"mass": 0.333}, source="test", status="identified").save(file)
    outcome = swash("link", "ardupilot", "--vehicle", file, "--port", "0", "--settings", "idle_exit=0.1")
    assert outcome.code == 0, outcome.err
    assert "waiting for an autopilot" in outcome.err


def test_listening_beyond_this_machine_is_warned_of() -> None:
    outcome = swash(
        "link",
        "ardupilot",
        "--vehicle",
        "coax",
        "--port",
        "0",
        "--settings",
        "idle_exit=0.1",
        "--settings",
        saying(listen="0.0.0.0"),
    )
    assert outcome.code == 0
    assert "Listening beyond this machine" in outcome.err


@pytest.mark.proof  # what the file says is in tests/unit/links/test_link_parameters.py
def test_parameters_for_ardupilot_are_written_and_nothing_waits(tmp_path: Path) -> None:
    file = tmp_path / "raptor50.parm"
    outcome = swash("link", "parameters", "--vehicle", "raptor50", "--out", file)
    assert outcome.code == 0, outcome.err
    assert outcome.out.strip() == f"Written: {file}"
    assert "H_SW_TYPE,3\n" in file.read_text(encoding="utf-8")


def test_a_place_where_no_parameters_can_be_written_is_refused(tmp_path: Path) -> None:
    refused = swash("link", "parameters", "--vehicle", "raptor50", "--out", tmp_path / "no" / "x.parm")
    assert "the folder does not exist" in one_message(refused)
