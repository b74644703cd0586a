"""A result of several files that appears in its folder only when all of it is complete."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from swashplate.errors import SwashError


def _nearest_folder(target: Path) -> Path:
    """The nearest folder above `target` that exists."""
    return next(folder for folder in target.parents if folder.exists())


@contextmanager
def folder_when_complete(target: Path | None, *, ours: Collection[str]) -> Iterator[Path | None]:
    """A temporary folder whose files move into `target` when the block ends well, and vanish when it does not.

    The temporary folder is made at once, beside `target` or above it, so that a place which cannot be written to is
    found before an hour of computing and not after it. Other people's files in `target` stay.

    Args:
        target: the folder that the user asked for; missing folders above it are made. None gives None: no files.
        ours: the names that belong to this result. Those that this run did not write are removed from `target`: a
            model of an earlier run must not lie beside the report of a failed one.

    Raises:
        SwashError: where `target` is a file.
        OSError: where it cannot be written to.
    """
    if target is None:
        yield None
        return
    place = Path(os.path.abspath(target))
    if place.exists() and not place.is_dir():
        raise SwashError("is a file, expected a folder.", where=target, hint="Choose another --out.")
    # Renames are atomic within one file system only, hence a neighbour.
    base = place if place.exists() else _nearest_folder(place)
    try:
        temporary = Path(tempfile.mkdtemp(prefix=".swash.", dir=base))
    except OSError as error:  # it names the temporary folder, which the user never asked for
        raise OSError(error.errno, error.strerror, str(target)) from None
    try:
        yield temporary
        place.mkdir(parents=True, exist_ok=True)
        written = {file.name for file in temporary.iterdir()}
        for name in sorted(set(ours) - written):
            (place / name).unlink(missing_ok=True)
        for name in sorted(written):
            os.replace(temporary / name, place / name)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
