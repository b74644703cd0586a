"""`swash live` and `swash replay` where something is wrong, and a served page from start to interrupt."""

from __future__ import annotations

import hashlib
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest
from commands import one_message, swash

import swashplate as sp
from swashplate.links.web import libraries, serving


@pytest.fixture(autouse=True)
def page_is_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The page's libraries are not what is tested here."""
    (tmp_path / "page" / "vendor").mkdir(parents=True)
    for name in ("three.module.min.js", "uPlot.esm.js"):
        (tmp_path / "page" / "vendor" / name).touch()
    monkeypatch.setattr(libraries, "PAGE", tmp_path / "page")
    empty = hashlib.sha256(b"").hexdigest()
    monkeypatch.setattr(libraries, "LIBRARIES", {"three.module.min.js": empty, "uPlot.esm.js": empty})


def test_a_port_in_use_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        for command in (["live", "coax"], ["live", "--replay", "nothing.nc"]):
            assert "--port 0 takes any free port" in one_message(swash(*command, "--port", port))


@pytest.mark.parametrize("command", [["live", "coax"], ["live", "--replay", "nothing.nc"]])
def test_other_machines_are_let_in_only_when_asked_to(command: list[str]) -> None:
    assert "allow_remote=true" in one_message(swash(*command, "--settings", "host=0.0.0.0", "--port", "0"))
    assert "no address of this machine" in one_message(
        swash(*command, "--settings", "host=nowhere.invalid", "--port", "0")
    )


def test_live_refuses_what_cannot_fly(tmp_path: Path) -> None:
    assert "neither a vehicle's name nor a file" in one_message(swash("live", "nosuch", "--port", "0"))
    file = tmp_path / "file"
    file.write_text("x")
    assert "expected a folder" in one_message(swash("live", "coax", "--port", "0", "--out", file))
    assert "is not TOML" in one_message(swash("live", "coax", "--port", "0", "--controller", _broken(tmp_path)))
    coax = sp.vehicle("coax")
    from swashplate.control.kinds import save_controller

    save_controller(sp.autopilot(coax, sp.trim(coax)), tmp_path / "coax-controller.toml")
    told = one_message(swash("live", "raptor50", "--port", "0", "--controller", tmp_path / "coax-controller.toml"))
    assert "is for 'coax', not for 'conventional'" in told


def test_a_linear_model_flies_by_hand_but_stands_under_no_autopilot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for system in ("ardupilot", "px4"):
        told = one_message(swash("link", system, "--vehicle", "thirteen_state", "--port", "0"))
        assert "without ground, rotors or a battery" in told
        assert "swash live" in told
    file = tmp_path / "linear.toml"
    file.write_text('kind = "state-space"\nschema = 1\n')
    for command in (["live", file], ["link", "ardupilot", "--vehicle", file]):
        told = one_message(swash(*command, "--port", "0"))
        assert "linear.toml" in told
        assert "lacks equations, inputs" in told
    assert "no equation for u, v, w" in one_message(swash("live", "rotor_body", "--port", "0"))
    monkeypatch.setattr(serving, "serve", lambda _, on, *, begun, **__: begun(serving.address_of(on)))
    outcome = swash("live", "thirteen_state", "--port", "0", "--out", tmp_path / "live")
    assert outcome.code == 0, outcome.err
    assert "http://" in outcome.out
    assert "A linear model: deviations from one trim" in outcome.err
    assert "range of lateral, longitudinal, pedal, collective: assumed" in outcome.err


def test_without_what_makes_webassembly_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swashplate.links.live.frame_code.web_compiler", lambda: None)
    outcome = swash("live", "thirteen_state", "--port", "0", "--out", tmp_path / "live")
    assert (outcome.code, outcome.out) == (2, "")
    assert "a page in which a model flies needs the library ziglang" in outcome.err
    assert "swashplate[compiler]" in outcome.err
    assert not (tmp_path / "live").exists()


def test_what_is_misspelt_is_told_before_what_a_checkout_lacks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "PAGE", tmp_path / "nothing")
    for command in (
        ["live", "nosuch"],
        ["live", "--replay", "nothing.nc"],
        ["live", "nosuch", "--replay", "nothing.nc"],
    ):
        assert "vendor" not in one_message(swash(*command, "--port", "0"))
    told = one_message(swash("live", "coax", "--port", "0", "--controller", _broken(tmp_path)))
    assert "is not TOML" in told
    assert "vendor_page.py" in one_message(swash("live", "coax", "--port", "0"))


def _broken(folder: Path) -> Path:
    path = folder / "broken.toml"
    path.write_text("kind = ")
    return path


def test_replay_refuses_what_it_cannot_show(tmp_path: Path) -> None:
    assert "nothing.nc" in one_message(swash("live", "--replay", "nothing.nc", "--port", "0"))
    (tmp_path / "poor.csv").write_text("time [s],p [rad/s]\n" + "".join(f"{0.01 * i},{i % 7}\n" for i in range(300)))
    told = one_message(swash("live", "coax", "--replay", tmp_path / "poor.csv", "--port", "0"))
    assert "lacks x, y, z" in told
    assert "It has p" in told


def test_serves_until_interrupted(tmp_path: Path) -> None:
    if not (libraries.PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py")
    command = [sys.executable, "-m", "swashplate", "live", "coax", "--port", "0"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        with urllib.request.urlopen(found[0], timeout=10.0) as page:
            assert b"swash live" in page.read()
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=20.0)
    assert process.returncode == 0
    assert said == ""
    assert not (tmp_path / "live").exists(), "nothing was recorded, nothing is left"
