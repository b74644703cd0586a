"""Tasks of a campaign: what one computes, and its name, the SHA-256 of everything that its result depends on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from numpy.typing import NDArray

from swashplate.errors import CampaignError

MOST_TASKS = 100_000
"""Of a campaign: each is a file, and all are named before the first begins."""

Columns = dict[str, NDArray[Any]]
"""A table by column: numbers or texts, all of the same length."""


@dataclass(frozen=True)
class Portion:
    """What one task computes of a campaign.

    Attributes:
        first, count: its rows: `first`, `first + 1`, ...
        seed: of everything in it that is drawn.
        of: what else it is about: a log's path, a cell of a grid.
        digest: SHA-256 of the file behind `of`; "" where there is none.
    """

    first: int
    count: int
    seed: int
    of: str = ""
    digest: str = ""


@dataclass(frozen=True)
class CampaignTask:
    """One task, whole: a worker on another machine needs nothing else.

    Attributes:
        kind: of the campaign, a name of the registry.
        settings: what the campaign's file says, as far as a result depends on it.
        portion: which part of it this task is.
        program: of which versions the result is (`program`).
        files: content of the files that the settings name, by that name.
        name: SHA-256 of all of these.
    """

    kind: str
    settings: Mapping[str, Any]
    portion: Portion
    program: Mapping[str, str]
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    name: str = ""


def portions(*, count: int, batch: int, seed: int) -> tuple[Portion, ...]:
    """Rows 0 to `count` in tasks of `batch` each, the last one what is left.

    Every task has a seed of its own, by SHA-256 from the campaign's seed and its first row: 48 bits, so that seeds that
    are counted up from it (each aircraft's sensors) meet those of no other task. A campaign that is made longer keeps
    the tasks that it had, but for a last one that was shorter.

    Raises:
        CampaignError: for more than `MOST_TASKS`.
    """
    if count > MOST_TASKS * max(batch, 1):
        raise CampaignError(
            f"{count:,} rows in tasks of {batch:,} are more than {MOST_TASKS:,} tasks.",
            channel="count",
            hint="Give fewer rows, or more of them in a task ('batch').",
        )
    return tuple(
        Portion(first, min(batch, count - first), seed_of(seed, first)) for first in range(0, count, max(batch, 1))
    )


def seed_of(seed: int, number: int) -> int:
    """The seed of the rows from `number` on."""
    return int.from_bytes(hashlib.sha256(f"{seed}:{number}".encode()).digest()[:6])


def made_tasks(
    kind: str,
    settings: Mapping[str, Any],
    parts: tuple[Portion, ...],
    *,
    files: Mapping[str, bytes],
    program: Mapping[str, str],
) -> tuple[CampaignTask, ...]:
    """Tasks with their names; two of the same inputs have the same name, wherever and whenever they were made."""
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in sorted(files.items())}
    shared = {"kind": kind, "settings": settings, "files": digests, "program": program}
    return tuple(
        CampaignTask(kind, settings, part, program, files, name=digest_of(shared | {"portion": asdict(part)}))
        for part in parts
    )


def digest_of(document: Mapping[str, Any]) -> str:
    """SHA-256 of a document, the same for the same content in any order."""
    return hashlib.sha256(json.dumps(document, sort_keys=True, ensure_ascii=True).encode()).hexdigest()
