"""An engine without further libraries: processes of our own on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from swashplate import atomic
from swashplate.api.campaigns import program
from swashplate.api.campaigns.engine import TaskOutcome, Work
from swashplate.api.campaigns.tasks import CampaignTask, Columns
from swashplate.own_python import SAFE_PATH
from swashplate.threads import ONE_THREAD


@dataclass
class _Lane:
    """One worker and what it is at."""

    process: SpawnProcess
    pipe: Connection
    task: CampaignTask | None = None


class ProcessPool:
    """Processes that are spawned, of one thread each; a dead one is replaced, and its task told as such.

    Args:
        work: what is done with a task.
        workers: how many.
    """

    def __init__(self, work: Work, *, workers: int) -> None:
        self._work, self._context = work, multiprocessing.get_context("spawn")
        self._waiting: deque[CampaignTask] = deque()
        self._lanes = [self._lane() for _ in range(workers)]

    @property
    def workers(self) -> int:
        return len(self._lanes)

    @property
    def description(self) -> str:
        return f"{self.workers} processes of this machine"

    def submit(self, task: CampaignTask) -> None:
        self._waiting.append(task)
        self._hand_out()

    def outcomes(self, seconds: float) -> Iterator[TaskOutcome]:
        busy = {lane.pipe: lane for lane in self._lanes if lane.task is not None}
        for pipe in connection.wait(list(busy), timeout=seconds):
            lane = busy[pipe]  # pyrefly: ignore[bad-index]
            task = lane.task
            assert task is not None
            try:
                columns, error = lane.pipe.recv()
                lane.task = None
                outcome = TaskOutcome(task, columns=columns, error=error)
            except (EOFError, OSError):  # the pipe ends with the process
                lane.process.join()
                outcome = TaskOutcome(task, error=_death(lane.process.exitcode), died=True)
                lane.pipe.close()
                self._lanes[self._lanes.index(lane)] = self._lane()
            self._hand_out()
            yield outcome

    def do(self, task: CampaignTask) -> TaskOutcome:
        """One task, waited for."""
        self.submit(task)
        while True:
            for outcome in self.outcomes(1.0):
                return outcome

    def close(self) -> None:
        for lane in self._lanes:
            lane.process.kill()
        for lane in self._lanes:
            lane.process.join()
            lane.pipe.close()
        if self._lanes:
            atomic.sweep(atomic.temporary_place())  # where they kept the campaign's files
        self._lanes = []

    def _lane(self) -> _Lane:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(theirs, self._work), name="worker", daemon=True)
        with _environment({**ONE_THREAD, **SAFE_PATH}):
            process.start()
        theirs.close()
        return _Lane(process, ours)

    def _hand_out(self) -> None:
        for lane in self._lanes:
            if lane.task is None and self._waiting:
                lane.task = self._waiting.popleft()
                with suppress(OSError):  # it has died: that is seen when its result is waited for
                    lane.pipe.send(lane.task)


def _death(code: int | None) -> str:
    if code is not None and code < 0:
        return f"its worker was ended by {signal.Signals(-code).name}"
    return f"its worker ended with code {code}"


def _serve(pipe: Connection, work: Work) -> None:
    """A worker's life: a task in, its columns or what was wrong out, until nobody asks any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the client ends it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    program.end_with_parent()
    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):  # the client has ended, in one way or another
            return
        answer: tuple[Columns | None, str] = (None, "")
        try:
            answer = (work(task), "")
        except Exception as error:  # whatever a task's own code raises is its outcome
            answer = (None, in_words(error))
        sys.stdout.flush()
        try:
            pipe.send(answer)
        except OSError:
            return


def in_words(error: BaseException) -> str:
    """An error as one line."""
    text = " ".join(str(error).split())
    return text if type(error).__module__.startswith("swashplate") else f"{type(error).__name__}: {text}"


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """The environment that a process is started in: set before anything is imported there."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
