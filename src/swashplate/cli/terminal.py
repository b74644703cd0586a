"""Standard streams that show any text: what their encoding has no character for, and what would disturb the screen."""

from __future__ import annotations

import codecs
import io
import re
from typing import TextIO

from swashplate.visible import escaped, visible

_HANDLER = "swashplate-escaped"
_OURS = re.compile("(\x1b\\[(?:0|1|31)m)")
"""Codes that our own colours are made of: reset, bold and red. Nothing can be hidden with them."""


def _handled(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return escaped(error.object[error.start : error.end]), error.end


class Terminal(io.TextIOWrapper):
    """A stream over another one.

    In JSON an escaped character within a text is the character, so what reads our output has the same text.

    Attributes:
        below: the stream as it was: for a progress bar, which moves the cursor.
    """

    below: TextIO

    def write(self, text: str, /) -> int:
        """Write a text, escaped where it has to be."""
        parts = _OURS.split(text)
        shown = "".join(part if k % 2 else visible(part) for k, part in enumerate(parts))
        super().write(shown.encode(self.below.encoding, _HANDLER).decode(self.below.encoding))
        return len(text)


def over(stream: TextIO) -> TextIO:
    """A `Terminal` over a standard stream; what is none of the system's (a test's, a notebook's) as it is."""
    if type(stream) is not io.TextIOWrapper:
        return stream
    codecs.register_error(_HANDLER, _handled)
    stream.flush()
    stream.reconfigure(errors=_HANDLER)
    # Typer writes UTF-8 past a stream that says it is ASCII; a Latin one has the same bytes for the same characters.
    encoding = "latin-1" if codecs.lookup(stream.encoding).name == "ascii" else stream.encoding
    term = Terminal(stream.buffer, encoding, line_buffering=stream.line_buffering, write_through=stream.write_through)
    term.below = stream
    return term


def below(stream: TextIO) -> TextIO:
    """The stream under a `Terminal`; any other as it is."""
    return stream.below if isinstance(stream, Terminal) else stream
