"""Gusts that last, on a model without a velocity: what takes them for white says so, a state of the air mends it."""

from __future__ import annotations

import numpy as np
import pytest

import lacking
from swashplate.errors import IdentificationError
from swashplate.identification.core.result import Result
from swashplate.identification.identify import identify
from swashplate.models.linear.state_space_file import parse, structure

SINK = """
kind = "state-space"
name = "sink"
[states]
x = "m/s"
[inputs]
mixer_roll = "1"
[equations]
x = {x = "Zw", mixer_roll = "Zc"}
[outputs.p]
unit = "rad/s"
of = {x = "1"}
[parameters]
Zw = {value = -1.0, unit = "1/s"}
Zc = {value = 1.0, unit = "m/s^2"}
"""


def fitted(gust: float, **how: object) -> Result:
    model = structure("rotor_body").with_values(dict.fromkeys(("Ba", "Ab", "Blon", "Alat"), 0.0), free=False)
    flown = [lacking.flights([4], axis, gust=gust, lacking=False, seconds=20.0)[0] for axis in lacking.INPUTS]
    return identify(model, flown, method="filter-error", **how)


def distances(fit: Result) -> np.ndarray:
    """Of the moments by tilt, in plain standard deviations."""
    return np.array([(fit[name].value - lacking.TRUTH[name]) / fit[name].sigma for name in ("Lb", "Ma")])


def test_what_takes_lasting_gusts_for_white_is_biased_and_says_so() -> None:
    white, lasting = fitted(1.0), fitted(1.0, gusts="lasting")
    assert np.abs(distances(white)).max() > 2.5
    assert any("not white" in words for words in white.warnings)
    assert np.abs(distances(lasting)).max() < 2.5
    assert not any("not white" in words for words in lasting.warnings)
    assert all(abs(white[n].value - lacking.TRUTH[n]) < 3.0 * white[n].best_sigma for n in ("Lb", "Ma"))


def test_calm_air_gives_no_such_words() -> None:
    assert not any("not white" in words for words in fitted(0.0).warnings)


def test_a_model_with_neither_velocity_nor_rate_has_no_lasting_gusts() -> None:
    flown = lacking.flights([4], "mixer_roll", gust=0.0, lacking=False, seconds=4.0)
    with pytest.raises(IdentificationError, match="that lasting gusts act on"):
        identify(parse(SINK), flown, method="filter-error", gusts="lasting")
