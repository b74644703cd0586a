"""C that is compiled on this machine and kept."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest

from swashplate import compiled, kept
from swashplate.compiler import compiler
from swashplate.errors import ExportError

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")


def _loaded(source: str) -> ctypes.CDLL:
    return compiled.loaded(source, options=["-O1"])


SOURCE = "void body_frame(void);\nvoid body_frame(void) {}\n"


@pytest.fixture
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr(kept.platformdirs, "user_cache_dir", lambda name, **_: str(tmp_path / name))
    return tmp_path / "swashplate" / "c"


def test_it_is_compiled_once_and_without_a_compiler_not_offered(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _loaded(SOURCE)
    (first,) = cache.iterdir()
    stamp = first.stat().st_mtime_ns
    _loaded(SOURCE)
    assert first.stat().st_mtime_ns == stamp
    _loaded(SOURCE + "\n")
    assert sorted(f.suffix for f in cache.iterdir()) == [".so", ".so"], "what was made on the way is gone"
    monkeypatch.setattr(compiled, "compiler", lambda: None)
    assert not compiled.can_compile()


def test_a_damaged_library_is_made_anew(cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _loaded(SOURCE)
    (found,) = cache.iterdir()
    monkeypatch.setattr(kept.platformdirs, "user_cache_dir", lambda name, **_: str(tmp_path / "other" / name))
    damaged = tmp_path / "other" / "swashplate" / "c" / found.name  # a path that the loader has not seen
    damaged.parent.mkdir(parents=True)
    damaged.write_bytes(b"no library")
    assert _loaded(SOURCE).body_frame
    assert damaged.read_bytes()[:4] == found.read_bytes()[:4]


def test_where_nothing_can_be_kept_it_still_steps(cache: Path) -> None:
    cache.parent.write_text("a file where the folder should be")
    assert _loaded(SOURCE).body_frame


def test_another_processor_has_a_library_of_its_own(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled.loaded(SOURCE, options=[compiled.NATIVE])
    program = compiler()
    assert program is not None
    told, useless = compiled.answer(program)
    assert "__x86_64__" in told or "__aarch64__" in told
    assert useless == ""
    monkeypatch.setattr(compiled, "answer", lambda program: ("another", ""))
    compiled.loaded(SOURCE, options=[compiled.NATIVE])
    assert len(list(cache.iterdir())) == 2


def test_what_does_not_load_is_not_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "shared_library", lambda sources, out, options: out.write_bytes(b"no library"))
    with pytest.raises(ExportError, match=r"body\.so: what .* made does not load"):
        _loaded(SOURCE)
    assert list(cache.iterdir()) == []
