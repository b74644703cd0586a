"""A client of a campaign without a model, as a process to be killed: python campaign_client.py FOLDER WORKERS N [TLS].

TLS are the address of a scheduler, a certificate and its key; processes of its own do the tasks where there is none.
What the store does not have yet is done; `made_campaigns.numbers` is the work, a tenth of a second a task.
"""

from __future__ import annotations

import sys
from pathlib import Path

import made_campaigns
from swashplate.api.campaigns.dask_engine import DaskEngine
from swashplate.api.campaigns.engine import CampaignStanding, TaskEngine, carry_out
from swashplate.api.campaigns.pool import ProcessPool
from swashplate.api.campaigns.scheduler import DaskScheduler
from swashplate.api.campaigns.store import CampaignStore


def main(folder: str, workers: int, count: int, *tls: str) -> None:
    every = made_campaigns.tasks(count, batch=1, wait=0.1)
    store = CampaignStore(Path(folder))
    with store.held():
        store.begin("", {}, {})
        done = store.done()
        left = [task for task in every if task.name not in done]
        engine: TaskEngine
        if tls:
            address, certificate, key = tls
            named = DaskScheduler(address, ca=certificate, certificate=certificate, key=key)
            engine = DaskEngine(made_campaigns.numbers, scheduler=named)
        else:
            engine = ProcessPool(made_campaigns.numbers, workers=workers)
        try:
            standing = CampaignStanding(total=len(every), done=len(every) - len(left), failed=0)
            carry_out(left, engine, store, standing=standing, tell=lambda _: None)
        finally:
            engine.close()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), *sys.argv[4:])
