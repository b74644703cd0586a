"""How a verb says what it is doing, and where its page is."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from typing import Protocol


class Say(Protocol):
    """Is told what is being done."""

    def __call__(self, what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None: ...


def silent(what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None:
    """Says nothing."""


def announce(address: str, *, open_page: bool, ready: Callable[[str], None], say: Callable[[str], None]) -> None:
    """Say where a page is, and open it where that was asked for."""
    ready(address)
    if open_page and not webbrowser.open(address):
        say(f"No browser was found; open {address} yourself.")
