"""Files of users, read whole and within bounds; nothing that is no file (a pipe, a device) is waited for."""

from __future__ import annotations

import errno
import mmap
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from swashplate.systems import BYTES, NOT_WAITING

_AT_LEAST = 1 << 16
"""Bytes that are read of a file whose size the system does not say."""


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[tuple[BinaryIO, int]]:
    """A file that is open, and its size; see `read_bytes`."""
    descriptor = os.open(path, os.O_RDONLY | NOT_WAITING | BYTES)
    with os.fdopen(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            problem = "it is a pipe or a device; write what it gives into a file first"
            raise OSError(errno.EINVAL, problem, os.fspath(path))
        yield file, status.st_size


def _refuse_longer(size: int, most: int, path: str | os.PathLike[str]) -> None:
    if size > most:
        raise OSError(errno.EFBIG, f"it has more than {most:,} bytes", os.fspath(path))


def read_bytes(path: str | os.PathLike[str], *, most: int) -> bytes:
    """A file's bytes.

    Args:
        path: the file.
        most: bytes that are read.

    Raises:
        OSError: where it is missing, cannot be read, is a folder, a pipe or a device (nobody may ever write into the
            one, the other may have no end), or has more bytes.
        ValueError: for a path with a zero byte.
    """
    with _opened(path) as (file, size):
        likely = max(size, _AT_LEAST)
        content = file.read(min(most, likely) + 1)  # memory is set aside for what is asked for
        if likely < len(content) <= most:  # it grew
            content += file.read(most + 1 - len(content))
    _refuse_longer(len(content), most, path)
    return content


def map_bytes(path: str | os.PathLike[str], *, most: int) -> mmap.mmap:
    """A file's bytes where they lie on disk, at least one of them. Raises as `read_bytes`."""
    with _opened(path) as (file, size):
        _refuse_longer(size, most, path)
        return mmap.mmap(file.fileno(), size, access=mmap.ACCESS_READ)


def read_text(path: str | os.PathLike[str], *, most: int = 32 << 20) -> str:
    """A text file (UTF-8, with or without a byte order mark). Raises as `read_bytes`, and UnicodeDecodeError."""
    return read_bytes(Path(path), most=most).decode("utf-8-sig")


def is_file(path: str | os.PathLike[str]) -> bool:
    """Whether there is such a file; False where the system will not even look (a name too long, no permission)."""
    try:
        return Path(path).is_file()
    except OSError:
        return False
