"""A flight on disk while it is flown: an append format that a killed program leaves readable up to its last sample.

The file is the line `swashplate-growing-flight 1`, one line of JSON (`schema`, `stream`, `columns` as pairs of name and
unit, `provenance`, `history`), and then records of one size, little endian: the row's CRC-32 and number (uint32 each),
and the row of float64: time and the columns. Records begin at a multiple of 8 bytes. A record is handed to the
operating system when it is appended, so that only a power cut can lose it. What is torn or damaged is left out when it
is read, and said.

The file is locked while somebody appends to it; the system unlocks it when that program ends, however it ends.
"""

from __future__ import annotations

import errno
import json
import os
import struct
import zlib
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from swashplate import documents, systems
from swashplate.errors import FlightError
from swashplate.flights import storage
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import ProcessingStep, Provenance
from swashplate.flights.schema import SCHEMA_VERSION

Schema = TypeVar("Schema")

MAGIC = b"swashplate-growing-flight 1\n"
SUFFIX = ".growing"
_LONGEST_HEADER = 1 << 20
_MOST_COLUMNS = 4096
_MARK = struct.Struct("<II")


class Growing:
    """A flight of one stream that is appended to.

    Args:
        path: a file that does not exist yet.
        like: a flight of one stream without samples: its channels, units, provenance and history.

    Raises:
        FileExistsError: where something of that name is there.
        OSError: where it cannot be written.

    Attributes:
        path: the file.
        rows: records written.
    """

    def __init__(self, path: Path, *, like: Flight) -> None:
        ((name, data),) = like.streams.items()
        header = {
            "schema": SCHEMA_VERSION,
            "stream": name,
            "columns": [[str(c), values.attrs.get("units", "")] for c, values in data.data_vars.items()],
            "provenance": asdict(like.provenance),
            "history": [{"operation": step.operation, "details": dict(step.details)} for step in like.history],
        }
        self.path, self.rows = path, 0
        self._row = struct.Struct(f"<{1 + len(data.data_vars)}d")
        self._file = _claimed(path)
        try:
            self._size = 0
            head = MAGIC + json.dumps(header, default=storage.json_value).encode()
            self._write(head + b" " * (-(len(head) + 1) % 8) + b"\n")
        except BaseException:
            self.discard()
            raise

    def append(self, time: float, row: Iterable[float]) -> None:
        """Append one sample: time [s], greater than the last one, and the channels in their order.

        Raises:
            OSError: where it cannot be written (a full disk); the file ends with the sample before then.
        """
        packed = self._row.pack(time, *row)
        self._write(_MARK.pack(zlib.crc32(packed), self.rows & 0xFFFFFFFF) + packed)
        self.rows += 1

    def _write(self, data: bytes) -> None:
        try:
            written = os.write(self._file, data)
            if written != len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.path))
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        self._size += len(data)

    def close(self) -> None:
        """Close the file and let others have it; it stays where it is."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def discard(self) -> None:
        """Remove the file."""
        if systems.HOLDS:  # while it is locked, so that nobody saves it
            self.path.unlink(missing_ok=True)
            self.close()
        else:  # Windows removes nothing that is open
            self.close()
            self.path.unlink(missing_ok=True)

    def __enter__(self) -> Growing:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _claimed(path: Path) -> int:
    """A new, locked file. Somebody who cleans up may have removed it between being made and being locked."""
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | systems.BYTES, 0o666)
        systems.lock(handle, wait=True)
        try:
            if os.stat(path).st_ino == os.fstat(handle).st_ino:
                return handle
        except FileNotFoundError:
            pass
        os.close(handle)


class Abandoned:
    """A growing flight that its program left behind, locked so that nobody else saves it, too.

    Args:
        path: the file.

    Attributes:
        path: the file.
        free: False where the program that writes it is alive, or the file is gone.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._file = path, -1

    def __enter__(self) -> Abandoned:
        try:
            self._file = os.open(self.path, os.O_RDWR)
            systems.lock(self._file)
            self.free = os.stat(self.path).st_ino == os.fstat(self._file).st_ino
        except OSError:
            self.free = False
        return self

    def __exit__(self, *_: object) -> None:
        if self._file >= 0:
            os.close(self._file)


