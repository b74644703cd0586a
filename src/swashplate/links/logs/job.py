"""Long work in a thread of its own: one at a time, told how far it is, stopped when asked."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swashplate.atomic import scratch_folder
from swashplate.errors import SwashError

_LOG = logging.getLogger("swashplate.open")
Make = Callable[[], Path]
"""Makes a file and says where it lies."""
Tell = Callable[[str, float], None]
"""Is told what is being done, and the share that is done; stops the work by raising."""


@dataclass(frozen=True)
class Identified:
    """What came of a sweep.

    Attributes:
        document: what the page shows.
        files: what makes each, by the name under which it is downloaded.
    """

    document: dict[str, Any]
    files: Mapping[str, Make]


Work = Callable[[Path, Tell], Identified]


class _StoppedError(Exception):
    """The work was asked to end."""


class PageJob:
    """The work of a page: one job at a time, the last one's result kept."""

    def __init__(self) -> None:
        self._kept = ExitStack()
        self._folder = self._kept.enter_context(scratch_folder())
        self._lock = threading.Lock()
        self._number = 0
        self._stop = threading.Event()
        self._state: dict[str, Any] = {"state": "none"}
        self._files: Mapping[str, Make] = {}
        self._making = threading.Lock()
        self._begun = 0.0

    def close(self) -> None:
        """Stop what runs and remove the files."""
        self.cancel()
        self._kept.close()

    def start(self, work: Work) -> int:
        """Begin; returns the job's number.

        Raises:
            SwashError: while another one runs.
        """
        with self._lock:
            if self._state["state"] == "running":
                raise SwashError("another identification is running.", hint="Wait for it, or cancel it.")
            self._number += 1
            self._stop, self._begun = threading.Event(), time.monotonic()
            self._state = {"state": "running", "doing": "starting", "share": 0.0}
            number, stop = self._number, self._stop
        threading.Thread(target=self._run, args=(work, number, stop), daemon=True).start()
        return number

    def _run(self, work: Work, number: int, stop: threading.Event) -> None:
        def tell(doing: str, share: float) -> None:
            if stop.is_set():
                raise _StoppedError
            self._put(number, {"state": "running", "doing": doing, "share": share})

        folder = self._folder / str(number)
        try:
            folder.mkdir(parents=True)
            identified = work(folder, tell)
            self._put(number, {"state": "done", "result": identified.document}, identified.files)
        except _StoppedError:
            self._put(number, {"state": "cancelled"})
        except SwashError as error:
            place = f"{error.channel}: " if error.channel else ""
            self._put(number, {"state": "failed", "problem": f"{place}{error.problem}", "hint": error.hint or ""})
        except Exception as error:  # a thread's end is heard by nobody else
            _LOG.error("An identification failed: %s: %s", type(error).__name__, error)
            problem = f"This went wrong inside swash ({type(error).__name__}: {error})."
            self._put(number, {"state": "failed", "problem": problem, "hint": "Please report it with the log."})

    def _put(self, number: int, state: dict[str, Any], files: Mapping[str, Make] | None = None) -> None:
        with self._lock:
            if number == self._number and self._state["state"] == "running":
                self._state = state
                if files is not None:
                    self._files = files

    def cancel(self) -> dict[str, Any]:
        """Ask what runs to end: nothing of it is kept. It ends before its next step."""
        self._stop.set()
        with self._lock:
            if self._state["state"] == "running":
                self._state = {"state": "cancelled"}
        return {}

    def to_document(self) -> dict[str, object]:
        """How it is going, or what came of it."""
        with self._lock:
            state: dict[str, object] = dict(self._state, number=self._number)
        if state["state"] == "running":
            state["seconds"] = time.monotonic() - self._begun
        return state

    def file(self, name: str) -> Path | None:
        """A file of the last result, by its name and no other way; made when it is first asked for.

        Raises:
            SwashError: where it cannot be made.
        """
        with self._lock:
            make = self._files.get(name)
        if make is None:
            return None
        with self._making:
            return make()
