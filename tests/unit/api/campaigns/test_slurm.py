"""A campaign through Slurm: dask-jobqueue's workers, jobs that are cancelled, the same bits as in one process.

Runs where a Slurm answers (`sinfo`) and dask-jobqueue is installed, within `make proof`; sizes by SWASH_TASKS and
SWASH_KILLS.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import distributed
import pytest

import made_campaigns
import proof_page
from dask_cluster import certificates
from swashplate.api.campaigns.dask_engine import DaskEngine
from swashplate.api.campaigns.engine import CampaignStanding, carry_out
from swashplate.api.campaigns.scheduler import DaskScheduler
from swashplate.api.campaigns.store import CampaignStore

TASKS, CANCELLED = int(os.environ.get("SWASH_TASKS", "600")), int(os.environ.get("SWASH_KILLS", "10"))
NAME = "swash-slurm-test"


def asked(*words: str) -> str:
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=30).stdout


@pytest.mark.proof
def test_a_campaign_on_slurm_outlives_cancelled_jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobqueue = pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed")
    if not shutil.which("sinfo") or "up" not in asked("sinfo", "-h", "-o", "%a"):
        pytest.skip("no Slurm answers here (sinfo)")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(part for part in sys.path if part))  # jobs get the environment
    every = made_campaigns.tasks(TASKS, batch=1, wait=0.2)
    here, there = CampaignStore(tmp_path / "here"), CampaignStore(tmp_path / "slurm")
    here.begin("", {}, {})
    for task in every:
        here.keep(task, made_campaigns.numbers(replace(task, settings={})))
    certificate, key = certificates(tmp_path / "tls")
    files = {f"tls_{role}_{part}": str(file) for role in ("scheduler", "worker", "client")
             for part, file in (("cert", certificate), ("key", key))}  # fmt: skip
    security = distributed.Security(tls_ca_file=str(certificate), require_encryption=True, **files)
    chance, over = random.Random(1), threading.Event()
    cancelled: list[str] = []

    def cancel() -> None:
        while len(cancelled) < CANCELLED and not over.wait(chance.uniform(5.0, 10.0)):
            running = [
                line.split() for line in asked("squeue", "-h", "-n", NAME, "-t", "R", "-o", "%i %M").splitlines()
            ]
            # dask-jobqueue submits a job again whose worker has been there; for one that ends before it waits for ever.
            at_work = [job for job, lasted in running if ":" in lasted and lasted > "0:10"]
            if at_work:
                cancelled.append(chance.choice(at_work))
                asked("scancel", "--signal=KILL", "--full", cancelled[-1])

    with jobqueue.SLURMCluster(
        cores=1, processes=1, memory="2GB", walltime="00:30:00", interface="lo", job_name=NAME,
        job_extra_directives=["--mem=0"], log_directory=str(tmp_path / "logs"), protocol="tls://", security=security,
    ) as cluster:  # fmt: skip
        cluster.adapt(minimum_jobs=2, maximum_jobs=2, interval="2s")
        began = time.monotonic()
        while not asked("squeue", "-h", "-n", NAME, "-t", "R", "-o", "%i").split():
            assert time.monotonic() - began < 120.0, "no job runs"
            time.sleep(0.5)
        named = DaskScheduler(cluster.scheduler_address, ca=certificate, certificate=certificate, key=key)
        engine = DaskEngine(made_campaigns.numbers, scheduler=named, least=2)
        threading.Thread(target=cancel, daemon=True).start()
        began = time.monotonic()
        try:
            there.begin("", {}, {})
            with there.held():
                standing = CampaignStanding(total=len(every), done=0, failed=0)
                carry_out(every, engine, there, standing=standing, tell=lambda _: None)
        finally:
            over.set()
            engine.close()
    same, failed = made_campaigns.bits(tmp_path / "slurm") == made_campaigns.bits(tmp_path / "here"), there.failed()
    proof_page.leave(
        "campaign-slurm",
        {
            "title": "A campaign through Slurm",
            "text": f"{asked('sinfo', '--version').strip()}, dask-jobqueue {jobqueue.__version__}, two jobs of one "
            "worker each; jobs are killed by scancel at random instants, and new ones submitted. Wanted is "
            "every task's result once, with the bits of a run in one process.",
            "columns": ["tasks", "jobs killed", "seconds", "tasks given up", "all bits the same"],
            "rows": [[TASKS, len(cancelled), round(time.monotonic() - began), len(failed), same]],
            "passed": same and not failed and bool(cancelled),
        },
    )
    assert failed == {}
    assert same
    assert cancelled
