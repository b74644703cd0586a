"""What a campaign is to compute: its file read and held against its kind, its tasks named, and what they will cost."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec

from swashplate import documents
from swashplate.api.campaigns.kind import CAMPAIGNS, NO_RESULT, CampaignKind, CampaignSettings, vehicle_of
from swashplate.api.campaigns.pool import ProcessPool
from swashplate.api.campaigns.program import differences, program
from swashplate.api.campaigns.store import CampaignStore
from swashplate.api.campaigns.tasks import CampaignTask, Portion, made_tasks
from swashplate.api.campaigns.worker import work
from swashplate.errors import CampaignError, SwashError
from swashplate.files import is_file

_HINT = "See `swash campaign run --help` and docs/howto/campaigns.md."
_LARGEST = 64 << 20
"""Bytes of all files that a task takes with it."""
LEAST_SECONDS = 0.5
"""A task should last longer: below, a cluster's scheduler is busier than its workers."""


@dataclass(frozen=True, repr=False)
class CampaignPlan:
    """What a campaign is to compute.

    Attributes:
        text: of its file.
        of: its kind. document: what the file says, defaults filled in.
        tasks: all of them, in the order of their rows.
        first_seconds, task_seconds, task_bytes: of the first task when it was done once and once more (None: not
            measured): with compiling, without, and the result's size.
    """

    text: str
    of: str
    document: Mapping[str, Any]
    tasks: tuple[CampaignTask, ...]
    first_seconds: float | None = None
    task_seconds: float | None = None
    task_bytes: int | None = None
    workers: int = field(default_factory=lambda: cores())

    @property
    def kind(self) -> CampaignKind:
        """Of the campaign."""
        return CAMPAIGNS[self.of]

    @property
    def rows(self) -> int:
        """How many there are to be."""
        return sum(task.portion.count for task in self.tasks)

    def stored(self) -> dict[str, Any]:
        """As the store keeps it; `planned_in` is the way back."""
        files = self.tasks[0].files if self.tasks else {}
        return {
            "of": self.of,
            "document": dict(self.document),
            "files": {name: hashlib.sha256(content).hexdigest() for name, content in files.items()},
            "program": dict(self.tasks[0].program) if self.tasks else {},
            "portions": [list(asdict(task.portion).values()) for task in self.tasks],
        }

    def to_document(self) -> dict[str, object]:
        """As what becomes JSON."""
        timed = {"first_seconds": self.first_seconds, "task_seconds": self.task_seconds, "task_bytes": self.task_bytes}
        return {"kind": "campaign-plan", "of": self.of, "rows": self.rows, "tasks": len(self.tasks), **timed}

    def __repr__(self) -> str:
        rows, tasks = self.rows, len(self.tasks)
        lines = [f"{self.of}: {rows:,} {self.kind.rows}s in {tasks:,} tasks"]
        if self.first_seconds is not None and self.task_seconds is not None and self.task_bytes is not None:
            total = self.task_seconds * tasks
            compiling = max(0.0, self.first_seconds - self.task_seconds)
            wall = compiling + total / min(self.workers, max(tasks, 1))
            lines += [
                f"a task: {self.task_seconds:.3g} s, its result {self.task_bytes / 1e3:.3g} kB; "
                f"a worker's first one {compiling:.3g} s more, for compiling",
                f"all: {duration(total)} of processor time, {self.task_bytes * tasks / 1e6:.3g} MB; "
                f"with {self.workers} workers about {duration(wall)}",
            ]
            if self.task_seconds < LEAST_SECONDS and tasks > self.workers:
                lines.append(
                    f"Careful: a task should last a second. Say batch = {self.larger_batch()} in the campaign's file."
                )
        return "\n".join(lines)

    def larger_batch(self) -> int:
        """Rows per task that last about a second, a power of two."""
        rows = max((task.portion.count for task in self.tasks), default=1)
        factor = 1.0 / max(self.task_seconds or 1.0, 1e-3)
        return int(2 ** max(0, round(factor * rows - 1).bit_length()))


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def duration(seconds: float) -> str:
    """A time for a person."""
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 7200.0 else f"{seconds / 3600:.3g} h"


def plan_campaign(file: str | Path, *, measure: bool = False) -> CampaignPlan:
    """Read a campaign's file and say what it would compute; nothing is written.

    Args:
        file: the TOML file.
        measure: do the first task twice in a process of its own, to know what all would cost.

    Raises:
        CampaignError: an entry that is missing, unknown or impossible, an unknown kind, a file that is not there.
    """
    text = documents.read_text(file, form="toml", error=CampaignError, hint=_HINT)
    plan = _planned(text, Path(file).absolute().parent, where=str(file))
    return _measured(plan) if measure else plan


