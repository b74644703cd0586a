"""Chances of a part of the physics where it is not there, against draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rolling import OFF_CENTRE
from swashplate.identification.one_step import EffectTest, chance_of, holm


def test_chances_are_those_of_draws_about_zero() -> None:
    """The largest likelihood with one number held at zero or above, by drawing what the data may say."""
    drawn = np.random.default_rng(1).standard_normal((200_000, 2))
    bounded = np.maximum(drawn[:, 0], 0.0) ** 2
    assert chance_of(2.7, 1, 1) == pytest.approx(np.mean(bounded >= 2.7), abs=0.002)
    assert chance_of(2.7, 2, 1) == pytest.approx(np.mean(bounded + drawn[:, 1] ** 2 >= 2.7), abs=0.003)
    assert chance_of(2.7, 1, 0) == pytest.approx(np.mean(drawn[:, 0] ** 2 >= 2.7), abs=0.002)


def test_many_tests_ask_for_more() -> None:
    one = EffectTest(OFF_CENTRE, True, chance=0.004)
    refused = EffectTest(OFF_CENTRE, True, refused="why")
    found = holm([one, replace(one, chance=0.2), refused, replace(one, chance=0.006)])
    assert [each.adjusted for each in found[:2]] == pytest.approx([0.012, 0.2])
    assert found[3].adjusted == pytest.approx(0.012)
    assert found[0].verdict == "not needed"
    assert holm([one])[0].verdict == "needed"
    assert found[2].verdict == "cannot be told"
