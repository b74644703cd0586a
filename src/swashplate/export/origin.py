"""What an export was made from, in lines that every format carries: commit, card, data."""

from __future__ import annotations

import hashlib
from collections import Counter

from swashplate.commit import commit
from swashplate.export.linear import Linear
from swashplate.extras import version_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

_IDENTIFIED = "identified by "


def origin_of(model: Vehicle | StateSpaceModel | Linear) -> tuple[str, ...]:
    """The program with its commit, card (or matrices) with digits of its SHA-256, the flights behind its numbers."""
    program = f"Made by {program_and_commit()}."
    if isinstance(model, Vehicle) and model.structure is None:
        return (program, f"Card {card_digest(model)} of {model.name}: {model.card.title}.", _data(model))
    given = model.structure if isinstance(model, Vehicle) else model
    if isinstance(given, StateSpaceModel):
        content = repr((sorted(given.numbers().items()), sorted(map(repr, given.elements))))
        fitted = sum(parameter.cramer_rao == parameter.cramer_rao for parameter in given.parameters.values())
        data = f"Data: {fitted} of {len(given.parameters)} numbers are fitted, the file does not say to what."
        return (program, f"Model file {digest(content)}: {given.title}.", data if fitted else "Data: none was fitted.")
    assert isinstance(given, Linear)
    if given.origin:
        return given.origin
    content = repr([getattr(given, name).tolist() for name in "ABCD"])
    return (program, f"Matrices {digest(content)}: {given.title}.", "Data: the matrices' own file says nothing.")


def card_digest(model: Vehicle) -> str:
    """Twelve digits of the SHA-256 of a card's numbers and options, by which exports of one model are known."""
    return digest(repr((sorted(model.card.values().items()), sorted(map(repr, dict(model.card.options).items())))))


def program_and_commit() -> str:
    """What made an export."""
    at = commit()
    return f"swashplate {version_of('swashplate')}{f', commit {at}' if at else ''}"


def digest(content: str) -> str:
    """The first twelve digits of a text's SHA-256."""
    return hashlib.sha256(content.encode()).hexdigest()[:12]


def _data(model: Vehicle) -> str:
    numbers = model.card.parameters.values()
    flights = sorted({one.source.removeprefix(_IDENTIFIED) for one in numbers if one.status == "identified"})
    counts = ", ".join(f"{count} {status}" for status, count in sorted(Counter(one.status for one in numbers).items()))
    return f"Data: {'; '.join(flights) if flights else 'no flight'} ({counts})."
