"""Work of workers in tests, without a model: a function of a task's seed, which fails or dies where it is told to."""

from __future__ import annotations

import os
import signal
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from swashplate.api.campaigns import worker
from swashplate.api.campaigns.engine import TaskOutcome, Work
from swashplate.api.campaigns.pool import in_words
from swashplate.api.campaigns.program import program
from swashplate.api.campaigns.tasks import CampaignTask, Columns, made_tasks, portions


def numbers(task: CampaignTask) -> Columns:
    """Normal numbers of the task's seed; what `settings` says happens first.

    `fail`: rows that always fail. `die`: rows that end their worker. `die_once`: as `die`, once, told by a file in
    `folder`. `wait`: seconds. `pids`: a folder that is told which process did which rows. `keeps`: one that is told
    what the worker calls the folder of its files.
    """
    first, told = task.portion.first, task.settings
    if first in told.get("fail", ()):
        raise ValueError(f"row {first} cannot be done")
    if first in told.get("die", ()):
        os.kill(os.getpid(), signal.SIGKILL)
    if first in told.get("die_once", ()):
        mark = Path(told["folder"]) / f"died-{first}"
        if not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(told.get("wait", 0.0))
    if "pids" in told:
        (Path(told["pids"]) / f"{first}-{os.getpid()}-{time.time_ns()}").touch()
    if "keeps" in told:
        (Path(told["keeps"]) / worker._home().name).touch()
    drawn = np.random.default_rng(task.portion.seed).standard_normal((task.portion.count, 8))
    return {
        "number": np.arange(first, first + task.portion.count),
        "seed": np.full(task.portion.count, task.portion.seed),
        "value": drawn @ np.linspace(0.0, 1.0, 8),
    }


def bits(folder: Path) -> dict[str, bytes]:
    """Content of every result in a campaign's folder by its task's name."""
    return {path.stem: path.read_bytes() for path in sorted((folder / "results").glob("[!.]*"))}


def tasks(count: int = 12, *, batch: int = 2, **settings: object) -> tuple[CampaignTask, ...]:
    """Tasks for `numbers`."""
    return made_tasks("test", settings, portions(count=count, batch=batch, seed=5), files={}, program=program())


class InProcess:
    """An engine that carries tasks out in this process, when it is asked; it may be stopped.

    Attributes:
        did: tasks that it did.
    """

    workers, description = 1, "this process"

    def __init__(self, work: Work, *, stop_after: int | None = None) -> None:
        self._work, self._stop, self._waiting = work, stop_after, deque[CampaignTask]()
        self.did: list[CampaignTask] = []

    def submit(self, task: CampaignTask) -> None:
        self._waiting.append(task)

    def outcomes(self, seconds: float) -> Iterator[TaskOutcome]:
        del seconds
        if self._stop is not None and len(self.did) >= self._stop:
            raise KeyboardInterrupt
        task = self._waiting.popleft()
        self.did.append(task)
        try:
            yield TaskOutcome(task, columns=self._work(task))
        except Exception as error:
            yield TaskOutcome(task, error=in_words(error))

    def do(self, task: CampaignTask) -> TaskOutcome:
        self.submit(task)
        return next(self.outcomes(0.0))

    def close(self) -> None:
        self._waiting.clear()
