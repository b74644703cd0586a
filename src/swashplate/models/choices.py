"""What an identification may move of a model: one parameter, and ready sets of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from swashplate.models.card import Card


@dataclass(frozen=True)
class Free:
    """One parameter that an identification may move.

    Attributes:
        name: its name on the card.
        scale: a change of the order that matters, in the parameter's unit.
        mean, sigma: prior (None: the data alone decides), in the parameter's unit.
        start: first guess (None: the card's value).
        source: where the prior comes from.
    """

    name: str
    scale: float
    mean: float | None = None
    sigma: float | None = None
    start: float | None = None
    source: str = ""


@dataclass(frozen=True)
class Choice:
    """A ready set of free parameters and ties.

    Attributes:
        name: what the user calls it.
        description: what it is for.
        free: the parameters to move.
        ties: "name = expression" each.
        fixed: values that the choice sets for the equations' switches.
    """

    name: str
    description: str
    free: tuple[Free, ...]
    ties: tuple[str, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class PhysicalEffect:
    """A part of a model's physics that its numbers can leave out: what a report asks the flights about.

    Attributes:
        name: in words.
        without: the parameters that make it, and the values at which it is not there.
    """

    name: str
    without: Mapping[str, float]


def uncertain_numbers(card: Card) -> Mapping[str, Choice]:
    """The one choice of a model that has none of its own: what its card itself is uncertain of.

    The prior of each is the card's value with the card's sigma; a card without a sigma has no choice.
    """
    free = tuple(
        Free(name, entry.sigma, entry.value, entry.sigma, source="the card with its sigma")
        for name, entry in card.parameters.items()
        if entry.sigma
    )
    return {"full": Choice("full", "every number that the card gives a sigma", free)} if free else {}
