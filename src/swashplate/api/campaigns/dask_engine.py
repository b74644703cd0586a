"""An engine of Dask distributed: the workers of a scheduler that somebody runs elsewhere."""

from __future__ import annotations

import logging
import os
import queue
import socket
import time
from asyncio import CancelledError
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from swashplate.api.campaigns import program
from swashplate.api.campaigns.engine import TaskOutcome, Work
from swashplate.api.campaigns.pool import in_words
from swashplate.api.campaigns.scheduler import DaskScheduler
from swashplate.api.campaigns.tasks import CampaignTask, Columns
from swashplate.errors import CampaignError
from swashplate.extras import library
from swashplate.threads import ONE_THREAD

_CONNECT = 15.0  # s until a scheduler that does not answer is not there
_COUNTED = 2.0  # s that a number of workers is believed
_GONE = 20.0  # s without a scheduler until it is gone


class DaskEngine:
    """Workers of Dask, one task each at a time.

    Args:
        work: what is done with a task.
        scheduler: of which workers; they are whoever joins it.
        least: wait for so many of them.

    Raises:
        MissingLibraryError: Dask is not installed.
        CampaignError: no scheduler there, one without TLS that was not asked for, no worker, or one that is another
            program.
    """

    def __init__(self, work: Work, *, scheduler: DaskScheduler, least: int = 1) -> None:
        distributed = library("distributed", what="a campaign past one machine")
        library("dask").config.set({"distributed.comm.timeouts.connect": f"{_CONNECT} s"})
        for name in ("distributed", "distributed.core", "distributed.scheduler"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what it says of dead workers, we say ourselves
        security = scheduler.security()
        self._work, self._address, self._tries = work, scheduler.address, 0
        self._ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._tasks: dict[Any, CampaignTask] = {}
        self._client: Any = None
        self._lost_for, self._counted, self._count = 0.0, float("-inf"), 1
        self._killed = distributed.scheduler.KilledWorker
        try:
            _knock(*scheduler.place)
            self._client = distributed.Client(
                scheduler.address, security=security, timeout=_CONNECT, set_as_default=False
            )
            self._client.wait_for_workers(least, timeout=4 * _CONNECT)
        except (OSError, TimeoutError, RuntimeError) as error:
            self.close()
            raise CampaignError(
                f"no worker answers: {in_words(error).removesuffix('.')}.",
                where=self._address,
                hint="Start it with `dask scheduler`, workers with `dask worker ADDRESS --nthreads 1`; with TLS, all "
                "three need certificates that the same one has signed.",
            ) from None
        self._check_workers()

    @property
    def workers(self) -> int:
        if time.monotonic() - self._counted > _COUNTED:  # asked of the scheduler: not for every task
            self._counted = time.monotonic()
            with suppress(Exception, CancelledError):  # between two connections it knows nothing: as many as before
                self._count = len(self._known())
        return self._count

    @property
    def description(self) -> str:
        place = f"of the scheduler {self._address}"
        count = self.workers
        if not count:
            return f"no worker {place}, it waits for one"
        return f"{count} worker{'s' if count > 1 else ''} {place}"

    def _known(self) -> dict[str, Any]:
        return dict(self._client.scheduler_info(n_workers=-1)["workers"])

    def _check_workers(self) -> None:
        """That the scheduler and every worker are the same program as this one, and work at one task at a time.

        Raises:
            CampaignError: naming the first that is not, and what differs.
        """
        try:
            for address, facts in self._known().items():
                if facts["nthreads"] != 1:
                    raise CampaignError(
                        f"works at {facts['nthreads']} tasks at once, expected one.",
                        where=address,
                        hint="Start it with: dask worker ADDRESS --nthreads 1",
                    )
            wanted = program.program()
            every = dict(self._client.run(_program, on_error="return"))
            try:
                every[f"scheduler {self._address}"] = self._client.run_on_scheduler(_program)
            except Exception as error:  # whatever its process lacks
                every[f"scheduler {self._address}"] = error
            for address, answer in every.items():
                if isinstance(answer, BaseException):
                    raise CampaignError(
                        f"it cannot say what program it is: {in_words(answer)}.",
                        where=address,
                        hint="Install the same swashplate[scale] there.",
                    )
                differing = program.differences(wanted, answer)
                if differing:
                    raise CampaignError(
                        f"it has another program: {'; '.join(differing)}.",
                        where=address,
                        hint="Install the same versions there.",
                    )
        except BaseException:
            self.close()
            raise

    def submit(self, task: CampaignTask) -> None:
        self._tries += 1
        future = self._client.submit(_done, self._work, task, key=f"{task.name}-{self._tries}", pure=False)
        self._tasks[future] = task
        future.add_done_callback(self._ended.put)

    def outcomes(self, seconds: float) -> Iterator[TaskOutcome]:
        try:
            future = self._ended.get(timeout=seconds)
        except queue.Empty:
            self._check_scheduler(seconds)
            return
        self._lost_for = 0.0
        if not self._count:  # somebody did it: counted anew
            self._counted = float("-inf")
        task = self._tasks.pop(future)
        if future.status == "finished":
            columns, error, fatal = future.result()
            yield TaskOutcome(task, columns=columns, error=error, fatal=fatal)
        elif future.status == "error":
            error = future.exception()
            yield TaskOutcome(task, error=in_words(error), died=isinstance(error, self._killed))
        else:  # cancelled, lost: the scheduler has forgotten it
            yield TaskOutcome(task, error="the scheduler has lost it", died=True)
            self._check_scheduler(seconds)

    def _check_scheduler(self, seconds: float) -> None:
        """That the scheduler is there, or was a moment ago.

        Raises:
            CampaignError: where it is gone.
        """
        self._lost_for = 0.0 if self._client.status == "running" else self._lost_for + seconds
        if self._lost_for > _GONE or self._client.status in ("closed", "closing"):
            raise CampaignError(
                "the scheduler is gone.",
                where=self._address,
                hint="What is done is kept: start it again, and run `swash campaign resume`.",
            )

    def close(self) -> None:
        if self._client is not None:
            with suppress(Exception, CancelledError):  # it may be trying to connect to a scheduler that is gone
                for future in self._tasks:
                    future.release()
                self._client.close(timeout=5.0)


def _knock(host: str, port: int) -> None:
    """That something listens there: a client of Dask that cannot connect is never quite closed.

    Raises:
        OSError: where nobody answers.
    """
    until = time.monotonic() + _CONNECT
    while True:  # it may have been started a moment ago
        try:
            socket.create_connection((host, port), timeout=_CONNECT).close()
            return
        except OSError:
            if time.monotonic() > until:
                raise
            time.sleep(0.1)


def _program() -> dict[str, str]:
    """On a worker or a scheduler: what program it is."""
    return program.program()


def _done(work: Work, task: CampaignTask) -> tuple[Columns | None, str, bool]:
    """On a worker: a task done, or in words why not, and whether no worker like this one can do it."""
    os.environ |= ONE_THREAD
    try:
        program.check_program(task.program, where="a worker")
    except CampaignError as error:
        return None, in_words(error), True
    try:
        return work(task), "", False
    except Exception as error:  # whatever a task's own code raises is its outcome
        return None, in_words(error), False
