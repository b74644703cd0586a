"""Tasks come to their results whatever happens to workers: the same bits, each once, failures said."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import made_campaigns
from dask_cluster import Cluster, cluster
from swashplate.api.campaigns import program
from swashplate.api.campaigns.dask_engine import DaskEngine
from swashplate.api.campaigns.engine import TRIES, CampaignStanding, TaskEngine, carry_out
from swashplate.api.campaigns.pool import ProcessPool
from swashplate.api.campaigns.result_files import ENDING
from swashplate.api.campaigns.scheduler import DaskScheduler
from swashplate.api.campaigns.store import CampaignStore
from swashplate.api.campaigns.tasks import CampaignTask
from swashplate.compiled import can_compile
from swashplate.errors import CampaignError, WriteError


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A scheduler with TLS, and one worker."""
    with cluster(tmp_path_factory.mktemp("tls")) as made:
        yield made


def expected(every: tuple[CampaignTask, ...], folder: Path) -> dict[str, bytes]:
    """The same of this process, without any engine."""
    store = CampaignStore(folder)
    store.begin("", {}, {})
    for task in every:
        store.keep(task, made_campaigns.numbers(replace(task, settings={})))
    return made_campaigns.bits(store.folder)


def done(every: tuple[CampaignTask, ...], engine: TaskEngine, folder: Path) -> tuple[CampaignStore, CampaignStanding]:
    """Tasks carried out; the engine is closed."""
    store, standing = CampaignStore(folder), CampaignStanding(total=len(every), done=0, failed=0)
    store.begin("", {}, {})
    try:
        with store.held():
            carry_out(every, engine, store, standing=standing, tell=lambda _: None)
    finally:
        engine.close()
    return store, standing


def test_kills_and_failures_cost_nothing_but_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swashplate.api.campaigns.engine.DEATHS", 2)
    every = made_campaigns.tasks(fail=[4], die=[8], die_once=[2], folder=str(tmp_path))
    store, standing = done(every, ProcessPool(made_campaigns.numbers, workers=2), tmp_path / "two")
    good = tuple(task for task in every if task.portion.first not in (4, 8))
    assert made_campaigns.bits(store.folder) == expected(good, tmp_path / "here")
    assert (standing.done, standing.failed) == (4, 2)
    failed = {told["first"]: told["tries"] for told in store.failed().values()}
    assert failed == {
        4: ["ValueError: row 4 cannot be done"] * TRIES,
        8: ["its worker was ended by SIGKILL"] * 2,
    }
    assert {told["seed"] for told in store.failed().values()} == {every[2].portion.seed, every[4].portion.seed}


def test_what_workers_kept_of_a_campaign_goes_with_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, told = tmp_path / "temporary", tmp_path / "told"
    place.mkdir()
    told.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    monkeypatch.setattr("tempfile.tempdir", str(place))
    done(made_campaigns.tasks(4, keeps=str(told)), ProcessPool(made_campaigns.numbers, workers=2), tmp_path / "two")
    assert list(told.iterdir())
    assert list(place.iterdir()) == []


