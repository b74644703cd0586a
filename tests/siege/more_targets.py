"""More kinds of files: tables and parameters that a vehicle names, and what a campaign keeps."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from swashplate.api.campaigns.plan import plan_campaign, planned_in
from swashplate.api.campaigns.result_files import ENDING, packed
from swashplate.api.campaigns.store import PLAN, RESULTS, CampaignStore
from swashplate.links.ardupilot.gains import read_parameter_file
from swashplate.models.published import read_published

from .target import Target, by_bytes, by_entries

CAMPAIGN = """
kind = "campaign"
of = "recovery"
count = 6
seed = 7
batch = 2
vehicle = "coax"
maneuver = "multisine:roll+pitch,0.4-4Hz,20s,0.1"
free = "flight"
method = "output-error"
rate = 50.0
"""
PARAMETERS = b"# rate loops\nATC_RAT_RLL_P 0.12\nATC_RAT_RLL_I,0.1\nH_COL_HOVER\t0.55\nINS_GYRO_FILTER 20 # Hz\n"
PUBLISHED = (
    b"name,value,unit\nX_u,-0.02,\nM_q,-1.9,\nZ_theta0,-90.1,\nN_r,-0.4,\n",
    b",u,w,q,theta,v,p,phi,r,theta0\nu,-0.02,0.03,0.2,-9.8,0,-0.1,0,0,5.1\nq,0.01,0,-1.9,0,0,0.3,0,0,2.2\n",
)


def _use_campaign(path: Path) -> None:
    plan_campaign(path)


def stored_result() -> bytes:
    table = {"seed": np.arange(4), "verdict": np.array(["found", "lost"] * 2), "tau": np.linspace(0.0, 1.0, 4)}
    return packed(table, task="task")


def use_result(path: Path) -> None:
    folder = path.parent / f"store{path.suffix}"
    (folder / RESULTS).mkdir(parents=True, exist_ok=True)
    (folder / RESULTS / f"task{path.suffix}").write_bytes(path.read_bytes())
    CampaignStore(folder).columns("task")


def _plan() -> bytes:
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "a.toml").write_text(CAMPAIGN)
        made = plan_campaign(Path(name) / "a.toml")
        return json.dumps({"kind": "campaign-plan", "schema": 3, **made.stored()}).encode()


def _use_plan(path: Path) -> None:
    folder = path.parent / "store"
    folder.mkdir(exist_ok=True)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    (folder / PLAN).write_bytes(path.read_bytes())
    planned_in(CampaignStore(folder))


def _of(suffix: str, whole: Callable[[], tuple[bytes, ...]], use: Callable[[Path], object]) -> Callable[[], Target]:
    how = by_entries("toml" if suffix == ".toml" else "json") if suffix in (".toml", ".json") else by_bytes
    return lambda: Target(suffix, whole(), how, use)


MORE: Mapping[str, Callable[[], Target]] = {
    "ArduPilot parameters": _of(".parm", lambda: (PARAMETERS,), read_parameter_file),
    "published derivatives": _of(".csv", lambda: PUBLISHED, read_published),
    "campaign": _of(".toml", lambda: (CAMPAIGN.encode(),), _use_campaign),
    "plan of a campaign": _of(".json", lambda: (_plan(),), _use_plan),
    "result of a task": _of(ENDING, lambda: (stored_result(),), use_result),
}
