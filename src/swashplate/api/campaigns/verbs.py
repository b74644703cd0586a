"""The verbs of campaigns: begin one, go on with one, see one row of it again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.api.campaigns import worker
from swashplate.api.campaigns.engine import CampaignStanding, TaskEngine, Work, carry_out
from swashplate.api.campaigns.plan import CampaignPlan, changes, cores, duration, plan_campaign, planned_in
from swashplate.api.campaigns.pool import ProcessPool
from swashplate.api.campaigns.program import differences, program
from swashplate.api.campaigns.results import Campaign, campaign_results
from swashplate.api.campaigns.scheduler import DaskScheduler
from swashplate.api.campaigns.store import FAILED, CampaignStore
from swashplate.api.campaigns.tasks import CampaignTask
from swashplate.api.saying import Say
from swashplate.errors import CampaignError

if TYPE_CHECKING:
    from swashplate.api.verbs.campaign import ResumeCampaign, RunCampaign


def run_campaign(asked: RunCampaign, folder: Path, say: Say) -> Campaign:
    """Compute a campaign, or what is left of it, into a folder.

    Stopped or killed at any moment it goes on where it was the next time: every task is named by the SHA-256 of what it
    depends on, and its result is a file that appears when it is complete.
    """
    plan, make = plan_campaign(asked.file), _chosen(asked.where(), asked.workers)
    store = CampaignStore(folder)
    with store.held():
        if store.exists:
            changed = changes(store.plan(), plan.stored())
            if changed and not asked.accept_changes:
                raise CampaignError(
                    f"was begun otherwise: {'; '.join(changed)}.",
                    where=store.folder,
                    hint="Put that back, or begin anew in another folder, or say --accept-changes: tasks whose inputs "
                    "are the same are kept, the others are done anew.",
                )
        else:
            changed = ["new"]
        if changed:
            say("writing the plan")
            store.begin(plan.text, plan.stored(), plan.tasks[0].files if plan.tasks else {})
        _finish(plan, store, make, say=say)
    return campaign_results(folder)


def go_on(asked: ResumeCampaign, say: Say) -> Campaign:
    """Go on with a campaign where it was, from its folder alone."""
    store, make = CampaignStore(asked.folder), _chosen(asked.where(), asked.workers)
    store.plan()
    with store.held():
        plan = planned_in(store)
        _check_same_program(plan, store)
        if asked.retry_failed:
            for name in store.failed():
                (store.folder / FAILED / f"{name}.json").unlink(missing_ok=True)
        _finish(plan, store, make, say=say)
    return campaign_results(asked.folder)


def replay_campaign(folder: str | Path, number: int) -> Any:
    """One row of a campaign again, whole: a `Flight` of a campaign of flights, a `Result` of one of fits.

    Its task is done again in a process like a worker's, so that the row is what it was.

    Args:
        folder: of the campaign.
        number: of the row, as the report has it.

    Raises:
        CampaignError: a number that the campaign does not have; another program than it was begun with, which may give
            another row; a task that cannot be done.
    """
    store = CampaignStore(folder)
    plan = planned_in(store)
    _check_same_program(plan, store)
    task = next((t for t in plan.tasks if 0 <= number - t.portion.first < t.portion.count), None)
    if task is None:
        raise CampaignError(f"has no {plan.kind.rows} {number}; it has {plan.rows}.", where=folder)
    replaying: Any = partial(worker.replay, row=number - task.portion.first)
    pool = ProcessPool(replaying, workers=1)
    try:
        outcome = pool.do(task)
    finally:
        pool.close()
    if outcome.columns is None:
        raise CampaignError(f"cannot be done again: {outcome.error}", where=f"{plan.kind.rows} {number}")
    return outcome.columns


def _check_same_program(plan: CampaignPlan, store: CampaignStore) -> None:
    """That this process computes what a campaign's tasks were computed with.

    Raises:
        CampaignError: with what differs.
    """
    changed = differences(plan.tasks[0].program if plan.tasks else {}, program())
    if changed:
        raise CampaignError(
            f"was begun with another program: {'; '.join(changed)}.",
            where=store.folder,
            hint="Install that one again, or `swash campaign run FILE --accept-changes`, which does all anew.",
        )


def _chosen(scheduler: DaskScheduler | None, workers: int | None) -> Callable[[Work, int], TaskEngine]:
    """What makes the engine for so many tasks.

    Raises:
        CampaignError: a scheduler without TLS, or files for TLS that are none.
    """
    if scheduler is None:
        return lambda work, tasks: ProcessPool(work, workers=min(workers or cores(), tasks))
    from swashplate.api.campaigns.dask_engine import DaskEngine

    scheduler.security()  # what is wrong with it comes before anything is written
    return lambda work, _: DaskEngine(work, scheduler=scheduler, least=workers or 1)


def _finish(plan: CampaignPlan, store: CampaignStore, make: Callable[[Work, int], TaskEngine], *, say: Say) -> None:
    """Do every task of a plan that the store does not have."""
    names = {task.name for task in plan.tasks}
    if refused := store.forget_refused(sorted(names & store.done())):
        say(f"{len(refused)} results are refused, and their tasks done again")
    done, failed = store.done(), store.failed()
    left: Sequence[CampaignTask] = [t for t in plan.tasks if t.name not in done and t.name not in failed]
    standing = CampaignStanding(total=len(plan.tasks), done=len(names & done), failed=len(names & set(failed)))
    if not left:
        return
    say("starting the workers")
    engine = make(worker.work, len(left))
    standing.workers = engine.workers
    try:
        tell = partial(_say_standing, say, plan, engine)
        tell(standing)
        carry_out(left, engine, store, standing=standing, tell=tell)
    finally:
        with suppress(KeyboardInterrupt):
            engine.close()


def _say_standing(say: Say, plan: CampaignPlan, engine: TaskEngine, standing: CampaignStanding) -> None:
    left = "" if standing.seconds_left is None or not standing.workers else f", {duration(standing.seconds_left)} left"
    failed = f", {standing.failed} failed" if standing.failed else ""
    say(
        f"{plan.of} on {engine.description}",
        done=standing.done + standing.failed,
        total=standing.total,
        note=f"{standing.done} of {standing.total} tasks{failed}{left}",
    )
