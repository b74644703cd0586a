"""Files that appear by rename when they are complete, so that a failure never leaves half of one behind."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def _usual_mode() -> int:
    """The permissions that a plain `open` would have given (temporary files are made readable by their owner only)."""
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


@contextmanager
def replaced_when_complete(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary file beside `path`, renamed to `path` when the block ends well and removed when it does not.

    The temporary file lies in the same folder because a rename is atomic only within one file system. It keeps the
    suffix of `path`, by which some writers choose their format.

    Raises:
        OSError: where the folder is missing or cannot be written to, naming `path`.
    """
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}.", suffix=target.suffix, dir=target.parent)
    except OSError as error:  # it names the temporary file, which the caller never asked for
        raise OSError(error.errno, error.strerror, str(path)) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(target.stat().st_mode if target.exists() else _usual_mode())
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Writes a text file (UTF-8, line ends as they stand in `text`) by rename when complete."""
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], content: bytes) -> Path:
    """Writes a file by rename when complete; returns its path."""
    with replaced_when_complete(path) as temporary:
        temporary.write_bytes(content)
    return Path(path)
