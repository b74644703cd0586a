"""Vehicles by name (a packaged card or structure, another package's model) or file, whatever kind of model it is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from swashplate import documents
from swashplate.errors import CardError, SwashError
from swashplate.files import is_file
from swashplate.models.card import Card, packaged_card, packaged_cards, packaged_names, read_card
from swashplate.models.linear import state_space_file
from swashplate.models.linear.composition import is_composed
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.residual import carrying, has_residual, without_residual
from swashplate.models.vehicle import Vehicle
from swashplate.registry import Registry, nearest

EQUATIONS: Registry[Callable[[Card], Vehicle]] = Registry(
    "models",
    what="kind of model",
    own={
        "coax": "swashplate.models.coax_vehicle:coax",
        "coaxial": "swashplate.models.coaxial.coaxial_vehicle:coaxial",
        "conventional": "swashplate.models.conventional.helicopter_vehicle:conventional",
        "linear": "swashplate.models.linear.card_vehicle:linear",
        "multirotor": "swashplate.models.multirotor_vehicle:multirotor",
        "stitched": "swashplate.models.linear.stitched:stitched",
    },
)
"""What makes a vehicle of a card, by the name that the card says: ours, and other packages' entry points."""


def from_card(card: Card) -> Vehicle:
    """The vehicle that a card is for.

    Raises:
        CardError: for a card of equations that nobody has, or that does not fit its equations.
        SwashError: where another package's equations cannot be loaded.
    """
    if card.vehicle not in EQUATIONS:
        raise CardError(
            f"vehicle is '{card.vehicle}', expected one of {', '.join(sorted(EQUATIONS))}.",
            where=card.path,
            channel="vehicle",
            hint=nearest(card.vehicle, EQUATIONS)
            or "Equations of your own are found by an entry point of the group swashplate.models (docs/extending.md).",
        )
    vehicle = EQUATIONS[card.vehicle](without_residual(card))
    return carrying(vehicle, card) if has_residual(card) else vehicle


def started_from(vehicle: Vehicle) -> Vehicle:
    """What a model is compared with: the card that it was identified from, or itself where it never was."""
    before = vehicle.card.started_from()
    if before is not None:
        return vehicle.with_card(before)
    if vehicle.traits.published:
        return from_card(packaged_card(vehicle.traits.published))
    if any(entry.status == "identified" for entry in vehicle.card.parameters.values()):
        raise CardError(
            "does not say from which card it was identified.",
            where=vehicle.card.path or vehicle.card.title,
            hint="Name that card with --settings published=CARD, or identify the model anew.",
        )
    return vehicle


def vehicle(name_or_file: str | Path, **options: bool | str) -> Vehicle:
    """A vehicle by its name, or by the path of a file of any kind of model.

    Args:
        name_or_file: a packaged card ("coax"), a ready structure ("thirteen_state"), a model of another package, or a
            file: a card, a model that a fit wrote, a state-space model.
        options: switches of the equations that replace the card's, e.g. `bar=False`, `mixing="as_printed"`.

    Raises:
        CardError: for what is neither, with the nearest name, or a file of something else; naming what is wrong in it.
    """
    text = str(name_or_file)
    if is_state_space(text):
        if options:
            raise CardError(
                f"has no options ({', '.join(options)} given): it is a linear model.", where=text, channel="options"
            )
        return structure(text)
    packaged = packaged_names()
    if text in packaged:
        card = packaged_card(text)
    elif is_file(text):
        card = _card_of(Path(text))
    elif text in EQUATIONS:
        card = _card_beside(text)
    else:
        names = (*packaged, *state_space_file.structure_names(), *(n for n in EQUATIONS if n not in _SEVERAL))
        near = nearest(text, names)
        raise CardError(
            "is neither a vehicle's name nor a file.",
            where=text,
            hint=f"{near} Names are {', '.join(dict.fromkeys(names))}; see 'swash vehicle list'.".strip(),
        )
    return from_card(replace(card, options={**card.options, **options}))


def cards_by_name() -> tuple[dict[str, Card], tuple[SwashError, ...]]:
    """Cards of all that has a name, ours first, and what is wrong with those of other packages that cannot be had."""
    cards, faults = packaged_cards(), []
    for name in (n for n in EQUATIONS if n not in cards and n not in _SEVERAL):
        try:
            cards[name] = _card_beside(name)
        except SwashError as fault:
            faults.append(fault)
    return cards, tuple(faults)


_SEVERAL = ("coaxial", "conventional", "linear", "multirotor", "stitched")
"""Equations of ours that have no card of their own, but one for every aircraft."""


def structure(name_or_file: str | Path) -> Vehicle:
    """The vehicle of a ready structure, a composed one or a state-space file; what it is made of is its `structure`.

    Args:
        name_or_file: "hybrid", "compose:body+flap+inflow" (`sp.structures` lists names and parts) or a file.

    Raises:
        CardError, ExpressionError: naming the file, the entry, what was found and what was expected.
    """
    return linear_vehicle(state_space_file.structure(name_or_file))


def is_state_space(name_or_file: str | Path) -> bool:
    """Whether a name is that of a ready structure, or of a file that says that it is a state-space model."""
    text = str(name_or_file)
    return is_composed(text) or text in state_space_file.structure_names() or state_space_file.is_state_space(text)


def _card_of(path: Path) -> Card:
    """The card in a file.

    Raises:
        CardError: for a file of another kind, said with what reads that.
    """
    kind = documents.kind_of(path)  # `read_card` says what is wrong where it is none
    if kind in _READ_BY:
        raise CardError(
            f"kind is {kind!r}, expected a model: 'vehicle' or 'state-space'.", where=path, hint=_READ_BY[kind]
        )
    return read_card(path)


_READ_BY: Mapping[str, str] = {
    "controller": "It is a controller: --controller and `swash control check` take it.",
    "servo-mapping": "It is a servo mapping: --servos of `swash link` takes it.",
}


def _card_beside(name: str) -> Card:
    """The card of another package's model: the file NAME.toml beside the module of its equations."""
    module = EQUATIONS[name].__module__
    file = Path(str(sys.modules[module].__file__)).parent / f"{name}.toml"
    if not file.is_file():
        raise CardError(
            "has no card of its own.",
            where=name,
            hint=f"Give a card's file with vehicle = \"{name}\", or put {name}.toml beside the module '{module}'.",
        )
    return replace(read_card(file), path=file.name)
