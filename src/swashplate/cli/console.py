"""What a person sees while and after a command runs: results on standard output, progress on standard error."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from swashplate import progress_lines
from swashplate.cli.terminal import below
from swashplate.json_text import as_json, plain
from swashplate.text_table import screen_width
from swashplate.visible import visible

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["Progress", "as_json", "console", "doing", "plain", "progress"]

_PIPED_WIDTH = 2_000  # columns: wide enough for every line, so that a file or a pipe gets whole ones
_NARROWEST = 40  # columns: no table gets narrower; the terminal wraps whole lines instead
_AFTER = 1.0  # s: what is done sooner needs no progress bar
_STAGES_AFTER = 10.0  # s: from here on, without a terminal, every stage is a line


def console() -> Console:
    """Standard output; as wide as the terminal, or wide enough for every table where there is none."""
    from rich.console import Console

    return Console(highlight=False, width=max(screen_width() or _PIPED_WIDTH, _NARROWEST))


class Progress:
    """One line on standard error that says what is being done; it appears after a second on a terminal.

    Elsewhere (a pipe, a file), what takes more than ten seconds says every stage as a line of its own, and how far it
    is every so often where it has steps to count (`every`). Where whoever started the command asks for it, every change
    is a line of `progress_lines` instead.

    Args:
        quiet: True says nothing.
        every: seconds between two lines about one stage, without a terminal; None for one line a stage.
    """

    def __init__(self, *, quiet: bool, every: float | None = None) -> None:
        self._every, self._last = every, 0.0
        self._lock = threading.Lock()
        self._bar: Any = None
        self._latest: dict[str, Any] = {"description": "", "completed": 0.0, "total": None, "note": ""}
        # A timer, because a compilation goes on for seconds without calling back.
        screen = sys.stderr.isatty()
        self._timer = threading.Timer(*((_AFTER, self._show) if screen else (_STAGES_AFTER, self._stage)))
        self._timer.daemon = True
        self._tells = progress_lines.wanted()
        self._stages, self._told = False, ""
        if not quiet and not self._tells:
            self._timer.start()

    def _stage(self) -> None:
        with self._lock:
            if not self._timer.finished.is_set():
                self._stages = True
                self._tell_stage()

    def _tell_stage(self) -> None:
        what = self._latest["description"]
        now = time.monotonic()
        again = self._every is not None and self._latest["note"] and now - self._last >= self._every
        if self._stages and what and (what != self._told or again):
            self._told, self._last = what, now
            note = f": {self._latest['note']}" if self._every is not None and self._latest["note"] else ""
            print(f"... {what}{note}", file=sys.stderr, flush=True)

    def _show(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        columns = (TextColumn("{task.description}"), BarColumn(bar_width=24), TextColumn("{task.fields[note]}"))
        with self._lock:
            if self._timer.finished.is_set():  # closed while rich was loading
                return
            bar = Bar(
                SpinnerColumn(), *columns, TimeElapsedColumn(), console=Console(file=below(sys.stderr)), transient=True
            )
            bar.add_task(**self._latest)
            bar.start()
            self._bar = bar

    def say(self, what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None:
        """What is being done now; `total` of the steps where they are known."""
        if self._tells:
            print(progress_lines.line(progress_lines.Told(what, done, total)), file=sys.stderr, flush=True)
        with self._lock:
            self._latest = {"description": visible(what), "completed": done, "total": total, "note": visible(note)}
            if self._bar is not None:
                self._bar.update(self._bar.task_ids[0], **self._latest)
            self._tell_stage()

    def close(self) -> None:
        with self._lock:
            self._timer.cancel()
            if self._bar is not None:
                self._bar.stop()


@contextmanager
def doing(what: str, *, quiet: bool) -> Iterator[None]:
    """Says one thing that takes a while, as `progress` does."""
    with progress(quiet=quiet) as line:
        line.say(what)
        yield


@contextmanager
def progress(*, quiet: bool, every: float | None = None) -> Iterator[Progress]:
    """A progress line that is gone when the block ends, however it ends; arguments as of `Progress`."""
    line = Progress(quiet=quiet, every=every)
    try:
        yield line
    finally:
        line.close()
