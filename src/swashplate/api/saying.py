"""How a verb says what it is doing, and where its page is."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Callable
from contextvars import ContextVar
from typing import Protocol

QUIET: ContextVar[bool] = ContextVar("quiet", default=False)
"""Whether `tell` says nothing."""


class Say(Protocol):
    """Is told what is being done."""

    def __call__(self, what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None: ...


def silent(what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None:
    """Says nothing."""


def tell(words: str) -> None:
    """Results that come while a verb runs, on standard output."""
    if not QUIET.get():
        print(f"{words}\n", end="", flush=True)  # in one piece, whatever another thread says


def notice(words: str) -> None:
    """What the user must know while a verb runs, on standard error."""
    print(words, file=sys.stderr, flush=True)


def notice_unless_quiet(words: str) -> None:
    """What is going on while a verb runs, on standard error."""
    if not QUIET.get():
        notice(words)


def ready(address: str) -> None:
    """Say where a page is."""
    tell(f"Open {address} in a browser; Ctrl-C here ends it.")


def announce(address: str, *, open_page: bool, ready: Callable[[str], None], say: Callable[[str], None]) -> None:
    """Say where a page is, and open it where that was asked for."""
    ready(address)
    if open_page and not webbrowser.open(address):
        say(f"No browser was found; open {address} yourself.")
