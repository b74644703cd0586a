"""Campaigns under fire, and what a second worker brings; sizes by SWASH_KILLS and SWASH_TASKS."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import pytest

import campaign_client
import made_campaigns
import proof_page
from dask_cluster import Cluster, cluster
from swashplate.api.campaigns.store import CampaignStore

KILLS, TASKS = int(os.environ.get("SWASH_KILLS", "40")), int(os.environ.get("SWASH_TASKS", "600"))
CLIENT = Path(campaign_client.__file__)


def expected(folder: Path) -> dict[str, bytes]:
    """The same of this process."""
    store = CampaignStore(folder)
    store.begin("", {}, {})
    for task in made_campaigns.tasks(TASKS, batch=1, wait=0.1):
        store.keep(task, made_campaigns.numbers(replace(task, settings={})))
    return made_campaigns.bits(folder)


def client(folder: Path, workers: int, dask: Cluster | None) -> subprocess.Popen[bytes]:
    """A client at work, with processes of its own or with a cluster's."""
    words = [sys.executable, str(CLIENT), str(folder), str(workers), str(TASKS)]
    if dask is not None:
        words += [dask.address, str(dask.certificate), str(dask.key)]
    path = os.pathsep.join([str(CLIENT.parent), *(part for part in sys.path if part)])
    return subprocess.Popen(words, env={**os.environ, "PYTHONPATH": path})


def spawned_by(parents: Iterable[int]) -> list[int]:
    """Processes that others have spawned: workers of a client, or of a nanny of Dask."""
    wanted, found = set(parents), []
    for place in Path("/proc").iterdir():
        with suppress(OSError, ValueError, IndexError):
            parent = int((place / "stat").read_text().rpartition(")")[2].split()[1])
            if parent in wanted and b"spawn_main" in (place / "cmdline").read_bytes():
                found.append(int(place.name))
    return found


@contextmanager
def engine(name: str, folder: Path, workers: int) -> Iterator[Cluster | None]:
    """A cluster of Dask with so many workers, whose nannies replace those that are killed; None for "processes"."""
    if name == "processes":
        yield None
        return
    with cluster(folder, workers=0) as made:
        for _ in range(workers):
            made.join("--nanny", "--host", "127.0.0.1")
        yield made


@pytest.mark.proof
@pytest.mark.parametrize("name", ["processes", "dask"])
def test_random_kills_change_no_bit(name: str, tmp_path: Path) -> None:
    chance, folder = random.Random(1), tmp_path / name
    killed = {"workers": 0, "clients": 0}
    began = time.monotonic()
    with engine(name, tmp_path / "tls", 2) as dask:
        running = client(folder, 2, dask)
        while sum(killed.values()) < KILLS and running.poll() != 0:
            if running.poll() is not None:  # a kill while it started
                running = client(folder, chance.choice([1, 2, 8]), dask)
            time.sleep(chance.uniform(0.4, 1.6))
            workers = spawned_by([running.pid] if dask is None else [nanny.pid for nanny in dask.workers])
            if chance.random() < 0.15 and running.poll() is None:
                running.kill()
                running.wait()
                killed["clients"] += 1
                time.sleep(1.0)
            elif workers:
                with suppress(ProcessLookupError):
                    os.kill(chance.choice(workers), signal.SIGKILL)
                    killed["workers"] += 1
        while running.wait(timeout=600) != 0:
            running = client(folder, 2, dask)
    print(f"{name}: {TASKS} tasks, kills: {killed}, {time.monotonic() - began:.0f} s")
    failed, same = CampaignStore(folder).failed(), made_campaigns.bits(folder) == expected(tmp_path / "here")
    at_work = "1, 2 or 8 workers" if name == "processes" else "2 workers of a scheduler with TLS"
    proof_page.leave(
        f"campaign-kills-{name}",
        {
            "title": f"A campaign whose workers and client are killed: {name}",
            "text": f"Hard kills at random instants while {at_work} are at work; the client is begun again "
            "after each of its own. Wanted is every task's result once, with the bits of a run in one process.",
            "columns": ["tasks", "workers killed", "clients killed", "tasks given up", "all bits the same"],
            "rows": [[TASKS, killed["workers"], killed["clients"], len(failed), same]],
            "passed": same and not failed,
        },
    )
    assert failed == {}
    assert same
    assert killed["workers"] > 0


@pytest.mark.proof
def test_one_two_and_eight_workers_have_the_same_bits(tmp_path: Path) -> None:
    whole = expected(tmp_path / "here")
    for name in ("processes", "dask"):
        for workers in (1, 2, 8):
            folder = tmp_path / f"{name}-{workers}"
            with engine(name, tmp_path / f"tls-{workers}", workers) as dask:
                assert client(folder, workers, dask).wait(timeout=900) == 0
            assert made_campaigns.bits(folder) == whole


FLIGHTS = """
kind = "campaign"
of = "monte-carlo"
count = 512
batch = 128
vehicle = "thirteen_state"
controller = "hold.toml"
maneuver = "hover:2s"
vary = {Lb = "5%"}
"""


@pytest.mark.proof
def test_flights_have_the_same_bits_on_any_engine(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "swashplate"]
    design = [
        "control",
        "design",
        "thirteen_state",
        "--sensors",
        "gyro@50,mocap@50",
        "--rate",
        "50",
        "--gain",
        "steady",
    ]
    subprocess.run([*command, *design, "--out", "hold.toml", "-q"], cwd=tmp_path, check=True)
    (tmp_path / "c.toml").write_text(FLIGHTS)
    found = []
    for name, workers in (("processes", 1), ("dask", 2)):
        with engine(name, tmp_path / "tls", workers) as dask:
            joined = [] if dask is None else ["--scheduler", dask.address]
            if dask is not None:
                files = {"tls_ca_file": dask.certificate, "tls_cert": dask.certificate, "tls_key": dask.key}
                joined += [word for field, file in files.items() for word in ("--settings", f"{field}={file}")]
            run = ["campaign", "run", "c.toml", "-o", name, "--workers", str(workers), "-q", *joined]
            subprocess.run([*command, *run], cwd=tmp_path, check=True, timeout=600)
        found.append(made_campaigns.bits(tmp_path / name))
    assert len(found[0]) == 4
    assert found[0] == found[1]
