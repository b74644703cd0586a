"""Real time: a thread that calls a step when it is due, and counts when it was late."""

from __future__ import annotations

import gc
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from swashplate.links.web.priority import come_first

_GIVEN_UP = 0.25
"""Seconds behind after which lost time is not made up for."""


@dataclass(frozen=True)
class Punctuality:
    """How well time was kept.

    Attributes:
        steps: done since the last start.
        late: of these, finished more than a period after they were due.
        skipped: seconds that were given up.
        busy: share of real time spent in steps.
    """

    steps: int = 0
    late: int = 0
    skipped: float = 0.0
    busy: float = 0.0


class Clock:
    """Runs `step` every `period` seconds of real time in a thread of its own.

    Args:
        step: what is due; it may change `period`.
        period: seconds between two steps.
        lock: held during a step, so that others may change what it works on.
    """

    def __init__(self, step: Callable[[], None], *, period: float, lock: threading.Lock) -> None:
        self.period = period
        self.punctuality = Punctuality()
        self.failure: BaseException | None = None
        self._step, self._lock = step, lock
        self._running, self._over = threading.Event(), False
        self._thread = threading.Thread(target=self._run, name="clock", daemon=True)

    def start(self) -> None:
        """Start the thread (time stands still until `go`).

        Python looks for other threads every half millisecond from here on, and leaves what exists now out of its
        garbage collections, which otherwise stop every thread for tens of milliseconds.
        """
        sys.setswitchinterval(5e-4)
        gc.collect()
        gc.freeze()
        self._thread.start()

    def go(self, on: bool) -> None:
        """Let time run, or not."""
        if on:
            self._running.set()
        else:
            self._running.clear()

    @property
    def runs(self) -> bool:
        return self._running.is_set()

    def close(self) -> None:
        """End the thread."""
        self._over = True
        self._running.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        come_first()
        try:
            while not self._over:
                self._running.wait()
                self._while_running()
        except BaseException as error:  # told to whoever looks; a thread has nobody to raise to
            self.failure = error

    def _while_running(self) -> None:
        begun = due = time.perf_counter()
        steps = late = 0
        skipped = busy = 0.0
        while self._running.is_set() and not self._over:
            wait = due - time.perf_counter()
            if wait > 0.0:
                time.sleep(wait)
            start = time.perf_counter()
            with self._lock:
                if not self._running.is_set():  # stopped during the wait: whoever saw it stand still was right
                    break
                self._step()
            done = time.perf_counter()
            steps += 1
            late += done - due > self.period
            busy += done - start
            due += self.period
            if done - due > _GIVEN_UP:
                skipped += done - due
                due = done
            self.punctuality = Punctuality(steps, late, skipped, busy / max(done - begun, 1e-9))
