"""What a campaign can be of: the protocol of a kind, what every campaign's file says, and the registry."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar, cast

import msgspec

from swashplate import documents
from swashplate.api.campaigns.tasks import Columns, Portion, portions
from swashplate.api.question import VerbQuestion, default_of, entries
from swashplate.errors import CampaignError
from swashplate.registry import Registry

Asked = TypeVar("Asked", bound=VerbQuestion[Any])


class CampaignSettings(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What every campaign's file says.

    Attributes:
        kind: "campaign". of: the kind of campaign. title: for a reader.
        count: how many rows there are to be: flights, fits.
        batch: rows per task; None for what the kind thinks lasts a second or more.
        seed: all others come from it.
        keep: columns that are kept, by name, `*` for any letters; the row's number and its task's seed always are.
    """

    kind: str
    of: str
    title: str = ""
    count: int = 100
    batch: int | None = None
    seed: int = 0
    keep: list[str] = msgspec.field(default_factory=lambda: ["*"])


class NamedFile(NamedTuple):
    """A file that a campaign's file names.

    Attributes:
        entry: where it stands there. text: what stands there.
        or_name: True where it may be the name of something packaged instead (a vehicle).
    """

    entry: str
    text: str
    or_name: bool = False


NO_RESULT = ("kind", "of", "title", "count", "batch", "over")
"""Entries that no task's result depends on: its portion says the rest."""


@dataclass(frozen=True)
class CampaignFindings:
    """What a campaign has found, as a kind tells it.

    Attributes:
        summary: lines as (label, words, tone).
        shown: columns whose distribution and quantiles are shown, with their units and the factor to them.
        worst: column by whose size rows are bad, the largest worst; "" where none is.
        tables: further ones: caption, headings, cells.
        careful: what a reader must see first.
        again: ending of the file that `replay` writes of a row.
    """

    summary: tuple[tuple[str, str, str], ...]
    shown: Mapping[str, tuple[str, float]]
    worst: str = ""
    tables: tuple[tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]], ...] = field(default=())
    careful: tuple[str, ...] = ()
    again: str = ".json"


class CampaignKind(Protocol):
    """One kind of campaign: a file with an object of this protocol, and a line in `CAMPAIGNS` (or an entry point of the
    group `swashplate.campaigns` in another package)."""

    @property
    def rows(self) -> str:
        """What a row is: "flight", "fit", "log"."""
        ...

    @property
    def schema(self) -> type[CampaignSettings]:
        """What its file says."""
        ...

    def files(self, settings: Any) -> Sequence[NamedFile]:
        """Files that every task needs."""
        ...

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        """Its tasks. `folder` is that of the campaign's file.

        Raises:
            SwashError: what in the file contradicts itself, said before anything is computed.
        """
        ...

    def run(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> Columns:
        """One task: the same columns for the same arguments, to the bit, on any worker.

        Args:
            settings: of the campaign's file.
            portion: which rows.
            files: where the content of `files` lies, by the entry's text.
        """
        ...

    def findings(self, settings: Any, table: Columns) -> CampaignFindings:
        """What the rows say, those that are there."""
        ...

    def replay(self, settings: Any, portion: Portion, files: Mapping[str, Path], row: int) -> Any:
        """What row `row` of a portion was, whole: something with a method `save(path)`."""
        ...


CAMPAIGNS: Registry[CampaignKind] = Registry(
    "campaigns",
    what="kind of campaign",
    own={
        "monte-carlo": "swashplate.api.campaigns.kinds.monte_carlo:MONTE_CARLO",
        "recovery": "swashplate.api.campaigns.kinds.recovery:RECOVERY",
        "multi-start": "swashplate.api.campaigns.kinds.multi_start:MULTI_START",
        "fleet": "swashplate.api.campaigns.kinds.fleet:FLEET",
    },
)
"""By the name that a campaign's file says as `of`."""


def in_batches(settings: CampaignSettings, *, usual: int) -> tuple[Portion, ...]:
    """The campaign's rows in tasks of `batch`, or of `usual` where the file says nothing."""
    return portions(count=settings.count, batch=settings.batch or usual, seed=settings.seed)


def schema_of(question: type[VerbQuestion[Any]]) -> type[CampaignSettings]:
    """What the file of a campaign says whose tasks ask a verb: the words of the verb."""
    words: list[Any] = []
    for name in entries(question):
        if name not in CampaignSettings.__struct_fields__:
            default = default_of(question, name)
            words.append((name, Any) if default is dataclasses.MISSING else (name, Any, default))
    made = msgspec.defstruct(
        f"{question.__name__}Campaign",
        words,
        bases=(CampaignSettings,),
        forbid_unknown_fields=True,
        kw_only=True,
        frozen=True,
    )
    return cast(type[CampaignSettings], made)


def question_of(settings: CampaignSettings, question: type[Asked], **instead: Any) -> Asked:
    """The question of a campaign's file, some of its fields from elsewhere."""
    own = {name: getattr(settings, name) for name in entries(question)}
    return question(**own | instead)


def settings_of(name: str, document: Mapping[str, Any], *, where: str = "") -> Any:
    """The document of a campaign of the kind `name`, held against the kind's schema.

    Raises:
        CampaignError: an entry that is missing, unknown or of another type.
    """
    whole = {"kind": "campaign", "of": name, **document}
    return documents.checked(whole, CAMPAIGNS[name].schema, where=where, error=CampaignError)
