"""What a worker does with a task: find its kind, put its files down, compute, keep what is to be kept."""

from __future__ import annotations

import atexit
import hashlib
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.api.campaigns.kind import CAMPAIGNS, CampaignKind, settings_of
from swashplate.api.campaigns.tasks import CampaignTask, Columns
from swashplate.atomic import scratch_folder
from swashplate.errors import CampaignError

ALWAYS = ("number", "seed")
"""Columns that no campaign leaves out: which row, and the seed of its task."""


def work(task: CampaignTask) -> Columns:
    """A task's columns, the row's number and the task's seed first.

    Raises:
        SwashError: whatever its kind cannot compute.
    """
    kind, settings, files = opened(task)
    portion = task.portion
    columns = kind.run(settings, portion, files)
    count = {len(values) for values in columns.values()}
    if count != {portion.count}:
        raise CampaignError(f"gave columns of {sorted(count)} rows, expected {portion.count}.", channel=task.kind)
    kept = chosen(tuple(columns), settings.keep)
    row_columns = {
        "number": np.arange(portion.first, portion.first + portion.count),
        "seed": np.full(portion.count, portion.seed, dtype=np.int64),
    }
    return row_columns | {name: columns[name] for name in kept}


def replay(task: CampaignTask, row: int) -> Any:
    """What row `row` of a task was, whole."""
    kind, settings, files = opened(task)
    return kind.replay(settings, task.portion, files, row)


def opened(task: CampaignTask) -> tuple[CampaignKind, Any, Mapping[str, Path]]:
    """A task's kind, its settings as the kind reads them, and where its files lie on this machine."""
    kind = CAMPAIGNS[task.kind]
    return kind, settings_of(task.kind, task.settings), {n: _put(n, c) for n, c in task.files.items()}


def chosen(columns: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """Columns that one of the patterns names.

    Raises:
        CampaignError: for a pattern that names none.
    """
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in columns):
            raise CampaignError(f"'{pattern}' is none of {', '.join(columns)}.", channel="keep")
    return [name for name in columns if any(fnmatchcase(name, pattern) for pattern in patterns)]


@lru_cache(maxsize=1)
def _home() -> Path:
    kept = ExitStack()
    atexit.register(kept.close)
    return kept.enter_context(scratch_folder())


def _put(name: str, content: bytes) -> Path:
    """A file of a task on this machine, under its own last name; written once."""
    path = _home() / hashlib.sha256(name.encode() + b"\0" + content).hexdigest()[:16] / Path(name).name
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return path
