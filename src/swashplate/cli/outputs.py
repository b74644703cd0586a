"""A result of several files that appears in its folder only when all of it is complete."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from swashplate import atomic


@contextmanager
def folder_when_complete(target: Path | None, *, ours: Collection[str]) -> Iterator[Path | None]:
    """`atomic.folder_when_complete` where a folder was asked for; None gives None: no files."""
    if target is None:
        yield None
        return
    with atomic.folder_when_complete(target, ours=ours) as folder:
        yield folder
