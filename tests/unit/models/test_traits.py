"""Traits: what models say of themselves, so that nobody outside `swashplate.models` asks for their names."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from pathlib import Path

import pytest

import swashplate
from swashplate.models.card import Card, Parameter
from swashplate.models.catalogue import EQUATIONS, vehicle
from swashplate.models.traits import uncertain_numbers

SOURCE = Path(swashplate.__file__).parent
NAMES = {"coax", "conventional", "linear"}


def branches(code: str) -> list[int]:
    """Lines on which something is compared with a model's name, or with a constant that holds it."""
    if not re.search(rf"[\"']({'|'.join(NAMES)})[\"']|LINEAR|COAX|CONVENTIONAL", code):
        return []  # soon seen, and most files
    return [
        node.lineno
        for node in ast.walk(ast.parse(code))
        if isinstance(node, ast.Compare)
        and any(
            (isinstance(part, ast.Constant) and part.value in NAMES)
            or (isinstance(part, ast.Name) and part.id in ("LINEAR", "COAX", "CONVENTIONAL"))
            for part in (node.left, *node.comparators)
        )
        and any(
            isinstance(part, ast.Attribute) and part.attr in ("name", "vehicle")
            for part in (node.left, *node.comparators)
        )
    ]


def test_nobody_outside_the_models_asks_for_a_models_name() -> None:
    assert set(EQUATIONS) >= NAMES
    found = {
        f"{path.relative_to(SOURCE)}:{line}"
        for path in SOURCE.rglob("*.py")
        if path.relative_to(SOURCE).parts[0] != "models"
        for line in branches(path.read_text(encoding="utf-8"))
    }
    assert found == set()


def test_such_a_question_would_be_found() -> None:
    assert branches('if vehicle.name == "coax":\n    pass') == [1]
    assert branches("y = saved.vehicle.name != LINEAR") == [1]
    assert branches('if interpolation == "linear":\n    pass') == []


def test_a_model_that_says_nothing_may_free_what_its_card_is_uncertain_of() -> None:
    known = Parameter(2.0, "kg", "scales", "measured")
    card = Card("mine", "mine", "", {}, {"mass": known, "drag": replace(known, sigma=0.5)})
    choice = uncertain_numbers(card)["full"]
    assert [(f.name, f.mean, f.sigma) for f in choice.free] == [("drag", 2.0, 0.5)]
    assert uncertain_numbers(replace(card, parameters={"mass": known})) == {}


@pytest.mark.parametrize(
    ("name", "ready"), [("coax", {"flight", "full", "balanced", "asymmetric"}), ("raptor50", {"rotor", "full"})]
)
def test_the_ready_choices_are_the_models_own(name: str, ready: set[str]) -> None:
    assert set(vehicle(name).choices) == ready