def planned_in(store: CampaignStore) -> CampaignPlan:
    """The plan of a campaign that was begun in a store, with the files that it had then.

    Raises:
        CampaignError: where there is none, or the store has lost a file.
    """
    plan = store.plan()
    _kind(plan["of"], where=str(store.folder))
    files = {name: store.input(digest) for name, digest in plan["files"].items()}
    parts = tuple(Portion(*portion) for portion in plan["portions"])
    tasks = made_tasks(plan["of"], matters(plan["document"]), parts, files=files, program=plan["program"])
    return CampaignPlan(store.text(), plan["of"], plan["document"], tasks)


def changes(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What differs between two plans as `CampaignPlan.stored` gives them, in words; empty where nothing does."""
    changed = []
    was, is_ = _flat(before["document"]), _flat(now["document"])
    for entry in dict.fromkeys((*was, *is_)):
        if was.get(entry) != is_.get(entry):
            changed.append(f"{entry} was {was.get(entry, 'not given')}, is {is_.get(entry, 'not given')}")
    for name in sorted({*before["files"], *now["files"]}):
        if before["files"].get(name) != now["files"].get(name):
            changed.append(f"the file {name} has another content")
    changed += [f"the program: {difference} as it was" for difference in differences(before["program"], now["program"])]
    logs = [{p[3]: p[4] for p in plan["portions"] if p[3]} for plan in (before, now)]
    fresh, gone = (sorted(set(a) - set(b)) for a, b in ((logs[1], logs[0]), (logs[0], logs[1])))
    other = [name for name in logs[0] if name in logs[1] and logs[0][name] != logs[1][name]]
    for names, change in ((fresh, "new"), (gone, "gone"), (other, "changed")):
        if names:
            changed.append(f"{len(names)} {change}: {', '.join(names[:3])}{' ...' if len(names) > 3 else ''}")
    if not changed and before["portions"] != now["portions"]:
        changed.append("its tasks are cut otherwise")
    return changed


def _planned(text: str, place: Path, *, where: str) -> CampaignPlan:
    document = documents.parse(text, form="toml", where=where, error=CampaignError, hint=_HINT)
    if document.get("kind") != "campaign":
        raise CampaignError(f"kind is {document.get('kind')!r}, expected 'campaign'.", where=where, hint=_HINT)
    kind = _kind(document.get("of"), where=where)
    settings: CampaignSettings = documents.checked(document, kind.schema, where=where, error=CampaignError, hint=_HINT)
    if settings.count < 1 or (settings.batch is not None and settings.batch < 1):
        raise CampaignError("is less than one.", where=where, channel="count" if settings.count < 1 else "batch")
    files = {}
    try:
        for entry, name in kind.files(settings):
            if is_file(place / name):
                files[name] = (place / name).read_bytes()
            elif entry == "vehicle":
                vehicle_of(name)  # says what there is
            else:
                raise CampaignError(f"there is no file '{name}'.", channel=entry, hint=f"It is looked for in {place}.")
        parts = kind.parts(settings, place)
    except SwashError as error:  # as in a worker, where the file's name is not known
        raise CampaignError(error.problem, where=error.where or where, channel=error.channel, hint=error.hint) from None
    if sum(map(len, files.values())) > _LARGEST:
        raise CampaignError(
            f"its files have more than {_LARGEST >> 20} MiB, and every task takes them along.", where=where
        )
    as_stored = json.loads(json.dumps(msgspec.to_builtins(settings)))  # lists as a store gives them back
    tasks = made_tasks(str(document["of"]), matters(as_stored), parts, files=files, program=program())
    return CampaignPlan(text, str(document["of"]), as_stored, tasks)


def _kind(name: Any, *, where: str) -> CampaignKind:
    if not isinstance(name, str) or name not in CAMPAIGNS:
        raise CampaignError(
            f"is {name!r}, expected one of {', '.join(CAMPAIGNS)}.", where=where, channel="of", hint=_HINT
        )
    return CAMPAIGNS[name]


def matters(document: Mapping[str, Any]) -> dict[str, Any]:
    """What of a campaign's document a task's result depends on, beside its portion."""
    return {name: value for name, value in document.items() if name not in (*NO_RESULT, "seed")}


def _flat(document: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in document.items():
        if isinstance(value, Mapping) and value:
            flat |= _flat(value, f"{before}{name}.")
        elif name != "title":
            flat[before + name] = value
    return flat


def _measured(plan: CampaignPlan) -> CampaignPlan:
    """The plan with the time of its first task, done twice."""
    if not plan.tasks:
        return plan
    pool, seconds, size = ProcessPool(work, workers=1), [], 0
    try:
        for _ in range(2):
            began = time.perf_counter()
            outcome = pool.do(plan.tasks[0])
            if outcome.columns is None:
                raise CampaignError(f"its first task cannot be done: {outcome.error}", channel=plan.of)
            seconds.append(time.perf_counter() - began)
            size = sum(values.nbytes for values in outcome.columns.values())
    finally:
        pool.close()
    return replace(plan, first_seconds=seconds[0], task_seconds=seconds[1], task_bytes=size)
