"""Vehicles by NAME (a packaged card) or FILE (a card or model file)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from swashplate.errors import CardError
from swashplate.vehicles.card import Card, packaged_cards, read_card
from swashplate.vehicles.coax import coax
from swashplate.vehicles.conventional import conventional
from swashplate.vehicles.linear import NAME as LINEAR
from swashplate.vehicles.linear import linear
from swashplate.vehicles.vehicle import Vehicle

_EQUATIONS: Mapping[str, Callable[[Card], Vehicle]] = {"coax": coax, "conventional": conventional, LINEAR: linear}


def from_card(card: Card) -> Vehicle:
    """The vehicle that a card is for."""
    if card.vehicle not in _EQUATIONS:
        raise CardError(
            f"vehicle is '{card.vehicle}', expected one of {', '.join(sorted(_EQUATIONS))}.",
            where=card.path,
            channel="vehicle",
        )
    return _EQUATIONS[card.vehicle](card)


def vehicle(name_or_file: str | Path, **options: Any) -> Vehicle:
    """A vehicle by the name of its packaged card or by the path of a card or model file.

    Args:
        name_or_file: e.g. "coax" or "fit/model.toml".
        options: switches of the equations that replace the card's, e.g. `bar=False`, `mixing="as_printed"`.
    """
    packaged = packaged_cards()
    text = str(name_or_file)
    if text in packaged:
        card = packaged[text]
    elif Path(text).is_file():
        card = read_card(text)
    else:
        raise CardError(
            "is neither a vehicle's name nor a file.",
            where=text,
            hint=f"Names are {', '.join(packaged)}; see 'swash vehicles'.",
        )
    return from_card(replace(card, options={**card.options, **options}))
