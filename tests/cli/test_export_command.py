"""`swash export`: files, names, notes, and what is refused in words."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from commands import one_message, swash

import swashplate as sp
from swashplate import compiler
from swashplate.commit import commit
from swashplate.control.kinds import save_controller
from swashplate.export import fmu
from swashplate.models.linear.state_space_file import structure, to_toml

pytest.importorskip("casadi", reason="the extra 'model' is not installed")


@pytest.mark.parametrize(
    ("form", "files"),
    [
        ("c", {"coax.c", "coax.h", "coax_example.c"}),
        ("control", {"coax_control.json"}),
        ("matlab", {"coax.mat"}),
        ("simulink", {"coax.c", "coax.h", "coax_sfun.c", "sfun_model.h"}),
    ],
)
def test_a_vehicle_in_each_format(form: str, files: set[str], tmp_path: Path) -> None:
    out = tmp_path / "deep" / "folder"
    outcome = swash("export", "coax", "--format", form, "--out", out, "--set", "bar=false")
    assert outcome.code == 0, outcome.err
    assert {file.name for file in out.iterdir()} == files
    assert all(name in outcome.out for name in files)


def test_an_identified_model_with_another_name_mass_and_precision(tmp_path: Path) -> None:
    sp.vehicle("coax", bar=False).with_values({"tau_f_lower": 0.123}, status="identified").save(tmp_path / "model.toml")
    arguments = ("--format", "c", "--out", tmp_path, "--name", "my heli", "--set", "mass=0.3", "--precision", "float")
    document = json.loads(swash("export", tmp_path / "model.toml", *arguments, "--json").out)
    assert [Path(file).name for file in document["files"]] == ["my_heli.h", "my_heli.c", "my_heli_example.c"]
    source = (tmp_path / "my_heli.c").read_text()
    assert "0.3f" in source
    assert "0.123f" in source
    assert "identified" in (tmp_path / "my_heli.h").read_text()


def test_the_trim_of_the_speed_is_where_it_starts(tmp_path: Path) -> None:
    assert swash("export", "raptor50", "--format", "control", "--speed", "5", "--out", tmp_path, "-q").out == ""
    about = json.loads((tmp_path / "raptor50_control.json").read_text())["about"]
    assert about["u"] == pytest.approx(5.0, abs=0.05)


def test_a_linear_model_and_a_controller(tmp_path: Path) -> None:
    (tmp_path / "linear.toml").write_text(to_toml(structure("hybrid")))
    outcome = swash("export", tmp_path / "linear.toml", "--format", "c", "--out", tmp_path)
    assert outcome.code == 0, outcome.err
    assert "Delays are not in these equations" in outcome.err
    assert "one flight" not in outcome.err
    assert "no speed" in one_message(swash("export", tmp_path / "linear.toml", "--format", "c", "--speed", "3"))
    for name, folder in (("hybrid", "by-name"), (tmp_path / "linear.toml", "by-file")):
        swash("export", name, "--format", "control", "--name", "model", "--out", tmp_path / folder)
    named, filed = ((tmp_path / f / "model_control.json").read_text() for f in ("by-name", "by-file"))
    assert named == filed, "a ready structure's name is its file"

    controller = tmp_path / "hold.toml"
    coax = sp.vehicle("coax")
    save_controller(sp.autopilot(coax, sp.trim(coax)), controller)
    outcome = swash("export", controller, "--format", "c", "--out", tmp_path, "--precision", "float")
    assert outcome.code == 0, outcome.err
    assert "void swash_step(float memory" in (tmp_path / "hold.c").read_text()
    assert "is a controller" in one_message(swash("export", controller, "--format", "fmu"))
    assert "this is a controller" in one_message(swash("export", controller, "--format", "c", "--speed", "3"))


def test_without_a_compiler_the_fmu_has_its_sources_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(compiler, "ziglang", lambda: None)
    outcome = swash("export", "coax", "--format", "fmu", "--out", tmp_path, "--set", "bar=false")
    assert outcome.code == 0
    assert "no C compiler" in outcome.err or fmu.fmu_platform() is None
    assert (tmp_path / "coax.fmu").stat().st_size > 10_000
    assert compiler.compiler() is None


def test_without_casadi_it_says_which_extra(tmp_path: Path) -> None:
    """In its own process: CasADi's objects do not outlive a module that is taken away."""
    script = "import sys; sys.modules['casadi'] = None; from swashplate.__main__ import main; main()"
    started = [sys.executable, "-P", "-c", script, "export", "coax", "--format", "c", "--out", str(tmp_path)]
    done = subprocess.run(started, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "pip install 'swashplate[model]'" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("coax", "--format", "fmu", "--precision", "float"), "are double"),
        (("coax", "--format", "c", "--name", "///"), "gives no name"),
        (("coax", "--format", "c", "--speed", "0-2"), "--speed: '0-2' is not a number"),
        (("raptor50", "--format", "c", "--speed", "60"), "needs theta0 = 61.2 deg, but its limit is 15.0 deg"),
        (("nothing.toml", "--format", "c"), "neither a vehicle's name nor a file"),
    ],
)
def test_what_is_refused(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    assert said in one_message(swash("export", *arguments, "--out", tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_a_card_that_is_no_toml_and_an_out_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(b"\xff\x00[")
    assert "bad.toml" in one_message(swash("export", tmp_path / "bad.toml", "--format", "c"))
    outcome = swash("export", "coax", "--format", "matlab", "--out", tmp_path / "bad.toml")
    assert "expected a folder" in one_message(outcome)


def test_an_output_with_a_suffix_is_the_files_name(tmp_path: Path) -> None:
    wanted = tmp_path / "deep" / "hover.json"
    done = swash("export", "raptor50", "--format", "control", "-o", wanted)
    assert done.code == 0, done.err
    assert done.out.split() == ["Written:", str(wanted)]
    assert [file.name for file in wanted.parent.iterdir()] == ["hover.json"]
    told = one_message(swash("export", "raptor50", "--format", "control", "-o", tmp_path / "hover.mat"))
    assert "ends in '.mat', and the format writes hover_control.json. Give a folder, or a name that ends so." in told
    assert not (tmp_path / "hover.mat").exists()


def test_a_log_becomes_a_page_and_says_what_is_in_it(tmp_path: Path) -> None:
    outcome = swash("export", "examples/ordinary_flight@70-90", "--format", "web", "--out", tmp_path / "sent.html")
    assert outcome.code == 0, outcome.err
    assert [file.name for file in tmp_path.iterdir()] == ["sent.html"]
    assert "Inside: 27 channels of 20.0 s" in outcome.err
    assert "Left out: latitude, longitude, the map; serial numbers;" in outcome.err
    log = sp.read("examples/ordinary_flight").provenance.sha256
    assert len(log) == 64
    text = (tmp_path / "sent.html").read_text(encoding="utf-8")
    assert re.search(
        rf"Made by swashplate [\w.]+, commit {re.escape(commit())}, from a log with the SHA-256 {log}", text
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nosuch.bin", "--format", "web"), "nosuch.bin: there is no such file"),
        (("broken.bin", "--format", "web"), "broken.bin"),
        (("examples/coax_flight", "--format", "c"), "is a log: --format web writes its page"),
        (("examples/coax_flight", "--format", "web", "--speed", "3"), "--speed: is for vehicles, and this is a log"),
        (("examples/coax_flight@900-950", "--format", "web"), "holds nothing"),
    ],
)
def test_a_log_that_becomes_no_page(
    arguments: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.bin").write_bytes(b"\xa3\x95" * 40)
    out = tmp_path / "out"
    outcome = swash("export", *arguments, "--out", out)
    assert outcome.code == 2
    assert words in one_message(outcome)
    assert not out.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="no limits of files")
def test_a_full_disk_leaves_no_page(tmp_path: Path) -> None:
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        arguments = ("examples/ordinary_flight@70-80", "--format", "web", "--out", tmp_path / "sent.html")
        outcome = swash("export", *arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert outcome.code == 2
    assert "sent.html: cannot be written" in one_message(outcome)
    assert list(tmp_path.iterdir()) == []
