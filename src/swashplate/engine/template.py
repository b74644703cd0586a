"""C as files with blanks: `templates/NAME`, in which @WORD@ stands for what is printed there."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources


@lru_cache(maxsize=16)
def _template(name: str) -> str:
    return resources.files("swashplate.engine").joinpath("templates", name).read_text(encoding="utf-8")


def filled(name: str, blanks: Mapping[str, object]) -> str:
    """A template with its blanks filled.

    Args:
        name: of the file.
        blanks: what stands for @WORD@, by word.
    """
    return re.sub(r"@(\w+)@", lambda blank: str(blanks[blank[1]]), _template(name))
