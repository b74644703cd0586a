"""An identified model remembers the card that it was identified from, and is compared with that."""

from __future__ import annotations

from pathlib import Path

import pytest

import swashplate as sp
from swashplate.errors import CardError
from swashplate.models.catalogue import started_from
from swashplate.models.vehicle import Vehicle


def _identified(card: Vehicle, **values: float) -> Vehicle:
    """As `identify` leaves it."""
    for name, value in values.items():
        before = card.card.values()[name]
        card = card.with_values({name: value}, status="identified", sigma=0.1, source="identified", before=before)
    return card


def test_a_model_file_gives_back_the_card_it_was_identified_from(tmp_path: Path) -> None:
    card = sp.vehicle("raptor50").with_values({"mass": 5.0})
    _identified(card, hub_stiffness=31.0, blade_inertia=0.022).save(tmp_path / "model.toml")
    model = sp.vehicle(tmp_path / "model.toml")
    assert model.card.values()["hub_stiffness"] == 31.0
    before = started_from(model)
    assert before.card.values() == card.card.values()
    assert before.card.started_from() is None
    assert {before.card.parameters[name].sigma for name in ("hub_stiffness", "blade_inertia")} == {None}


def test_a_card_that_was_never_identified_is_compared_with_itself_or_the_packaged_one() -> None:
    raptor, coax = sp.vehicle("raptor50"), sp.vehicle("coax")
    assert started_from(raptor) is raptor
    assert started_from(coax.with_values({"mass": 0.333})).card.values() == coax.card.values()


def test_an_earlier_model_that_forgot_its_card_asks_for_it() -> None:
    model = sp.vehicle("raptor50").with_values({"hub_stiffness": 31.0}, status="identified", sigma=0.1, before=None)
    with pytest.raises(CardError, match=r"identified\.\s+Name that card with --settings published=CARD"):
        started_from(model)
