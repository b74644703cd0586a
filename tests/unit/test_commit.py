"""The commit that an export names: of a checkout, one of several work trees, packed references, and none."""

from __future__ import annotations

from pathlib import Path

import pytest

from swashplate import commit as module
from swashplate.commit import commit, commit_of

DIGITS = "0123456789abcdef0123456789abcdef01234567"


def test_a_checkout_says_where_it_stands(tmp_path: Path) -> None:
    assert commit_of(tmp_path) == ""
    git = tmp_path / ".git"
    (git / "refs" / "heads").mkdir(parents=True)
    (git / "HEAD").write_text(DIGITS)
    assert commit_of(tmp_path) == DIGITS[:12]
    (git / "HEAD").write_text("ref: refs/heads/main\n")
    (git / "packed-refs").write_text(f"# pack-refs\n{DIGITS[::-1]} refs/heads/main2\n{DIGITS} refs/heads/main\n")
    assert commit_of(tmp_path) == DIGITS[:12]
    (git / "refs" / "heads" / "main").write_text(f"{DIGITS[::-1]}\n")
    assert commit_of(tmp_path) == DIGITS[::-1][:12]
    other = tmp_path / "other"
    (git / "worktrees" / "other").mkdir(parents=True)
    other.mkdir()
    (other / ".git").write_text(f"gitdir: {git / 'worktrees' / 'other'}\n")
    (git / "worktrees" / "other" / "commondir").write_text("../..\n")
    (git / "worktrees" / "other" / "HEAD").write_text("ref: refs/heads/main\n")
    assert commit_of(other) == DIGITS[::-1][:12]


@pytest.mark.parametrize("head", ["", "ref: refs/heads/none", "<script>", "ref: ../../etc/passwd", "0123"])
def test_what_is_no_commit_is_none(head: str, tmp_path: Path) -> None:
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git" / "HEAD").write_text(head)
    assert commit_of(tmp_path) == ""


def test_a_wheel_says_what_it_was_built_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "__file__", str(tmp_path / "swashplate" / "commit.py"))
    assert commit() == ""
    (tmp_path / "swashplate").mkdir()
    (tmp_path / "swashplate" / module.BUILT).write_text(DIGITS[:12])
    assert commit() == DIGITS[:12]
