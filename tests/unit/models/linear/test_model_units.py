"""Units of a model file's parameters against the equations where they stand."""

from __future__ import annotations

import pytest

from swashplate.models.linear.model_units import unit_words
from swashplate.models.linear.state_space_file import parse, structure, structure_names, to_toml


@pytest.mark.parametrize("name", structure_names())
def test_the_ready_structures_fit(name: str) -> None:
    assert unit_words(structure(name)) == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('value = -4.0\nunit = "1/s"', 'value = -4.0\nunit = "1/s^2"', "Nr before r in the equation of r is 1/s^2"),
        ('value = 166.0\nunit = "1/s^2"', 'value = 166.0\nunit = "1/s"', "Lb before b in the equation of p is 1/s"),
        ('collective = "Zcol"', 'collective = "Zcol + Zw"', "Zcol + Zw adds what is not alike"),
        ('q = "-tau_f"', 'q = "-Ba"', "-Ba before q in the equation of a is 1, expected s"),
    ],
)
def test_what_does_not_fit_is_named(old: str, new: str, words: str) -> None:
    text = to_toml(structure("hybrid"))
    assert old in text
    (found,) = unit_words(parse(text.replace(old, new, 1)))
    assert words in found


def test_what_has_no_unit_fits_everywhere() -> None:
    text = to_toml(structure("hybrid")).replace('value = -4.0\nunit = "1/s"', "value = -4.0")
    assert unit_words(parse(text)) == []
