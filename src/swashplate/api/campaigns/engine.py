"""Who carries tasks out: the protocol of an engine, and the loop that gives every task to one until it is done."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

from swashplate.api.campaigns.store import CampaignStore
from swashplate.api.campaigns.tasks import CampaignTask, Columns
from swashplate.errors import CampaignError

Work = Callable[[CampaignTask], Columns]
"""What a worker does with a task; a function of a module, so that another process finds it."""

TRIES = 3
"""After so many errors of its own a task is given up, and the campaign goes on."""
DEATHS = 10
"""After so many deaths of its workers too. More than `TRIES`: a kill is seldom the task's fault, and is seen alike."""


@dataclass(frozen=True)
class TaskOutcome:
    """What became of a task once.

    Attributes:
        columns: its result; None where there is none.
        error: why, in words.
        died: True where the worker ended under it.
        fatal: True where no further try on this engine can help (a worker of another version).
    """

    task: CampaignTask
    columns: Columns | None = None
    error: str = ""
    died: bool = False
    fatal: bool = False


class TaskEngine(Protocol):
    """Processes that carry tasks out."""

    @property
    def workers(self) -> int:
        """How many there are now; none where all have gone and it waits for others."""
        ...

    @property
    def description(self) -> str:
        """What it is, for a person."""
        ...

    def submit(self, task: CampaignTask) -> None:
        """Give a task to it."""
        ...

    def outcomes(self, seconds: float) -> Iterator[TaskOutcome]:
        """What has ended; waits up to so long for the first."""
        ...

    def close(self) -> None:
        """End its processes, and what they are at."""
        ...


@dataclass
class CampaignStanding:
    """How far a campaign is, told after every task and when workers come and go.

    Attributes:
        total, done, failed: tasks of the campaign; done and failed ones of earlier runs too.
        here: tasks of this run that are done.
        workers: at work.
        seconds_left: estimate from this run; None before its first tasks are done.
    """

    total: int
    done: int
    failed: int
    here: int = 0
    workers: int = 0
    seconds_left: float | None = None
    _began: float = field(default=0.0, repr=False)
    _from: int = field(default=0, repr=False)

    def count(self) -> None:
        """One task of this run is done, now. The first of each worker, which compile, are left out of the estimate as
        soon as there are others."""
        now = time.monotonic()
        self.done, self.here = self.done + 1, self.here + 1
        if self.here == max(self.workers, 1):
            self._began, self._from = now, self.here
        left = self.total - self.done - self.failed
        if self.here > self._from and self._began:
            self.seconds_left = left * (now - self._began) / (self.here - self._from)


def carry_out(
    tasks: Iterable[CampaignTask],
    engine: TaskEngine,
    store: CampaignStore,
    *,
    standing: CampaignStanding,
    tell: Callable[[CampaignStanding], None],
) -> None:
    """Give every task to an engine and its result to the store.

    A task that fails is tried `TRIES` times and then given up; where the first ones of a campaign all fail, the
    campaign is: it is the file then.

    Args:
        tasks: that are to be done.
        engine: who does them.
        store: where results go; held by the caller.
        standing: counted up.
        tell: told of it after every task, and when workers come and go.

    Raises:
        CampaignError: where nothing can succeed, or the engine is gone; what is done is in the store.
        WriteError: where the store cannot be written to.
    """
    waiting, errors, deaths = deque(tasks), Counter[str](), Counter[str]()
    said: dict[str, list[str]] = {}
    flying = 0
    while waiting or flying:
        workers = engine.workers
        if workers != standing.workers:
            standing.workers = workers
            tell(standing)
        while waiting and flying < 2 * max(workers, 1):
            engine.submit(waiting.popleft())
            flying += 1
        for outcome in engine.outcomes(1.0):
            task = outcome.task
            flying -= 1
            if waiting and flying < 2 * max(workers, 1):  # before the disk is waited for
                engine.submit(waiting.popleft())
                flying += 1
            if outcome.columns is not None:
                store.keep(task, outcome.columns)
                standing.count()
                tell(standing)
                continue
            if outcome.fatal:
                raise CampaignError(outcome.error, where=store.folder, hint=_KEPT)
            said.setdefault(task.name, []).append(outcome.error)
            (deaths if outcome.died else errors)[task.name] += 1
            if errors[task.name] < TRIES and deaths[task.name] < DEATHS:
                waiting.append(task)
                continue
            store.give_up(task, said[task.name])
            standing.failed += 1
            tell(standing)
            if standing.done == 0 and standing.failed >= min(TRIES, standing.total):
                why = outcome.error.removesuffix(".")
                raise CampaignError(
                    f"none of its tasks can be done; the first of {standing.failed}: {why}.",
                    where=store.folder,
                    hint="Mend the campaign's file, and run it into another folder.",
                )


_KEPT = "What is done is kept: `swash campaign resume` goes on from there."
