"""Files that are saved or named as a log and are something else: told as what they are, not read as a table."""

from __future__ import annotations

import json
import re

from swashplate.errors import FlightError
from swashplate.flights.readers.source import Source

_POINTER = b"version https://git-lfs.github.com/spec/"
_PAGE = re.compile(
    r"\s*(?:<\?xml[^>]*>\s*)?(?:<!--.*?-->\s*)*<(?:!doctype\s+html|html|head)\b", re.IGNORECASE | re.DOTALL
)
_TITLE = re.compile(r"<title[^>]*>\s*(.*?)\s*</title>", re.IGNORECASE | re.DOTALL)


def refuse(source: Source) -> None:
    """Raises a FlightError where the file is a pointer of Git LFS, a page of the web, or JSON."""
    head = source.stored[:1024]
    if head.startswith(_POINTER):
        size = re.search(rb"size (\d+)", head)
        of = f" of a file of {int(size[1]):,} bytes" if size else ""
        raise FlightError(
            f"is a pointer of Git LFS{of}, and not that file.",
            where=source.path,
            hint="Run `git lfs pull` in its repository, or download the file itself.",
        )
    text = source.text
    if text is None:
        return
    if _PAGE.match(text[:4096]):
        title = _TITLE.search(text[: 1 << 16])
        called = f" ('{title[1][:60]}')" if title else ""
        raise FlightError(
            f"is a page of the web{called}, saved under a log's name.",
            where=source.path,
            hint="Download the file itself: on GitHub by 'Raw', elsewhere while you are logged in.",
        )
    if text.lstrip()[:1] in ("{", "["):
        try:
            json.loads(text)
        except (ValueError, RecursionError):
            return
        raise FlightError(
            "is JSON, which is no log that is known.",
            where=source.path,
            hint="Export it as a table: a line of names with units, then a row a sample.",
        )
