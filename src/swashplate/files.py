"""Files of users, read whole and within bounds; nothing that is no file (a pipe, a device) is waited for."""

from __future__ import annotations

import errno
import os
import stat
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from swashplate.systems import BYTES, NOT_WAITING, READ_AT

_AT_LEAST = 1 << 16
"""Bytes that are read of a file whose size the system does not say."""
_NEAR = 1 << 16
"""Bytes that are read where a few are asked for."""


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


class BytesOnDisk:
    """A file's bytes where they lie, each part read when it is asked for; raises as `read_bytes`.

    They are not mapped: where a mapped file is cut off while it is looked at, the system ends the process.
    """

    def __init__(self, path: str | os.PathLike[str], *, most: int) -> None:
        with _opened(path) as (file, self._size):
            _refuse_longer(self._size, most, path)
            self._file = os.dup(file.fileno())
        weakref.finalize(self, os.close, self._file)
        self._path = os.fspath(path)
        self._last = (0, b"")
        self._one_at_a_time = threading.Lock()

    def __len__(self) -> int:
        return self._size

    def part(self, begin: int, end: int) -> bytes:
        """The bytes from `begin` to `end` or the last one.

        Raises:
            OSError: where the file has become shorter since it was opened, or its disk fails.
        """
        wanted = max(0, min(end, self._size) - begin)
        content = self._read(begin, wanted)
        while len(content) < wanted and (more := self._read(begin + len(content), wanted - len(content))):
            content += more
        if len(content) < wanted:
            problem = f"it was cut off while it was read: it had {self._size:,} bytes"
            raise OSError(errno.ENODATA, problem, self._path)
        return content

    def _read(self, begin: int, count: int) -> bytes:
        if READ_AT is not None:
            return READ_AT(self._file, count, begin)
        with self._one_at_a_time:
            os.lseek(self._file, begin, os.SEEK_SET)
            return os.read(self._file, count)

    def __getitem__(self, chosen: slice) -> bytes:
        """A few bytes: those beside them come with them, for they are likely to be next."""
        begin, end, _ = chosen.indices(self._size)
        at, near = self._last
        if not at <= begin <= end <= at + len(near):
            if end - begin > _NEAR:
                return self.part(begin, end)
            at, near = self._last = (begin, self.part(begin, begin + _NEAR))
        return near[begin - at : end - at]

    def find(self, what: bytes, start: int = 0) -> int:
        """Where these bytes stand for the first time from `start` on, -1 if nowhere."""
        for begin in range(start, self._size, _NEAR):
            if (at := self[begin : begin + _NEAR + len(what) - 1].find(what)) >= 0:
                return begin + at
        return -1


def read_text(path: str | os.PathLike[str], *, most: int = 32 << 20) -> str:
    """A text file (UTF-8, with or without a byte order mark). Raises as `read_bytes`, and UnicodeDecodeError."""
    return read_bytes(Path(path), most=most).decode("utf-8-sig")


def is_file(path: str | os.PathLike[str]) -> bool:
    """Whether there is such a file; False where the system will not even look (a name too long, no permission)."""
    try:
        return Path(path).is_file()
    except OSError:
        return False
