"""The persistent compilation cache: where it goes, and that a folder that cannot be used changes nothing."""

from __future__ import annotations

import os
from pathlib import Path

import jax
import pytest

from swashplate.simulation.compilation import enable_compilation_cache

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
