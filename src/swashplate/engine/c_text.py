"""Words and numbers on their way into C: nothing that a card says may end a comment, a string or a name."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Literal

import numpy as np

from swashplate.errors import ExportError

Precision = Literal["double", "single"]
REAL: dict[Precision, str] = {"double": "double", "single": "float"}

_KEYWORDS = frozenset({
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else",
    "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long", "register",
    "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch", "typedef", "union",
    "unsigned", "void", "volatile", "while",
})  # fmt: skip


def words(text: str) -> str:
    """Text for a comment or a string of C: printable ASCII that starts and ends nothing.

    Quotes, backslashes, trigraphs and the marks of comments are what could, and are replaced.
    """
    plain = "".join(c if " " <= c <= "~" else " " if c.isspace() else "?" for c in text)
    plain = plain.replace("\\", "|").replace('"', "'")
    for mark in ("*/", "/*", "??", "//"):
        while mark in plain:
            plain = plain.replace(mark, " ".join(mark))
    return " ".join(plain.split())


def identifier(text: str) -> str:
    """A C identifier from a model's name: what is not a letter or a digit becomes `_`.

    Raises:
        ExportError: where nothing is left of it.
    """
    made = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_")
    if not made:
        raise ExportError(f"'{text}' gives no name that C could use.", channel="--name", hint="Give --name heli.")
    return f"model_{made}" if made[0].isdigit() or made in _KEYWORDS else made


def literal(value: float, precision: Precision) -> str:
    """A number as C reads it back to the last bit of its precision.

    Raises:
        ExportError: for a number that is none, or too large for single precision.
    """
    with np.errstate(over="ignore"):
        rounded = float(value) if precision == "double" else np.float32(value)
    if not np.isfinite(rounded):
        raise ExportError(f"a number of the model is {value}: no {precision} in C.", hint="Check the card.")
    text = str(rounded)
    text = text if any(c in text for c in ".e") else f"{text}.0"
    return text if precision == "double" else f"{text}f"


def array(name: str, values: Iterable[float], precision: Precision, *, kind: str) -> str:
    """The definition of a constant array; an empty one gets one zero, since C has no empty arrays."""
    numbers = [literal(value, precision) for value in values] or ["0"]
    lines = [", ".join(numbers[i : i + 6]) for i in range(0, len(numbers), 6)]
    return f"const {kind} {name}[{len(numbers)}] = {{\n  " + ",\n  ".join(lines) + "\n};\n"
