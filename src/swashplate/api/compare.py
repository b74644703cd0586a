"""Several responses, models or fits side by side, or models along a flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.api.asking import strings
from swashplate.errors import SwashError
from swashplate.identification.core.result import Result
from swashplate.identification.core.result_file import load
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.answering import LinearResponse
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.case_parts import (
    CaseParts,
    compare_answers,
    compare_estimates,
    compare_modes,
    compare_responses,
)
from swashplate.reporting.structure import Block, Points, Report, Section
from swashplate.shown import Shown
from swashplate.text_table import text_table
from swashplate.validation.along_inputs import ModelComparison, along_flights, fitted

if TYPE_CHECKING:
    from swashplate.api.verbs.validate import Compare


@dataclass(frozen=True, repr=False)
class CaseComparison(Shown):
    """Cases side by side, each against the first.

    Attributes:
        what: "responses", "models" or "results".
        names: of the cases, in their order.
        parts: tables, figures, remarks and numbers.
    """

    what: str
    names: tuple[str, ...]
    parts: CaseParts

    def to_document(self) -> dict[str, object]:
        """The numbers as JSON types."""
        told = {"remarks": list(self.parts.told)}
        return {"what": self.what, "cases": list(self.names), **_plain(self.parts.document), **told}

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        blocks: tuple[Block, ...] = (*self.parts.tables, *self.parts.figures)
        remarks = (Section("remarks", "What to know", (Points(self.parts.told),)),) if self.parts.told else ()
        return Report(
            title=title or f"{self.what.capitalize()} of {len(self.names)} cases",
            banners=(),
            summary=(("Cases", ", ".join(self.names), "plain"), ("Against", self.names[0], "plain")),
            picture=None,
            sections=(*remarks, Section("cases", "Side by side", blocks)),
        )

    def __repr__(self) -> str:
        parts = []
        for table in self.parts.tables:
            words = [k for k in range(len(table.columns)) if not any(row[k].number for row in table.rows)]
            body = text_table(table.columns, [[cell.words for cell in row] for row in table.rows], left=words)
            parts.append("\n".join([table.caption, body, *([table.note] if table.note else [])]))
        return "\n\n".join([*parts, *(["\n".join(f"! {text}" for text in self.parts.told)] if self.parts.told else [])])


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value


def compare_cases(asked: Compare) -> ModelComparison | CaseComparison:
    """The comparison that was asked for."""
    named, outputs = _named(asked.cases), strings(asked.outputs) or None
    flights = None if asked.flight is None else asked.conditioned(asked.flight)
    if flights is not None:
        return along_flights(named, flights, outputs=outputs)
    if outputs is not None:
        raise SwashError("are of models along flights.", channel="outputs", hint="Give flights too.")
    if len(named) < 2:
        raise SwashError(f"{len(named)} given, expected two or more.", channel="cases")
    of = [isinstance(one, FrequencyResponse) for one in named.values()]
    if any(of) and not all(of):
        responses = ", ".join(name for name, one in zip(named, of, strict=True) if one)
        raise SwashError(f"responses ({responses}) stand beside what is none.", channel="cases")
    if all(of):
        return CaseComparison("responses", tuple(named), compare_responses(named))
    parts = CaseParts()
    results = all(isinstance(one, Result) for one in named.values())
    if results:
        parts = compare_estimates(named)
    return CaseComparison("results" if results else "models", tuple(named), parts + _of_models(named))


def _of_models(named: Mapping[str, Any]) -> CaseParts:
    """Modes and responses of what can be linearised; of what cannot, why."""
    models: dict[str, LinearResponse] = {}
    told = []
    for name, one in named.items():
        try:
            models[name] = _linear(one)
        except SwashError as error:
            told.append(f"{name} has no modes here: {error}")
    if len(models) < 2:
        return CaseParts(told=tuple(told))
    return compare_modes(models) + compare_answers(models) + CaseParts(told=tuple(told))


def _linear(one: Any) -> LinearResponse:
    made = one.model if isinstance(one, Result) else one
    made = made.as_linear() if isinstance(made, Vehicle) else made
    if isinstance(made, LinearResponse):
        return made
    raise SwashError(f"is a {type(made).__name__}, expected responses, fits or models.", channel="cases")


# ---- names and files ---------------------------------------------------------------------------------------------
_FILES = ("responses.nc", "fit.json", "model.toml")


def _named(cases: Any) -> dict[str, Any]:
    """Cases by name; files are read."""
    if isinstance(cases, Mapping):
        return {name: _read(one) for name, one in cases.items()}
    given = list(cases) if isinstance(cases, list | tuple) else [cases]
    paths = [Path(one) if isinstance(one, str | Path) else None for one in given]
    names = [_called(one, path, paths, k) for k, (one, path) in enumerate(zip(given, paths, strict=True))]
    twice = {name for name in names if names.count(name) > 1}
    names = [f"{name} {k + 1}" if name in twice else name for k, name in enumerate(names)]
    return {name: _read(one) for name, one in zip(names, given, strict=True)}


def _called(one: Any, path: Path | None, paths: Sequence[Path | None], k: int) -> str:
    """A file by its name, with its folder where others have the same; anything else by its own."""
    if isinstance(one, Vehicle):
        return one.card.called if one.structure is None else one.structure.name
    if path is None:
        return str(getattr(fitted(one), "name", "") or f"case {k + 1}")
    alike = sum(other is not None and other.name == path.name for other in paths)
    return "/".join(path.parts[-2:]) if alike > 1 else path.name


def _read(one: Any) -> Any:
    if not isinstance(one, str | Path):
        return fitted(one)
    path = Path(one)
    if path.is_dir():
        file = next((path / name for name in _FILES if (path / name).is_file()), None)
        if file is None:
            raise SwashError(f"has none of {', '.join(_FILES)} in it.", where=path)
        path = file
    if path.suffix == ".nc":
        return FrequencyResponse.load(path)
    if path.suffix == ".json":
        return load(path)
    return vehicle(path)
