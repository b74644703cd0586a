"""Files that are read whole: what is none is refused at once."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from swashplate import files


def test_a_file_is_read_up_to_its_bound(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbfab")
    assert files.read_bytes(path, most=5) == b"\xef\xbb\xbfab"
    assert files.read_text(path) == "ab"
    with pytest.raises(OSError, match="more than 4 bytes"):
        files.read_bytes(path, most=4)
    with pytest.raises(FileNotFoundError):
        files.read_bytes(tmp_path / "b.txt", most=4)


def test_pipes_devices_and_folders_are_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero"), tmp_path):
        with pytest.raises(OSError, match=r"pipe or a device; write what it gives into a file|directory"):
            files.read_bytes(path, most=4)


def test_a_name_that_the_system_refuses_is_no_file(tmp_path: Path) -> None:
    assert not files.is_file(tmp_path / ("a" * 400))
    assert not files.is_file("a\0b")
    (tmp_path / "a").touch()
    assert files.is_file(tmp_path / "a")
