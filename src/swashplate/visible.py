"""Text of strangers as it may be shown: nothing in it moves the cursor, hides what follows or is read backwards."""

from __future__ import annotations

_CONTROL = {code for code in (*range(0x20), *range(0x7F, 0xA0)) if chr(code) not in "\n\t"}
_DIRECTION = {0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A)}
"""Marks of the Unicode bidirectional algorithm (UAX 9): with them `gnp.exe` reads as `exe.png`."""
_LINES = {0x2028, 0x2029}
_ESCAPED = {code: f"\\u{code:04x}" for code in _CONTROL | _DIRECTION | _LINES}


def visible(text: str) -> str:
    """A text in which control characters and marks of direction are written as their numbers, as in JSON: `\\u202e`."""
    return text.translate(_ESCAPED)


def escaped(text: str) -> str:
    """Every character of a text as its number, as in JSON: those beyond U+FFFF as two."""
    units = text.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[k]:02x}{units[k + 1]:02x}" for k in range(0, len(units), 2))
