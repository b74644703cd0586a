"""A result of several files that appears in its folder only when all of it is complete, or one of them as a file."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from swashplate import atomic
from swashplate.errors import SwashError


def is_file(target: Path, ours: Collection[str]) -> bool:
    """Whether `--out` names one file of a result and not a folder for all: it ends as one of the result's files does.

    Raises:
        SwashError: an ending of a file that the result does not have.
    """
    if target.is_dir() or not target.suffix[1:].isalpha():
        return False
    endings = dict.fromkeys(Path(name).suffix for name in ours)
    if target.suffix in endings:
        return True
    if target.suffix in _KNOWN:
        listed = ", ".join(endings)
        raise SwashError(
            f"ends in '{target.suffix}', expected one of {listed}, or a folder for all.", where=target, channel="--out"
        )
    return False


_KNOWN = (".html", ".json", ".toml", ".nc", ".csv", ".pdf", ".png", ".svg")


def place_of(target: Path, name: str, ours: Collection[str]) -> Path:
    """Where a file of a result is found in the end."""
    return target if is_file(target, ours) else target / name


def told(target: Path, ours: Collection[str]) -> str:
    """What was written, for the last line of a command: the one file, or the report in its folder."""
    return f"Written: {target}" if is_file(target, ours) else f"Report: {target / 'report.html'}"


@contextmanager
def folder_when_complete(target: Path | None, *, ours: Collection[str]) -> Iterator[Path | None]:
    """`atomic.folder_when_complete` where a folder was asked for; None gives None: no files.

    A target that ends as one of `ours` gets that file alone.
    """
    if target is None:
        yield None
        return
    if ours and is_file(target, ours):
        atomic.make_folder(target.parent)
        with atomic.scratch_folder() as made:
            yield made
            chosen = next(name for name in ours if Path(name).suffix == target.suffix)
            if (made / chosen).is_file():
                atomic.write_bytes(target, (made / chosen).read_bytes())
        return
    with atomic.folder_when_complete(target, ours=ours) as folder:
        yield folder
