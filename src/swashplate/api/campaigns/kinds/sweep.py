"""Campaigns over design choices: the same rows of another kind for each combination of some entries of its file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from swashplate.api.campaigns.kind import (
    CAMPAIGNS,
    CampaignFindings,
    CampaignKind,
    CampaignSettings,
    ChoiceCurve,
    NamedFile,
    settings_of,
)
from swashplate.api.campaigns.shares import quantile, share_interval
from swashplate.api.campaigns.tasks import Columns, Portion
from swashplate.errors import CampaignError

_UNITS = {"delay": "s", "payload": "kg", "indoor": "m/s", "outdoor": "m/s", "rate": "Hz", "computation": "s"}
"""Of entries with numbers, by their last word."""


class SweepCampaign(CampaignSettings, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file of a campaign over choices.

    Attributes:
        count: rows of each choice. batch, seed: of each; all choices have the same seeds, so that they meet the same
            draws.
        campaign: what it is of for one choice ("monte-carlo").
        each: what that campaign's file would say beside `count`, `batch` and `seed`.
        over: values to try by entry of `each`, with points for tables in it ("design.rate"). All combinations are done.
    """

    campaign: str
    each: dict[str, Any] = msgspec.field(default_factory=dict)
    over: dict[str, list[Any]] = msgspec.field(default_factory=dict)


class SweepKind:
    """See `CampaignKind`."""

    rows = "row"
    schema = SweepCampaign

    def files(self, settings: SweepCampaign) -> Sequence[NamedFile]:
        by_text: dict[str, NamedFile] = {}
        for choice in choices(settings):
            kind, inner = _inner(settings, choice)
            by_text |= {file.text: file._replace(entry=f"each.{file.entry}") for file in kind.files(inner)}
        return tuple(by_text.values())

    def parts(self, settings: SweepCampaign, folder: Path) -> tuple[Portion, ...]:
        if not settings.over or not all(settings.over.values()):
            raise CampaignError("expected one entry or more, each with a list of values.", channel="over")
        for name in settings.over:
            if not any(fnmatchcase(name, pattern) for pattern in settings.keep):
                raise CampaignError(f"leaves out '{name}', by which rows are told apart.", channel="keep")
        made: list[Portion] = []
        for choice in choices(settings):
            kind, inner = _inner(settings, choice)
            before = made[-1].first + made[-1].count if made else 0
            for part in kind.parts(inner, folder):
                if part.of:
                    raise CampaignError(f"a campaign of {settings.campaign} has rows of its own.", channel="campaign")
                told = json.dumps({"choice": choice, "row": part.first}, sort_keys=True)
                made.append(Portion(before + part.first, part.count, part.seed, told))
        return tuple(made)

    def run(self, settings: SweepCampaign, portion: Portion, files: Mapping[str, Path]) -> Columns:
        choice, part = _told(portion)
        kind, inner = _inner(settings, choice)
        chosen = {name: np.full(portion.count, _plain(value)) for name, value in choice.items()}
        return chosen | kind.run(inner, part, files)

    def replay(self, settings: SweepCampaign, portion: Portion, files: Mapping[str, Path], row: int) -> Any:
        choice, part = _told(portion)
        kind, inner = _inner(settings, choice)
        return kind.replay(inner, part, files, row)

    def findings(self, settings: SweepCampaign, table: Columns) -> CampaignFindings:
        names = tuple(settings.over)
        if not set(names) <= table.keys():
            return CampaignFindings((), {})
        cells, careful, shares, parts = [], [], [], []
        for choice in choices(settings):
            here = np.logical_and.reduce([table[name] == _plain(choice[name]) for name in names])
            if not here.any():
                continue
            kind, inner = _inner(settings, choice)
            rows = {name: values[here] for name, values in table.items() if name not in names}
            findings = kind.findings(inner, rows | {"number": table["number"][here] - table["number"][here].min()})
            careful += [f"{words_of(choice)}: {words}" for words in findings.careful]
            parts.append(findings)
            middles = [_middle(rows[name], factor) for name, (_, factor) in findings.shown.items()]
            values = tuple(str(_plain(choice[name])) for name in names)
            told = (words.partition(" (")[0] for _, words, _ in findings.summary)
            cells.append((*values, str(int(here.sum())), *told, *middles))
            if findings.counted in rows:
                shares.append((choice, int(np.sum(rows[findings.counted] == 1)), int(here.sum())))
        if not parts:
            return CampaignFindings((), {})
        first = parts[0]
        shown = {name: told for name, told in first.shown.items() if name in table}
        labels = (label for label, _, _ in first.summary)
        head = (*names, "rows", *labels, *(f"{name} [{unit}]" if unit else name for name, (unit, _) in shown.items()))
        caption = "What each choice brings: the median, and from it to the 95 % quantile"
        summary = (("Choices", f"{len(parts)}: {', '.join(names)}", "plain"),)
        return CampaignFindings(
            summary, shown, worst=first.worst, again=first.again, tables=((caption, head, tuple(cells)),),
            careful=tuple(careful), counted=first.counted, curves=curves(shares, what=first.counted),
        )  # fmt: skip


