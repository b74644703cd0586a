"""What a campaign can be of: the base of a kind, what every campaign's file says, and the registry."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, ClassVar, cast

import msgspec

from swashplate import documents
from swashplate.api.campaigns.tasks import Columns, Portion, portions
from swashplate.api.question import VerbQuestion, default_of, entries, fields_of
from swashplate.errors import CampaignError
from swashplate.flights.consistency import UNCHECKED
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read
from swashplate.models.catalogue import vehicle as find_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.registry import Registry


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


NO_RESULT = ("kind", "of", "title", "count", "batch")
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


class CampaignKind(ABC):
    """One kind of campaign: a file with an object of a subclass, and a line in `CAMPAIGNS` (or an entry point of the
    group `swashplate.campaigns` in another package). Its file has the words of a verb, and few of its own.

    Attributes:
        rows: what a row is: "flight", "fit", "log".
        question: of the verb. settings_type: what its file says beside.
        without: words of the verb that mean nothing here.
        own_files: of its own words those that name files.
    """

    rows: ClassVar[str]
    question: ClassVar[type[VerbQuestion[Any]]]
    settings_type: ClassVar[type[CampaignSettings]] = CampaignSettings
    without: ClassVar[tuple[str, ...]] = ()
    own_files: ClassVar[tuple[str, ...]] = ()

    @cached_property
    def schema(self) -> type[CampaignSettings]:
        """What its file says."""
        verb_fields: list[Any] = []
        for name in entries(self.question):
            if name not in (*self.settings_type.__struct_fields__, *self.without):
                default = default_of(self.question, name)
                verb_fields.append((name, Any) if default is dataclasses.MISSING else (name, Any, default))
        name, how = f"{self.question.__name__}Campaign", {"kw_only": True, "frozen": True}
        struct = msgspec.defstruct(name, verb_fields, bases=(self.settings_type,), forbid_unknown_fields=True, **how)  # type: ignore[arg-type]
        return cast(type[CampaignSettings], struct)

    def files(self, settings: Any) -> Iterator[tuple[str, str]]:
        """Files that every task needs: where each stands, and what stands there."""
        for name in (*(n for n in _file_words(self.question) if n not in self.without), *self.own_files):
            given = getattr(settings, name)
            for text in () if given is None else given if isinstance(given, list | tuple) else (given,):
                yield name, str(text)

    def asked(self, settings: Any, files: Mapping[str, Path], **instead: Any) -> Any:
        """The question of a campaign's file, its files where they lie here, some of its fields from elsewhere."""
        values = {name: getattr(settings, name) for name in entries(self.question) if name not in self.without}
        for name in _file_words(self.question) & values.keys():
            given = values[name]
            several = isinstance(given, list | tuple)
            values[name] = tuple(files.get(one, one) for one in given) if several else files.get(given, given)
        return self.question(**values | instead)

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        """Its tasks: rows in tasks of `batch`. `folder` is that of the campaign's file.

        Raises:
            SwashError: what in the file contradicts itself, said before anything is computed.
        """
        self.asked(settings, {})
        return portions(count=settings.count, batch=settings.batch or self.usual_batch, seed=settings.seed)

    usual_batch: ClassVar[int] = 1
    """Rows of a task, where the file does not say."""

    @abstractmethod
    def run(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> Columns:
        """One task: the same columns for the same arguments, to the bit, on any worker.

        Args:
            settings: of the campaign's file.
            portion: which rows.
            files: where the content of `files` lies, by the entry's text.
        """

    @abstractmethod
    def findings(self, settings: Any, table: Columns) -> CampaignFindings:
        """What the rows say, those that are there."""

    @abstractmethod
    def replay(self, settings: Any, portion: Portion, files: Mapping[str, Path], row: int) -> Any:
        """What row `row` of a portion was, whole: something with a method `save(path)`."""


_FILES = ("Aircraft", "Logs", "Pilot", "Fitted", "Path")
"""Languages whose words name files."""


def _file_words(question: type[VerbQuestion[Any]]) -> dict[str, None]:
    return {f.name: None for f in fields_of(question) if str(f.type).removesuffix(" | None") in _FILES}


def logged(asked: Any, path: Path) -> Flight:
    """A log as a question says that it is read; a mapping that this machine has kept is not asked, as on no worker."""
    stamps = "drop" if asked.drop_bad_stamps else "error"
    flight = read(path, mapping=asked.mapping, units=asked.units, bad_stamps=stamps)
    return flight.done(UNCHECKED) if asked.as_logged else flight


@lru_cache(maxsize=4)
def vehicle_of(name_or_file: str) -> Vehicle:
    """A vehicle, read once in a worker's life."""
    return find_vehicle(name_or_file)


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


def settings_of(name: str, document: Mapping[str, Any], *, where: str = "") -> Any:
    """The document of a campaign of the kind `name`, held against the kind's schema.

    Raises:
        CampaignError: an entry that is missing, unknown or of another type.
    """
    complete = {"kind": "campaign", "of": name, **document}
    return documents.checked(complete, CAMPAIGNS[name].schema, where=where, error=CampaignError)
