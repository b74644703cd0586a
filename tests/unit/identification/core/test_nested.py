"""What two nested fits say of the effect that they differ by: chances against draws, and a fit that misses physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rolling import OFF_CENTRE as EFFECT
from rolling import OUTPUTS_OF_ROLL as OUTPUTS
from rolling import biased, gusty
from swashplate.errors import IdentificationError
from swashplate.identification.core.nested import EffectTest, chance_of, holm
from swashplate.identification.nested import fit_nested
from swashplate.identification.one_step import one_step_effects

HOW = {"outputs": list(OUTPUTS), "method": "filter-error"}


def test_chances_are_those_of_draws_about_zero() -> None:
    """The largest likelihood with one number held at zero or above, by drawing what the data may say."""
    drawn = np.random.default_rng(1).standard_normal((200_000, 2))
    bounded = np.maximum(drawn[:, 0], 0.0) ** 2
    assert chance_of(2.7, 1, 1) == pytest.approx(np.mean(bounded >= 2.7), abs=0.002)
    assert chance_of(2.7, 2, 1) == pytest.approx(np.mean(bounded + drawn[:, 1] ** 2 >= 2.7), abs=0.003)
    assert chance_of(2.7, 1, 0) == pytest.approx(np.mean(drawn[:, 0] ** 2 >= 2.7), abs=0.002)


def test_many_tests_ask_for_more() -> None:
    one = EffectTest(EFFECT, True, chance=0.004)
    found = holm([one, replace(one, chance=0.2), EffectTest(EFFECT, True, refused="why"), replace(one, chance=0.006)])
    assert [each.adjusted for each in found[:2]] == pytest.approx([0.012, 0.2])
    assert found[3].adjusted == pytest.approx(0.012)
    assert found[0].verdict == "not needed"
    assert holm([one])[0].verdict == "needed"
    assert found[2].verdict == "cannot be told"


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_missing_physics_is_found_and_only_where_it_is_missing(offset: float) -> None:
    vehicle, flight = biased(), gusty(offset=offset)
    free = ["Lb", "tau", "A"]
    (added,) = fit_nested(vehicle, flight, free=free, effects=[EFFECT], **HOW).tests
    assert added.verdict == ("needed" if offset else "not needed"), added.words
    if offset:
        value, sigma = added.values["offset"]
        assert abs(value - offset) < 3.0 * sigma
        assert "freeing it moves" in added.words
    fits = fit_nested(vehicle, flight, free=[*free, "offset"], effects=[EFFECT], **HOW)
    (asked,) = fits.tests
    (step,) = one_step_effects(fits.fit, [EFFECT])
    assert step.asked
    assert step.verdict == asked.verdict
    assert asked.asked
    assert asked.gain == pytest.approx(added.gain, abs=0.2)
    assert asked.verdict == added.verdict


def test_what_is_in_the_structure_without_being_free_is_not_called_needless() -> None:
    """Held at another value than none: freeing it would test that value, not whether the effect is there."""
    vehicle = biased().with_values({"offset": 0.05})
    (held,) = fit_nested(vehicle, gusty(offset=0.05), free=["Lb", "tau", "A"], effects=[EFFECT], **HOW).tests
    assert held.verdict == "cannot be told"
    assert "offset is held at 0.05" in held.words


def test_a_model_that_names_no_effects_says_so() -> None:
    with pytest.raises(IdentificationError, match="names no effects"):
        fit_nested(biased(), gusty(), free=["Lb"], **HOW)
