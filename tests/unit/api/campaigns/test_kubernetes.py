"""A campaign on Kubernetes: dask-kubernetes' pods, some killed by force, the same bits as on this machine.

Runs where a cluster answers (`kubectl`), dask-kubernetes is installed and SWASH_IMAGE names an image with this very
program and the extra `scale`, within `make proof`; sizes by SWASH_TASKS and SWASH_KILLS.
"""

from __future__ import annotations

import importlib.util
import json
import os
import random
import shutil
import subprocess
import sys
import threading
import time
from importlib import metadata
from pathlib import Path

import pytest

import made_campaigns
import proof_page
import swashplate as sp
from swashplate.api.campaigns.store import CampaignStore
from swashplate.control.kinds import save_controller
from swashplate.control.lqg.design import design
from swashplate.filtering.sensor_suite import suite

TASKS, KILLS = int(os.environ.get("SWASH_TASKS", "100")), int(os.environ.get("SWASH_KILLS", "6"))
NAME = "swash-kubernetes-test"
CAMPAIGN = """
kind = "campaign"
of = "monte-carlo"
count = {count}
batch = 10
vehicle = "coax"
maneuver = "hover:4s"
controller = "hold.toml"
gusts = "indoor=0.3"
"""


DEPLOY = f"""
import sys
from dask_kubernetes.operator import KubeCluster, make_cluster_spec
spec = make_cluster_spec(
    name="{NAME}", image=sys.argv[1], n_workers=2, worker_command=["dask", "worker", "--nthreads", "1"],
    resources={{"requests": {{"cpu": "400m", "memory": "1G"}}}},
)
spec["spec"]["scheduler"]["spec"]["containers"][0]["args"][:1] = ["dask", "scheduler"]
with KubeCluster(custom_cluster_spec=spec, quiet=True) as cluster:
    print(cluster.scheduler_address, flush=True)
    input()
"""


def asked(*words: str) -> str:
    return subprocess.run(["kubectl", *words], capture_output=True, text=True, check=False, timeout=60).stdout


def computed(campaign: Path, folder: Path, *words: str) -> float:
    """Seconds of a campaign, by the command line."""
    command = [sys.executable, "-m", "swashplate", "campaign", "run", str(campaign), "-o", str(folder), *words]
    began = time.monotonic()
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=1800)
    assert ended.returncode == 0, ended.stderr
    return time.monotonic() - began


@pytest.mark.proof
def test_a_campaign_on_kubernetes_outlives_killed_pods(tmp_path: Path) -> None:
    image = os.environ.get("SWASH_IMAGE", "")
    if importlib.util.find_spec("dask_kubernetes") is None:
        pytest.skip("dask-kubernetes is not installed")
    if not image or shutil.which("kubectl") is None or "Ready" not in asked("get", "nodes"):
        pytest.skip("no Kubernetes answers here (kubectl), or SWASH_IMAGE names no image")
    campaign = tmp_path / "flights.toml"
    campaign.write_text(CAMPAIGN.format(count=10 * TASKS))
    save_controller(design(sp.vehicle("coax"), sensors=suite("gyro@50,mocap@50"), rate=50.0), tmp_path / "hold.toml")
    computed(campaign, tmp_path / "here")
    chance, over = random.Random(1), threading.Event()
    killed: list[str] = []

    def kill() -> None:
        while len(killed) < KILLS and not over.wait(chance.uniform(5.0, 15.0)):
            workers = asked(
                "get", "pods", "-o", "name", "--field-selector", "status.phase=Running",
                "-l", f"dask.org/cluster-name={NAME},dask.org/component=worker",
            ).split()  # fmt: skip
            if workers:
                killed.append(chance.choice(workers))
                asked("delete", killed[-1], "--grace-period=0", "--force")

    deployer = subprocess.Popen(
        [sys.executable, "-c", DEPLOY, image], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert deployer.stdout is not None
        address = deployer.stdout.readline().strip()
        assert address.startswith("tcp://"), address
        threading.Thread(target=kill, daemon=True).start()
        seconds = computed(campaign, tmp_path / "there", "--scheduler", address, "--settings", "insecure=true")
    finally:
        over.set()
        deployer.communicate("\n", timeout=60)
    same = made_campaigns.bits(tmp_path / "there") == made_campaigns.bits(tmp_path / "here")
    failed = CampaignStore(tmp_path / "there").failed()
    version = json.loads(asked("version", "-o", "json"))["serverVersion"]["gitVersion"]
    proof_page.leave(
        "campaign-kubernetes",
        {
            "title": "A campaign on Kubernetes",
            "text": f"Kubernetes {version}, dask-kubernetes {metadata.version('dask-kubernetes')}, one node, two pods "
            "of one worker each; `swash campaign run` flies 10 closed loops of 4 s in gusts per task; pods are deleted "
            "by force at random instants, and Kubernetes starts new ones. Wanted is every task's result once, with the "
            "bits of a run on this machine.",
            "columns": ["tasks", "pods killed", "seconds", "tasks given up", "all bits the same"],
            "rows": [[TASKS, len(killed), round(seconds), len(failed), same]],
            "passed": same and not failed and bool(killed),
        },
    )
    assert failed == {}
    assert same
    assert killed
