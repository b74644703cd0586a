"""What is kept is run later: folders that somebody else can write to are not used."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from swashplate import kept


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / "home" / "cache"
    monkeypatch.setattr(kept.platformdirs, "user_cache_dir", lambda *_, **__: str(place))
    return place


def test_it_is_made_for_this_user_alone(cache: Path) -> None:
    assert kept.cache_folder("c") == cache / "c"
    assert (cache / "c").stat().st_mode & 0o777 == 0o700
    assert kept.cache_folder("c") == cache / "c"


@pytest.mark.parametrize("shared", ["c", ".", ".."])
def test_where_others_can_write_nothing_is_kept(cache: Path, shared: str) -> None:
    kept.cache_folder("c")
    (cache / shared).chmod(0o777)
    assert kept.cache_folder("c") is None
    (cache / shared).chmod(0o1777)  # as /tmp: what lies in it stays its owner's
    assert (kept.cache_folder("c") is None) == (shared == "c")


def test_a_group_of_the_users_own_may_write_and_another_may_not(cache: Path) -> None:
    kept.cache_folder("c")
    (cache / "c").chmod(0o775)
    status = (cache / "c").stat()
    assert (kept.cache_folder("c") is not None) == (status.st_gid in (0, status.st_uid))
    if os.geteuid() == 0:
        os.chown(cache / "c", 0, 12345)
        assert kept.cache_folder("c") is None


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_what_another_user_has_made_is_not_used(cache: Path, tmp_path: Path) -> None:
    kept.cache_folder("c")
    os.chown(cache, 65534, 65534)
    assert kept.cache_folder("c") is None
    os.chown(cache, 0, 0)
    (cache / "c").rmdir()
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    os.chown(tmp_path / "elsewhere", 65534, 65534)
    (cache / "c").symlink_to(tmp_path / "elsewhere")
    assert kept.cache_folder("c") is None


def test_a_folder_that_cannot_be_made_is_none(cache: Path) -> None:
    cache.parent.write_text("a file where the folder should be")
    assert kept.cache_folder("c") is None
