"""How a verb that takes long tells what it is doing."""

from __future__ import annotations

from typing import Protocol


class Say(Protocol):
    """Is told what is being done."""

    def __call__(self, what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None: ...


def silent(what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None:
    """Says nothing."""
