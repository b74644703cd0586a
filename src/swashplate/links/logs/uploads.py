"""Files that are dropped onto the page: they come in pieces, into a folder that goes when the server ends."""

from __future__ import annotations

import re
import secrets
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath

from swashplate.atomic import scratch_folder
from swashplate.errors import SwashError

LARGEST = 1_000_000_000
"""Bytes of a file that is dropped; a larger one is given on the command line."""
PIECE = 4 << 20
"""Bytes of one piece: a request that is never long."""
MOST = 4
"""Files on their way at a time."""
_LONGEST_NAME = 120


@dataclass
class _Coming:
    path: Path
    size: int
    there: int = 0


def safe_name(name: str) -> str:
    """The last part of a file's name without what a folder or a shell could take for something else."""
    last = PureWindowsPath(PurePosixPath(name).name).name
    clean = re.sub(r"[^\w.+()\[\] -]", "_", last, flags=re.ASCII).strip(" .")
    return clean[-_LONGEST_NAME:].lstrip("-. ") or "log"


class Uploads:
    """Pieces of files, put together."""

    def __init__(self) -> None:
        self._kept = ExitStack()
        self._folder = self._kept.enter_context(scratch_folder())
        self._coming: dict[str, _Coming] = {}
        self._total = 0

    def close(self) -> None:
        """Remove every file that was dropped."""
        self._kept.close()

    def begin(self, name: str, size: int) -> str:
        """A token under which the pieces of a file come.

        Raises:
            SwashError: where it is empty, too large, or too many are on their way.
        """
        clean = safe_name(name)
        if size <= 0:
            raise SwashError("is empty: there is nothing in it to read.", where=clean)
        if size > LARGEST or self._total + size > 4 * LARGEST:
            raise SwashError(
                f"has {size / 1e6:.0f} MB; at most {LARGEST / 1e6:.0f} MB are taken by drag and drop.",
                where=clean,
                hint=f"Give it on the command line, where no size is too large: swash open {clean}",
            )
        if len(self._coming) >= MOST:
            self._coming.pop(next(iter(self._coming))).path.unlink(missing_ok=True)
        token = secrets.token_urlsafe(12)
        place = self._folder / token
        place.mkdir()
        self._coming[token] = _Coming(place / clean, size)
        self._total += size
        return token

    def add(self, token: str, at: int, piece: bytes) -> Path | None:
        """Append a piece that begins at byte `at`; returns the file once it is whole.

        Raises:
            SwashError: for a token that is none, a piece out of turn, or more than was announced.
        """
        coming = self._coming.get(token)
        if coming is None:
            raise SwashError("no such file is on its way.", hint="Drop it again.")
        if at != coming.there or not piece or len(piece) > PIECE or coming.there + len(piece) > coming.size:
            self._coming.pop(token).path.unlink(missing_ok=True)
            raise SwashError("its pieces came out of turn.", where=coming.path.name, hint="Drop it again.")
        with coming.path.open("ab") as file:
            file.write(piece)
        coming.there += len(piece)
        if coming.there < coming.size:
            return None
        return self._coming.pop(token).path
