"""A file that is being read: its bytes, its hash, and the errors before a reader sees it."""

from __future__ import annotations

import codecs
import hashlib
import os
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import FlightError
from swashplate.files import BytesOnDisk, read_bytes
from swashplate.flights.provenance import Provenance

# The largest file that is read and the largest content it may unpack to: an hour at 400 Hz of 100 channels is 1.2 GB.
LARGEST_FILE = 1 << 30
LARGEST_CONTENT = 2 << 30
# Deflate can shrink constants a thousandfold, so small files may claim this much more than they weigh. Measured
# numbers hardly shrink; beyond this ratio the sizes in the header are nonsense.
_FREE_CONTENT = 16 << 20
_LARGEST_RATIO = 40
_FOLDER_MARK = "metadata.yaml"  # of a rosbag2 folder
_LEFT_ON_DISK = 16 << 20  # bytes from which a file is not read at once: a reader that can looks at it where it lies
_HASHED = 1 << 20  # bytes at a time


class LogOnDisk(BytesOnDisk):
    """The bytes of a log that are left where they lie."""

    def part(self, begin: int, end: int) -> bytes:
        """The bytes from `begin` to `end` or the last one.

        Raises:
            FlightError: where the file was cut off since it was opened.
        """
        try:
            return super().part(begin, end)
        except OSError as error:
            raise FlightError(
                f"cannot be read: {error.strerror}.",
                where=error.filename,
                hint="Open it again when nothing writes to it any more.",
            ) from None


Stored = bytes | LogOnDisk
"""The bytes of a log, in memory or where they lie on disk."""
Places = NDArray[np.uint32] | NDArray[np.int64]
"""Where messages stand: increasing numbers. Bytes from a file's begin fit into 32 bits (`LARGEST_FILE`)."""


def part(stored: Stored, begin: int, end: int) -> bytes | memoryview:
    """The bytes from `begin` to `end` or the last one; those in memory are not copied."""
    return memoryview(stored)[begin:end] if isinstance(stored, bytes) else stored.part(begin, end)


def _hashed(stored: Stored) -> str:
    digest = hashlib.sha256()
    for begin in range(0, len(stored), _HASHED):
        digest.update(part(stored, begin, begin + _HASHED))
    return digest.hexdigest()


@dataclass(frozen=True)
class Source:
    """A log file.

    Attributes:
        path: where it lies.
        stored: its bytes, left on disk where they are many.
    """

    path: Path
    stored: Stored

    @property
    def name(self) -> str:
        return str(self.path)

    @property
    def size(self) -> int:
        return len(self.stored)

    @cached_property
    def content(self) -> bytes:
        """Its bytes in memory."""
        return self.stored if isinstance(self.stored, bytes) else bytes(part(self.stored, 0, self.size))

    @cached_property
    def hashing(self) -> Future[str]:
        """Its hash, from a thread: whoever asks early waits for nothing later."""
        hasher = ThreadPoolExecutor(1)
        hashed = hasher.submit(_hashed, self.stored)
        hasher.shutdown(wait=False)
        return hashed

    @property
    def sha256(self) -> str:
        return self.hashing.result()

    @cached_property
    def text(self) -> str | None:
        """The content as text, None where it is binary."""
        if self.stored[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):  # a spreadsheet's "Unicode text"
            try:
                return self.content.decode("utf-16")
            except UnicodeDecodeError:
                return None
        if self.stored.find(b"\0") >= 0:
            return None
        try:
            return self.content.decode("utf-8-sig")
        except UnicodeDecodeError:
            # Motion capture programs on Windows write subject names in the local code page.
            control = sum(byte < 32 and byte not in b"\t\n\r\f" for byte in self.content[:4096])
            return None if control else self.content.decode("latin-1")

    def provenance(self, reader: str, version: str, **facts: Any) -> Provenance:
        """The file's name and hash, the reader's, and further `facts` (vehicle, notes, damage, parameters, events)."""
        return Provenance(
            source=self.path.name,
            sha256=self.sha256,
            reader=reader,
            reader_version=version,
            **facts,
        )


def largest_content(size: int) -> int:
    """Bytes that a file of so many bytes may unpack to."""
    return min(LARGEST_CONTENT, _FREE_CONTENT + _LARGEST_RATIO * size)


def refuse_oversized(claimed: int, *, size: int, where: str, what: str) -> None:
    """Refuses a header that claims more bytes than its file can hold, before anything is allocated for it.

    Args:
        claimed: bytes that the header asks for.
        size: bytes of the file.
        where: the file, for the error.
        what: the part that claims them, for the error.
    """
    if claimed > largest_content(size):
        raise FlightError(
            f"{what} claims {claimed:,} bytes in a file of {size:,} bytes: the header is damaged or forged.",
            where=where,
            hint="Copy or export the file again.",
        )


def _files(place: Path) -> list[Path]:
    """The files of a log: itself, or those of a rosbag2 folder, its metadata first."""
    if not place.is_dir():
        return [place]
    metadata = place / _FOLDER_MARK
    if not metadata.is_file():
        raise FlightError("is a folder, expected a flight log.", where=place, hint="Name one file in it.")
    inside = sorted(file for file in place.iterdir() if not file.is_dir() and file != metadata)
    for file in inside:
        if not file.is_file():
            raise FlightError(
                "is a pipe, a device or a link to nothing, expected a file of the bag.", where=file, hint="Remove it."
            )
    return [metadata, *inside]


def open_source(path: str | os.PathLike[str]) -> Source:
    """A log's bytes: those of a file, or of all files of a rosbag2 folder.

    Raises:
        FlightError: where it is missing, a folder, unreadable, empty or too large.
    """
    place = Path(path)
    try:
        files = _files(place)
        size = sum(file.stat().st_size for file in files)
        if size > LARGEST_FILE:
            raise FlightError(
                f"has {size:,} bytes; the largest file that is read has {LARGEST_FILE:,}.",
                where=place,
                hint="Split it into shorter flights.",
            )
        stored: Stored = (
            LogOnDisk(place, most=LARGEST_FILE)
            if files == [place] and size >= _LEFT_ON_DISK
            else b"".join(read_bytes(file, most=LARGEST_FILE) for file in files)
        )
    except FileNotFoundError:
        raise FlightError("there is no such file.", where=place, hint="Check the path.") from None
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or str(error)
        raise FlightError(f"cannot be read: {reason}.", where=place) from None
    if not stored:
        raise FlightError("the file is empty.", where=place, hint="Export or copy it again.")
    return Source(place, stored)