def load(path: str | Path) -> Flight:
    """The flight in a growing file: read, not mapped, for a mapped file that is cut off ends the process.

    Raises:
        FlightError: as `parse`, and where the file is missing or empty.
    """
    place = Path(path)
    try:
        if not place.is_file():
            raise OSError(errno.ENOENT, "there is no such file")
        content = place.read_bytes()
        if not content:
            raise OSError(errno.ENODATA, "the file is empty")
    except OSError as error:
        raise FlightError(f"cannot be read: {error.strerror}.", where=place) from None
    return parse(content, where=str(place))


def parse(content: bytes, *, where: str) -> Flight:
    """The flight in a growing file's bytes: every sample that is whole. What is not is told in `provenance.damage`.

    Args:
        content: of the file.
        where: the file's name, for errors.

    Raises:
        FlightError: where the head is damaged or of a newer schema, or the times do not increase.
    """
    end = content.find(b"\n", len(MAGIC), len(MAGIC) + _LONGEST_HEADER)
    try:
        if content[: len(MAGIC)] != MAGIC or end < 0:
            raise ValueError("its head is cut off")
        header = json.loads(content[len(MAGIC) : end])
        if int(header["schema"]) > SCHEMA_VERSION:
            raise FlightError(
                f"has schema version {header['schema']}; this swashplate knows versions up to {SCHEMA_VERSION}.",
                where=where,
                hint="Update swashplate.",
            )
        name, columns = str(header["stream"]), {str(c): str(unit) for c, unit in header["columns"]}
        if not 0 < len(columns) == len(header["columns"]) <= _MOST_COLUMNS:
            raise ValueError("its columns are none, doubled or too many")
        provenance = _checked(header["provenance"], Provenance, where, "provenance")
        history = _checked(header["history"], tuple[ProcessingStep, ...], where, "history")
    except FlightError:
        raise
    except Exception as error:  # whatever damaged text leads to is the file's fault
        raise FlightError(
            f"does not read as a recording of swashplate: {str(error) or type(error).__name__}.", where=where
        ) from None
    rows, damage = _complete_rows(content, end + 1, width=1 + len(columns))
    series = {c: rows[:, 1 + j] for j, c in enumerate(columns)}
    try:
        data = stream(rows[:, 0], series, {c: unit for c, unit in columns.items() if unit})
    except FlightError as error:
        raise FlightError(error.problem, where=where, channel=error.channel, hint="The file is damaged.") from None
    damaged = replace(provenance, damage=(*provenance.damage, *damage))
    return Flight({name: data}, damaged, history)


def _checked(part: Any, schema: type[Schema], where: str | Path, at: str) -> Schema:
    return documents.parse_logged(json.dumps(part), schema, where=where, at=at, error=FlightError)


def _complete_rows(content: bytes, start: int, *, width: int) -> tuple[NDArray[np.float64], list[str]]:
    """The rows whose check sums are right, shape (n, width), and words about the others."""
    kind = np.dtype([("crc", "<u4"), ("number", "<u4"), ("row", "<f8", (width,))])
    count, torn = divmod(len(content) - start, kind.itemsize)
    records = np.frombuffer(content, dtype=kind, count=count, offset=start)
    view = memoryview(content)
    first, size = start + _MARK.size, kind.itemsize
    sums = (zlib.crc32(view[at : at + size - _MARK.size]) for at in range(first, first + count * size, size))
    good = records["crc"] == np.fromiter(sums, dtype=np.uint32, count=count)
    damage = [f"the last sample was cut off after {torn} of {size} bytes"] if torn else []
    if not good.all():
        damage.append(f"{np.count_nonzero(~good)} of {count} samples are damaged and left out")
    rows: NDArray[np.float64] = records["row"] if good.all() else records["row"][good]
    return rows, damage
