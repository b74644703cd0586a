"""A C compiler that speaks another language, hangs, lies in the folder of a log or is none is told in words."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import sys
from pathlib import Path

import pytest

from swashplate import compiled, compiler
from swashplate.errors import ExportError


def made(folder: Path, script: bytes, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A `cc` that is a shell script."""
    path = folder / "cc"
    path.write_bytes(b"#!/bin/sh\n" + script)
    path.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    return path


def test_messages_in_a_national_encoding_are_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made(tmp_path, "echo 'Datei nicht übersetzt' >&2; exit 1\n".encode("latin-1"), monkeypatch)
    with pytest.raises(ExportError, match="refused the exported sources: Datei nicht \ufffdbersetzt"):
        compiler.shared_library([tmp_path / "a.c"], tmp_path / "a.so")


def test_one_that_hangs_is_ended_with_all_that_it_has_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "held")
    cc = made(tmp_path, f"exec 9>{tmp_path}/held; sleep 1000 & sleep 1000\n".encode(), monkeypatch)
    reader = os.open(tmp_path / "held", os.O_RDONLY | os.O_NONBLOCK)
    with pytest.raises(ExportError, match=rf"a\.so: the C compiler {cc} has not ended after 1 s\. Try it by hand"):
        compiler.ran([str(cc), "a.c"], where="a.so", seconds=1.0)
    os.set_blocking(reader, True)
    assert os.read(reader, 1) == b"", "nobody holds it any more"
    os.close(reader)


def test_one_that_does_not_answer_is_told_of_once_and_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    cc = made(tmp_path, b"exec sleep 1000\n", monkeypatch)
    monkeypatch.setattr(compiler, "PATIENCE", 0.2)
    assert not compiled.can_compile()
    assert capsys.readouterr().err.startswith(
        f"No C is compiled: the C compiler {cc} has not ended after 0.2 s. Try it"
    )
    assert not compiled.can_compile()
    assert capsys.readouterr().err == ""
    with pytest.raises(ExportError, match=r"a\.so: the C compiler .* has not ended after 0\.2 s"):
        compiler.shared_library([tmp_path / "a.c"], tmp_path / "a.so")


def test_one_that_lies_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made(tmp_path, b"exit 0\n", monkeypatch)
    with pytest.raises(ExportError, match=r"a\.so: .*cc says that all is well, and wrote nothing"):
        compiler.shared_library([tmp_path / "a.c"], tmp_path / "a.so")


def test_one_that_does_not_know_this_processor_compiles_for_all_of_its_kind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = compiler.compiler()
    if there is None:
        pytest.skip("there is no C compiler")
    refusing = f'case "$*" in *{compiler.NATIVE}*) echo unsupported >&2; exit 1;; esac\nexec {" ".join(there)} "$@"\n'
    made(tmp_path, refusing.encode(), monkeypatch)
    (tmp_path / "a.c").write_text("double twice(double x);\ndouble twice(double x) { return 2 * x; }\n")
    built = compiler.shared_library([tmp_path / "a.c"], tmp_path / "a.so", options=(compiler.NATIVE,))
    assert ctypes.CDLL(str(built)).twice


def test_one_that_cannot_be_started_is_told(tmp_path: Path) -> None:
    (tmp_path / "cc").write_text("no program")
    with pytest.raises(ExportError, match=r"cc cannot be started: Permission denied"):
        compiler.ran([str(tmp_path / "cc")], where="a.so")


def test_what_lies_in_the_folder_one_works_in_is_no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cc = made(tmp_path, b"exit 0\n", monkeypatch)
    assert compiler.compiler() == (str(cc),)
    monkeypatch.chdir(tmp_path)
    for path in (".", "", f".{os.pathsep}"):
        monkeypatch.setenv("PATH", path)
        assert compiler.compiler() in (None, ZIG)


ZIG = (sys.executable, "-I", "-m", "ziglang", "cc")


def test_without_one_that_of_ziglang_is_taken_and_without_that_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    there = importlib.util.find_spec("casadi")
    monkeypatch.setattr(compiler, "find_spec", lambda name: there)
    assert compiler.compiler() == ZIG
    monkeypatch.setattr(compiler, "find_spec", lambda name: None)
    monkeypatch.setattr(compiled, "find_spec", lambda name: there)
    compiled._is_useful.cache_clear()
    assert not compiled.can_compile()
    assert not compiled.can_compile()
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "pip install 'swashplate[compiler]'" in told


@pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="the extra 'compiler' is not installed")
def test_ziglang_compiles_what_gcc_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.c").write_text("double twice(double x);\ndouble twice(double x) { return 2 * x; }\n")
    monkeypatch.setenv("PATH", str(tmp_path))
    made = ctypes.CDLL(str(compiler.shared_library([tmp_path / "a.c"], tmp_path / "a.so")))
    made.twice.restype, made.twice.argtypes = ctypes.c_double, [ctypes.c_double]
    assert made.twice(2.5) == 5.0


@pytest.mark.proof
@pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="the extra 'compiler' is not installed")
@pytest.mark.parametrize(("target", "ending"), [("x86_64-windows-gnu", "dll"), ("aarch64-macos", "dylib")])
def test_what_flies_and_fits_compiles_for_other_systems(target: str, ending: str, tmp_path: Path) -> None:
    """Nobody runs it there; ziglang brings the headers and libraries of these systems."""
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    import swashplate as sp
    from swashplate.engine.equations import equations_of
    from swashplate.engine.fly import flight_code

    program = compiler.ziglang()
    assert program is not None
    source = flight_code(equations_of(sp.vehicle("raptor50")), None, precision="double", lanes=1, quaternion=True)
    (tmp_path / "fly.c").write_text(source, encoding="utf-8")
    made = tmp_path / f"fly.{ending}"
    command = [*program, "-target", target, *compiler.STRICT, "-w", "-fPIC", "-shared", "-o", str(made)]
    code, _, said = compiler.ran([*command, str(tmp_path / "fly.c")], where=target)
    assert code == 0, said
    assert made.read_bytes()[:2] == (b"MZ" if ending == "dll" else b"\xcf\xfa")