def choices(settings: SweepCampaign) -> list[dict[str, Any]]:
    """All combinations, the last entry's values first."""
    return [dict(zip(settings.over, values, strict=True)) for values in product(*settings.over.values())]


def words_of(choice: dict[str, Any]) -> str:
    """A choice for a person."""
    return ", ".join(f"{name} = {_plain(value)}" for name, value in choice.items())


def curves(shares: Sequence[tuple[dict[str, Any], int, int]], *, what: str) -> tuple[ChoiceCurve, ...]:
    """Shares of rows over the entry with numbers that has the most values, a curve for each combination of the others.

    Args:
        shares: of each choice how many rows were counted, of how many.
        what: is counted.
    """
    if not shares:
        return ()
    tried = {name: {_plain(choice[name]) for choice, _, _ in shares} for name in shares[0][0]}
    numbers = [name for name, values in tried.items() if all(isinstance(value, float) for value in values)]
    along = max(numbers, key=lambda name: len(tried[name]), default="")
    if not along or len(tried[along]) < 2:
        return ()
    curve_points: dict[str, list[tuple[float, float, float, float]]] = {}
    for choice, count, of in sorted(shares, key=lambda share: float(share[0][along])):
        low, high = share_interval(count, of)
        others = words_of({name: value for name, value in choice.items() if name != along})
        curve_points.setdefault(others, []).append((choice[along], 100.0 * count / of, 100.0 * low, 100.0 * high))
    unit = _UNITS.get(along.rpartition(".")[2])
    along = f"{along} [{unit}]" if unit else along
    return tuple(ChoiceCurve(f"{what} [%]", along, name, tuple(points)) for name, points in curve_points.items())


def _inner(settings: SweepCampaign, choice: dict[str, Any]) -> tuple[CampaignKind, Any]:
    """The kind of a choice's campaign, and what its file would say.

    Raises:
        CampaignError: a kind that there is not, an entry that it does not know.
    """
    if settings.campaign == "sweep" or settings.campaign not in CAMPAIGNS:
        expected = ", ".join(name for name in CAMPAIGNS if name != "sweep")
        raise CampaignError(f"is {settings.campaign!r}, expected one of {expected}.", channel="campaign")
    said = json.loads(json.dumps(settings.each))
    for name, value in choice.items():
        *tables, last = name.split(".")
        place = said
        for table in tables:
            place = place.setdefault(table, {})
            if not isinstance(place, dict):
                raise CampaignError(f"there is no table for '{name}'.", channel="over")
        place[last] = value
    own = {"count": settings.count, "seed": settings.seed}
    own |= {} if settings.batch is None else {"batch": settings.batch}
    for name in ("kind", "of", *own, "keep"):
        if name in said:
            raise CampaignError(f"'{name}' belongs outside of 'each'.", channel=f"each.{name}")
    return CAMPAIGNS[settings.campaign], settings_of(settings.campaign, {**said, **own}, where="each")


def _told(portion: Portion) -> tuple[dict[str, Any], Portion]:
    """A portion's choice, and the same portion of that choice's own campaign."""
    told = json.loads(portion.of)
    return told["choice"], Portion(told["row"], portion.count, portion.seed)


def _plain(value: Any) -> float | str:
    """A value of a choice as a column has it."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return value if isinstance(value, str) else json.dumps(value, sort_keys=True)


def _middle(values: Any, factor: float) -> str:
    numbers = factor * np.asarray(values, dtype=np.float64)
    known = numbers[~np.isnan(numbers)]
    return f"{quantile(known, 0.5)[0]:.4g} to {quantile(known, 0.95)[0]:.4g}" if known.size else ""


SWEEP = SweepKind()
