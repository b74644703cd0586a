"""The persistent compilation cache: where it goes, and that a folder that cannot be used changes nothing."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import jax
import jax.numpy as jnp
import pytest
from jax.experimental.compilation_cache import compilation_cache

from swashplate.simulation import compilation
from swashplate.simulation.compilation import enable_compilation_cache

SCANDIR = os.scandir
OPTIONS = (
    "jax_compilation_cache_dir",
    "jax_persistent_cache_min_compile_time_secs",
    "jax_persistent_cache_min_entry_size_bytes",
)


@pytest.fixture(autouse=True)
def restored():
    before = {name: jax.config.values[name] for name in OPTIONS}
    yield
    for name, value in before.items():
        jax.config.update(name, value)
    compilation_cache.reset_cache()


def test_the_folder_is_made_and_used(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    assert enable_compilation_cache(folder) == folder
    assert folder.is_dir()
    assert jax.config.values["jax_compilation_cache_dir"] == str(folder)


def test_by_default_it_is_in_the_users_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jax.config.update("jax_compilation_cache_dir", None)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    chosen = enable_compilation_cache()
    assert chosen is not None
    assert chosen.parts[-2:] == ("swashplate", "jax")


def test_a_folder_that_cannot_be_made_changes_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    before = jax.config.values["jax_compilation_cache_dir"]
    assert enable_compilation_cache(tmp_path / "file" / "cache") is None
    assert jax.config.values["jax_compilation_cache_dir"] == before


def test_small_loops_are_asked_for_once_and_a_users_options_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    from swashplate.simulation.compilation import compile_small_loops_whole

    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_enable_fast_math=false")
    compile_small_loops_whole()
    compile_small_loops_whole()
    assert os.environ["XLA_FLAGS"].startswith("--xla_cpu_enable_fast_math=false --xla_backend_extra_options=")
    assert os.environ["XLA_FLAGS"].count("xla_backend_extra_options") == 1
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_extra_options=other=1")
    compile_small_loops_whole()
    assert os.environ["XLA_FLAGS"] == "--xla_backend_extra_options=other=1"


def _compiled(folder: Path) -> float:
    """What comes of something that is compiled with this folder; warnings are errors here."""
    compilation_cache.reset_cache()  # as in a new process
    enable_compilation_cache(folder)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    return float(jax.jit(lambda x: jnp.sin(x) * 3.0)(2.0))


def test_an_entry_that_was_cut_off_is_made_anew(tmp_path: Path) -> None:
    found = _compiled(tmp_path)
    whole = {path.name: path.stat().st_size for path in tmp_path.glob("*-cache")}
    assert whole
    for path in tmp_path.glob("*-cache"):
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert _compiled(tmp_path) == found
    healed = {path.name: path.stat().st_size for path in tmp_path.glob("*-cache")}
    assert healed.keys() == whole.keys()
    for name, size in whole.items():
        assert healed[name] > size // 2
    assert _compiled(tmp_path) == found


def test_what_was_whole_is_not_unpacked_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a-cache").write_bytes(zlib.compress(b"code"))
    (tmp_path / "b-cache").write_bytes(zlib.compress(b"code" * 100)[:-5])
    (tmp_path / "a-atime").write_bytes(b"other")
    unpacked = []
    monkeypatch.setattr(compilation, "_unpacks", lambda content: unpacked.append(content) or len(unpacked) == 1)
    monkeypatch.setattr(compilation.os, "scandir", _in_order)
    enable_compilation_cache(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a-atime", "a-cache", "checked.json"]
    enable_compilation_cache(tmp_path)
    assert len(unpacked) == 2


@contextmanager
def _in_order(folder: Path) -> Iterator[list[os.DirEntry[str]]]:
    with SCANDIR(folder) as entries:
        yield sorted(entries, key=lambda entry: entry.name)


def test_a_damaged_note_is_written_anew(tmp_path: Path) -> None:
    for text in ("{", "[]", "[" * 100_000):
        (tmp_path / "checked.json").write_text(text)
        assert enable_compilation_cache(tmp_path) == tmp_path
