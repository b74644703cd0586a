"""Registries: what the package has, what others add, and what is said where neither has it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from swashplate.errors import SwashError
from swashplate.registry import Registry


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Registry[object]]:
    """One thing of our own; two of a package that is installed beside it, one of which cannot be imported."""
    (tmp_path / "gliding.py").write_text("glider = 'a glider'\n")
    about = tmp_path / "gliding-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: gliding\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[swashplate.things]\nglider = gliding:glider\nbroken = gliding_lost:nothing\npi = gliding:glider\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    yield Registry("things", what="thing", own={"pi": "math:pi"})
    sys.modules.pop("gliding", None)


def test_own_things_and_those_of_other_packages(registry: Registry[object]) -> None:
    assert list(registry) == ["pi", "glider", "broken"]
    assert registry["glider"] == "a glider"
    assert "glider" in registry
    assert "lost" not in registry


def test_another_package_does_not_replace_one_of_ours(registry: Registry[object]) -> None:
    assert registry["pi"] == pytest.approx(3.14159, abs=1e-5)


def test_a_name_that_nobody_has_is_told_with_the_nearest(registry: Registry[object]) -> None:
    with pytest.raises(
        SwashError, match=r"glidr: is no thing; expected one of pi, glider, broken.*Did you mean 'glider'"
    ):
        registry["glidr"]


def test_a_package_that_cannot_be_imported_is_named(registry: Registry[object]) -> None:
    with pytest.raises(SwashError, match=r"broken: cannot be loaded from gliding_lost:nothing of gliding"):
        registry["broken"]
