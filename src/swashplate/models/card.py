"""Parameter cards: every number of a vehicle with its unit, source and status, in a readable TOML file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from swashplate import documents
from swashplate.errors import CardError
from swashplate.meant import taking_names
from swashplate.registry import nearest

CARD_SCHEMA = 1
_HINT = "A card is a TOML file; `swash vehicle new` writes one, and logs are --flight."
STATUSES = ("measured", "published", "identified", "derived", "assumed")
_TABLES = {
    "kind",
    "schema",
    "vehicle",
    "title",
    "trust",
    "fastest",
    "options",
    "parameters",
    "observer",
    "correlations",
}
_NUMBERS = ("value", "sigma", "lower", "upper", "before")
_FIELDS = {*_NUMBERS, "unit", "source", "status", "note"}


@dataclass(frozen=True)
class Parameter:
    """One number of a card.

    Attributes:
        value: the number, in `unit`.
        unit: SI unit, "1" where there is none.
        source: paper, table and equation, or "derived: ...".
        status: measured, published, identified, derived or assumed.
        sigma: standard deviation, where known.
        lower, upper: what physics allows, where known.
        note: anything a reader must know.
        before: the value on the card that an identification started from, where it moved this one.
    """

    value: float
    unit: str
    source: str
    status: str
    sigma: float | None = None
    lower: float | None = None
    upper: float | None = None
    note: str = ""
    before: float | None = None


@dataclass(frozen=True)
class Card:
    """A vehicle's numbers and what may be believed of them.

    Attributes:
        vehicle: which equations they are for ("coax").
        title: what this aircraft is.
        trust: where the card may be trusted, and where not.
        fastest: air speed [m/s] up to which it may be; None where nobody knows.
        options: the switches of the equations.
        parameters: the numbers by name.
        observer: what an identification learnt beside the parameters (noise, delays), by section.
        correlations: of the parameters' uncertainties, by two names; what is not there is zero.
        path: the file it came from.
    """

    vehicle: str
    title: str
    trust: str
    options: Mapping[str, Any]
    parameters: Mapping[str, Parameter]
    observer: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    correlations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    path: str = ""
    fastest: float | None = None

    @property
    def where(self) -> str:
        """Its file, or the name of its equations where it has none: what messages about it begin with."""
        return self.path or self.vehicle

    @property
    def called(self) -> str:
        """What people call it: a packaged card's name, or its file; the name of its equations where it has none."""
        return self.path.removesuffix(".toml") or self.vehicle

    def values(self) -> dict[str, float]:
        return {name: parameter.value for name, parameter in self.parameters.items()}

    def with_values(self, values: Mapping[str, float], **changes: Any) -> Card:
        """A copy with other numbers; `changes` go to each changed `Parameter` (status, source, ...).

        Correlations of what changes are dropped: they were those of the old numbers. What becomes "identified" keeps
        the number that it had as `before`, if nothing else is said of that.
        """
        unknown = sorted(set(values) - set(self.parameters))
        if unknown:
            asked = nearest(unknown[0], self.parameters)
            raise CardError(f"has no parameter {', '.join(unknown)}.", where=self.where, hint=asked or None)
        changed = {}
        for name, value in values.items():
            old = self.parameters[name]
            known: dict[str, Any] = {"before": old.value} if changes.get("status") == "identified" else {}
            changed[name] = replace(old, value=float(value), **{**known, **changes})
        correlations = {
            first: {second: value for second, value in row.items() if second not in values}
            for first, row in self.correlations.items()
            if first not in values
        }
        return replace(
            self,
            parameters={**self.parameters, **changed},
            correlations={first: row for first, row in correlations.items() if row},
        )

    def started_from(self) -> Card | None:
        """The card that an identification started from, or None for one that was never identified."""
        before = {name: entry.before for name, entry in self.parameters.items() if entry.before is not None}
        if not before:
            return None
        card = self.with_values(before, source="before the identification", status="assumed", sigma=None, before=None)
        return replace(card, title=self.title.split(", identified from ")[0], observer={}, path="")

    @taking_names
    def covariance(self, names: Sequence[str]) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Covariance of parameters that have a sigma, shape (n, n), from the sigmas and the correlations."""
        matrix = np.eye(len(names))
        for i, first in enumerate(names):
            for j, second in enumerate(names):
                if i != j:
                    row, turned = self.correlations.get(first, {}), self.correlations.get(second, {})
                    matrix[i, j] = row.get(second, turned.get(first, 0.0))
        sigma = np.array([self.parameters[name].sigma or 0.0 for name in names], dtype=np.float64)
        return np.asarray(matrix * np.outer(sigma, sigma))

    def checked_against(self, units: Mapping[str, str]) -> Card:
        """The card itself, if it has exactly the parameters in `units`, each in its unit and within its bounds.

        Raises:
            CardError: naming the first parameter that is missing, unknown, in another unit or impossible.
        """
        where = self.where
        for name in units:
            if name not in self.parameters:
                raise CardError(
                    "is missing.",
                    where=where,
                    channel=name,
                    hint=f'Add [parameters.{name}] with value, unit = "{units[name]}", source and status.',
                )
        for name, parameter in self.parameters.items():
            if name not in units:
                raise CardError(
                    f"is not a parameter of '{self.vehicle}'.", where=where, channel=name, hint="Is it misspelt?"
                )
            if parameter.unit != units[name]:
                raise CardError(
                    f"unit is '{parameter.unit}', expected '{units[name]}'.",
                    where=where,
                    channel=name,
                    hint="Convert the value, and its sigma and bounds with it.",
                )
            low, high = parameter.lower, parameter.upper
            if (low is not None and parameter.value < low) or (high is not None and parameter.value > high):
                unit = "" if parameter.unit == "1" else f" {parameter.unit}"
                raise CardError(
                    f"{parameter.value:g}{unit} lies outside the card's bounds for it, {_span(low, high, unit)}.",
                    where=where,
                    channel=name,
                    hint="Correct the value, or its lower and upper.",
                )
        return self

    def to_toml(self) -> str:
        """The card as the text of a TOML file."""
        return tomli_w.dumps(self.to_document())

    def to_document(self) -> dict[str, object]:
        """What its file says."""
        parameters = {
            name: {
                key: value
                for key, value in vars(parameter).items()
                if value is not None and not (key == "note" and not value)
            }
            for name, parameter in self.parameters.items()
        }
        document: dict[str, Any] = {
            "kind": "vehicle",
            "schema": CARD_SCHEMA,
            "vehicle": self.vehicle,
            "title": self.title,
            "trust": self.trust,
            **({} if self.fastest is None else {"fastest": self.fastest}),
            "options": dict(self.options),
            "parameters": parameters,
        }
        if self.observer:
            document["observer"] = {section: dict(numbers) for section, numbers in self.observer.items()}
        if self.correlations:
            document["correlations"] = {first: dict(row) for first, row in self.correlations.items()}
        return document


def parse_card(text: str, *, path: str = "") -> Card:
    """A card from the text of its file.

    Raises:
        CardError: where it is not TOML, not a vehicle card, or an entry is incomplete.
    """
    return card_from(documents.parse(text, form="toml", where=path, error=CardError, hint=_HINT), path=path)


def card_from(document: Mapping[str, Any], *, path: str = "") -> Card:
    """A card from the document of its file.

    Raises:
        CardError: where it is not that of a vehicle card, or an entry is incomplete.
    """
    if document.get("kind") != "vehicle":
        linear = "A linear model, not a card: `swashplate.vehicle` takes it."
        hint = "A card begins with the line kind = 'vehicle'; `swash vehicle new` writes one."
        raise CardError(
            f"kind is {document.get('kind')!r}, expected 'vehicle'." if "kind" in document else "says no kind.",
            where=path,
            hint=linear if document.get("kind") == "state-space" else hint,
        )
    schema = document.get("schema", 0)
    if not isinstance(schema, int) or schema > CARD_SCHEMA:
        raise CardError(
            f"schema is {schema!r}, expected a whole number up to {CARD_SCHEMA}.", where=path, hint="Update swashplate."
        )
    for table in ("options", "observer"):
        if not isinstance(document.get(table, {}), dict):
            raise CardError("is not a table.", where=path, channel=table)
    missing = sorted({"vehicle", "title", "parameters"} - document.keys())
    if missing or not isinstance(document["parameters"], dict):
        raise CardError(f"lacks {', '.join(missing) or 'a table of parameters'}.", where=path)
    unknown = sorted(document.keys() - _TABLES)
    if unknown:
        raise CardError(
            f"is no part of a card; there are {', '.join(sorted(_TABLES))}.",
            where=path,
            channel=", ".join(unknown),
            hint="Is it misspelt?",
        )
    fastest = document.get("fastest")
    if fastest is not None and (isinstance(fastest, bool) or not isinstance(fastest, int | float) or not fastest > 0.0):
        raise CardError(f"is {fastest!r}, expected a speed in m/s.", where=path, channel="fastest")
    parameters = {name: _parameter(name, entry, path) for name, entry in document["parameters"].items()}
    return Card(
        vehicle=str(document["vehicle"]),
        title=str(document["title"]),
        trust=str(document.get("trust", "")),
        options=document.get("options", {}),
        parameters=parameters,
        observer=document.get("observer", {}),
        correlations=_correlations(document.get("correlations", {}), parameters, path),
        path=path,
        fastest=None if fastest is None else float(fastest),
    )


def _parameter(name: str, entry: Any, path: str) -> Parameter:
    if not isinstance(entry, dict):
        raise CardError("is not a table with value, unit, source and status.", where=path, channel=name)
    missing = sorted({"value", "unit", "source", "status"} - entry.keys())
    unknown = sorted(entry.keys() - _FIELDS)
    if missing or unknown:
        faults = [f"lacks {', '.join(missing)}"] * bool(missing) + [f"has unknown {', '.join(unknown)}"] * bool(unknown)
        raise CardError(
            f"{' and '.join(faults)}.",
            where=path,
            channel=name,
            hint="It needs value, unit, source and status, and may have sigma, lower, upper and note.",
        )
    for key in _NUMBERS:
        if key in entry and (isinstance(entry[key], bool) or not isinstance(entry[key], int | float)):
            raise CardError(f"{key} is {entry[key]!r}, expected a number.", where=path, channel=name)
    if not float("-inf") < float(entry["value"]) < float("inf"):
        raise CardError(f"value is {entry['value']}, expected a finite number.", where=path, channel=name)
    if "sigma" in entry and not 0.0 <= float(entry["sigma"]) < float("inf"):
        raise CardError(f"sigma is {entry['sigma']}, expected 0 or more, and finite.", where=path, channel=name)
    if not float(entry.get("lower", "-inf")) <= float(entry.get("upper", "inf")):
        raise CardError(
            f"lower {entry.get('lower')} and upper {entry.get('upper')} leave nothing between them.",
            where=path,
            channel=name,
        )
    if entry["status"] not in STATUSES:
        raise CardError(
            f"status is {entry['status']!r}, expected one of {', '.join(STATUSES)}.", where=path, channel=name
        )
    numbers = {key: float(entry[key]) for key in _NUMBERS if key in entry}
    texts = {key: str(entry[key]) for key in ("unit", "source", "status", "note") if key in entry}
    return Parameter(**numbers, **texts)  # pyrefly: ignore[bad-argument-type]


def _correlations(entry: Any, parameters: Mapping[str, Parameter], path: str) -> dict[str, dict[str, float]]:
    """The table [correlations], checked: two known parameters with a sigma each, a number between -1 and 1."""
    if not isinstance(entry, dict) or not all(isinstance(row, dict) for row in entry.values()):
        raise CardError("is not a table of tables.", where=path, channel="correlations")
    for first, row in entry.items():
        for second, value in row.items():
            known = all(name in parameters and parameters[name].sigma is not None for name in (first, second))
            number = isinstance(value, int | float) and not isinstance(value, bool) and -1.0 <= value <= 1.0
            if not known or not number or first == second:
                raise CardError(
                    f"{first}, {second} = {value!r}: expected two parameters with a sigma and a number in -1 to 1.",
                    where=path,
                    channel="correlations",
                )
    return {first: {second: float(value) for second, value in row.items()} for first, row in entry.items()}


def no_option(name: str, known: Iterable[str], *, where: str) -> CardError:
    """The error of a card that has an option which its vehicle does not have."""
    names = tuple(known)
    hint = f"{nearest(name, names)} Options are {', '.join(names)}.".strip()
    return CardError("is not an option.", where=where, channel=name, hint=hint)


def _span(low: float | None, high: float | None, unit: str) -> str:
    """Bounds as people write them, of which one may be missing."""
    if low is None or high is None:
        return f"at most {high:g}{unit}" if low is None else f"at least {low:g}{unit}"
    return f"{low:g} to {high:g}{unit}"


def read_card(path: str | Path) -> Card:
    """A card from a file."""
    return parse_card(documents.read_text(path, form="toml", error=CardError, hint=_HINT), path=str(path))


def packaged_cards() -> dict[str, Card]:
    """The cards that come with swashplate, by name."""
    return {name: packaged_card(name) for name in packaged_names()}


@lru_cache(maxsize=1)
def packaged_names() -> tuple[str, ...]:
    """Names of the cards that come with swashplate."""
    return tuple(sorted(file.name.removesuffix(".toml") for file in _DATA.iterdir() if file.name.endswith(".toml")))


@lru_cache(maxsize=32)
def packaged_card(name: str) -> Card:
    """One of them, parsed once: a card does not change."""
    file = _DATA / f"{name}.toml"
    return parse_card(file.read_text(encoding="utf-8"), path=file.name)


_DATA = resources.files("swashplate.models") / "data"