def test_dask_gives_the_bits_of_the_pool_and_finds_what_always_fails(
    dask: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = made_campaigns.tasks(fail=[4])
    engine = DaskEngine(made_campaigns.numbers, scheduler=dask.named)
    monkeypatch.setattr(engine, "close", lambda: None)
    store, _ = done(every, engine, tmp_path / "dask")
    good = tuple(task for task in every if task.portion.first != 4)
    assert made_campaigns.bits(store.folder) == expected(good, tmp_path / "here")
    assert [told["tries"] for told in store.failed().values()] == [["ValueError: row 4 cannot be done"] * TRIES]
    with monkeypatch.context() as scheduler:
        scheduler.setattr(engine._client, "scheduler_info", lambda n_workers: {"workers": {}})
        scheduler.setattr(engine, "_counted", float("-inf"))
        assert engine.workers == 0
        assert engine.description == f"no worker of the scheduler {dask.address}, it waits for one"
    engine._counted = float("-inf")
    other = tuple(replace(task, program=dict(task.program) | {"numpy": "1.0"}) for task in made_campaigns.tasks(2))
    monkeypatch.undo()
    with pytest.raises(CampaignError, match=r"another program: numpy is \S+, expected 1\.0"):
        done(other, engine, tmp_path / "other")
    assert CampaignStore(tmp_path / "other").failed() == {}, "a worker of another program is no try of the task"


def test_it_is_told_when_workers_come_and_go(tmp_path: Path) -> None:
    class Coming(made_campaigns.InProcess):
        workers = property(lambda self: (2, 0, 1)[min(len(self.did), 2)])  # type: ignore[assignment]

    store, told = CampaignStore(tmp_path), []
    store.begin("", {}, {})
    every = made_campaigns.tasks()
    standing = CampaignStanding(total=len(every), done=0, failed=0, workers=2)
    with store.held():
        carry_out(
            every, Coming(made_campaigns.numbers), store, standing=standing, tell=lambda s: told.append(s.workers)
        )
    assert told == [2, 0, 0, 1, 1, 1, 1, 1], "six tasks, and two changes"
    assert standing.done == len(every)


def test_a_campaign_whose_first_tasks_all_fail_is_ended(tmp_path: Path) -> None:
    every = made_campaigns.tasks(20, batch=1, fail=list(range(20)))
    with pytest.raises(CampaignError, match=r"none of its tasks can be done; .*row \d cannot be done\. Mend the"):
        done(every, made_campaigns.InProcess(made_campaigns.numbers), tmp_path)
    assert len(CampaignStore(tmp_path).failed()) == TRIES


def test_a_full_disk_ends_it_with_what_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    every, replaced = made_campaigns.tasks(), os.replace

    def full(source: str | Path, target: str | Path) -> None:
        if len(list((tmp_path / "results").glob("[0-9a-f]*"))) == 3 and Path(target).parent.name == "results":
            raise OSError(28, "No space left on device", str(source))
        replaced(source, target)

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", full)
        with pytest.raises(WriteError, match=r"No space left on device\. Free some space"):
            done(every, made_campaigns.InProcess(made_campaigns.numbers), tmp_path)
    store = CampaignStore(tmp_path)
    assert len(store.done()) == 3
    assert sorted(path.suffix for path in (tmp_path / "results").iterdir()) == [ENDING] * 3
    left = tuple(task for task in every if task.name not in store.done())
    store, _ = done(left, made_campaigns.InProcess(made_campaigns.numbers), tmp_path)
    assert made_campaigns.bits(store.folder) == expected(every, tmp_path / "here")


def waited_for(engine: TaskEngine) -> None:
    """An engine until it raises; five minutes at most."""
    until = time.monotonic() + 300.0
    while time.monotonic() < until:
        list(engine.outcomes(0.2))


@pytest.mark.proof
def test_a_scheduler_by_its_address_and_then_it_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swashplate.api.campaigns.dask_engine._GONE", 2.0)
    every = made_campaigns.tasks()
    with cluster(tmp_path / "tls") as dask:
        store, _ = done(every, DaskEngine(made_campaigns.numbers, scheduler=dask.named), tmp_path / "dask")
        assert made_campaigns.bits(store.folder) == expected(every, tmp_path / "here")
        engine = DaskEngine(made_campaigns.numbers, scheduler=dask.named)
        engine.submit(made_campaigns.tasks(1, wait=60.0)[0])
        dask.scheduler.kill()
        with pytest.raises(CampaignError, match=r"the scheduler is gone\. What is done is kept"):
            waited_for(engine)
        engine.close()


@pytest.mark.proof
def test_a_campaign_whose_workers_have_all_gone_waits_and_says_so(tmp_path: Path) -> None:
    every, store, told = made_campaigns.tasks(), CampaignStore(tmp_path / "dask"), []
    store.begin("", {}, {})
    with cluster(tmp_path / "tls") as dask:
        engine = DaskEngine(made_campaigns.numbers, scheduler=dask.named)
        standing = CampaignStanding(total=len(every), done=0, failed=0, workers=engine.workers)
        dask.workers[0].kill()

        def tell(standing: CampaignStanding) -> None:
            told.append((standing.workers, engine.description))
            if not standing.workers and len(dask.workers) == 1:
                dask.join("--no-nanny")

        try:
            with store.held():
                carry_out(every, engine, store, standing=standing, tell=tell)
        finally:
            engine.close()
    assert told[0] == (0, f"no worker of the scheduler {dask.address}, it waits for one")
    assert told[-1][0] == 1
    assert made_campaigns.bits(store.folder) == expected(every, tmp_path / "here")


@pytest.mark.proof
def test_a_worker_that_joins_late_without_the_package_costs_nothing_but_time(tmp_path: Path) -> None:
    (tmp_path / "swashplate.py").write_text("raise ModuleNotFoundError(\"No module named 'swashplate'\")")
    every = made_campaigns.tasks(150, batch=1, wait=0.1)
    with cluster(tmp_path / "tls") as dask:
        engine = DaskEngine(made_campaigns.numbers, scheduler=dask.named)
        words = ["dask", "worker", dask.address, "--nthreads", "1", "--no-dashboard", *dask.tls]
        bare = {**os.environ, "PYTHONPATH": str(tmp_path)}
        late = subprocess.Popen([sys.executable, "-m", *words], env=bare, stderr=subprocess.DEVNULL)
        try:
            store, _ = done(every, engine, tmp_path / "late")
        finally:
            late.terminate()
            late.wait()
    assert store.failed() == {}
    assert made_campaigns.bits(store.folder) == expected(every, tmp_path / "here")


@pytest.mark.skipif(not can_compile(), reason="no C compiler here, or no CasADi")
@pytest.mark.parametrize("there", [False, True])
def test_a_worker_without_a_compiler_that_compiles_is_another_program(there: bool, tmp_path: Path) -> None:
    if not there and find_spec("ziglang") is not None:
        pytest.skip("ziglang is installed: every worker has a compiler")
    if there:  # one without headers
        (tmp_path / "cc").write_text("#!/bin/sh\necho 'fatal error: math.h: No such file or directory' >&2; exit 1\n")
        (tmp_path / "cc").chmod(0o755)
    with cluster(None, environment={"PATH": str(tmp_path)}) as dask, pytest.raises(CampaignError) as refused:
        DaskEngine(made_campaigns.numbers, scheduler=dask.named)
    assert "it has another program: equations is CasADi's virtual machine, expected compiled C" in str(refused.value)


def test_nobody_at_an_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swashplate.api.campaigns.dask_engine._CONNECT", 0.5)
    with pytest.raises(CampaignError, match=r"tcp://127\.0\.0\.1:9: no worker answers: .*dask worker ADDRESS"):
        DaskEngine(made_campaigns.numbers, scheduler=DaskScheduler("tcp://127.0.0.1:9", insecure=True))


def test_time_left_is_counted_from_the_second_task_of_each_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([100.0, 110.0, 112.0, 114.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    standing = CampaignStanding(total=10, done=2, failed=1, workers=2)
    told = []
    for _ in range(4):
        standing.count()
        told.append(standing.seconds_left)
    assert told == [None, None, pytest.approx(4 * 2.0), pytest.approx(3 * 2.0)]


def test_program_says_what_differs() -> None:
    mine = program.program()
    assert program.differences(mine, mine) == []
    assert program.differences(mine, {**mine, "numpy": "0.0"}) == [f"numpy is 0.0, expected {mine['numpy']}"]
    assert np.all([len(value) > 0 for value in mine.values()])


def test_an_engine_closes_while_its_client_looks_for_a_scheduler_that_is_gone(
    dask: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = DaskEngine(made_campaigns.numbers, scheduler=dask.named)

    def cancelled(*_: object, **__: object) -> None:
        raise asyncio.CancelledError  # what Dask's client raises then; it is no Exception

    with monkeypatch.context() as gone:
        for name in ("close", "scheduler_info"):
            gone.setattr(engine._client, name, cancelled)
        engine._counted = float("-inf")
        assert engine.workers == 1, "as many as before"
        engine.close()
    engine.close()
