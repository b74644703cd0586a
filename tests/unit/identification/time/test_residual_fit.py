"""How much of a residual is kept: by blocks left out, and no more than they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from simulated_flights import ten_seconds
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import records
from swashplate.identification.time import residual_fit
from swashplate.identification.time.feedback import AxisExcitation
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.linear_residual import LinearResidual
from swashplate.identification.time.residual_ahead import BLOCK
from swashplate.identification.time.residual_fit import fit_residual


def test_words_say_what_was_gained_and_where() -> None:
    vehicle = sp.vehicle("crazyflie")
    none = LinearResidual(vehicle, np.inf, 12.0, 9.0, {"p": 0.0}, Noise())
    assert none.summary_text == "residual: none, the best would gain 12 +- 9 of log-likelihood on blocks left out"
    some = LinearResidual(vehicle, 2.0, 120.0, 9.0, {"p": 14.2, "q": 3.0}, Noise())
    assert "gains 120 +- 9" in some.summary_text
    assert "p 14 %, q 3 %" in some.summary_text
    assert some.settings_entry["share of each acceleration [%]"] == {"p": 14.2, "q": 3.0}


def test_words_name_the_physics_that_moved_far() -> None:
    vehicle = sp.vehicle("crazyflie")
    shares = dict.fromkeys(("u", "v", "w", "p", "q", "r"), 0.0)
    found = LinearResidual(vehicle, 2.0, 120.0, 9.0, shares, Noise(), shifts={"tau_drive": 24.2, "inertia_xx": -1.4})
    assert found.summary_text.endswith("; with it the physics moves: tau_drive by +24 sigma")
    assert found.settings_entry["sigmas by which the physics moved"] == {"tau_drive": 24.2, "inertia_xx": -1.4}


def test_an_axis_that_its_controller_moves_has_no_residual() -> None:
    def axis(explained: float, *, answer: bool, identifiable: bool = True) -> AxisExcitation:
        return AxisExcitation("record", "heave", "", explained, 1.0, 0.0, 0.01, identifiable, "", answer)

    assert residual_fit._moves_by_itself("heave", [])  # not judged
    assert residual_fit._moves_by_itself("heave", [axis(0.5, answer=False)])
    assert residual_fit._moves_by_itself("heave", [axis(0.97, answer=False)])  # the motion follows
    assert not residual_fit._moves_by_itself("heave", [axis(0.965, answer=True)])  # mostly an answer
    assert not residual_fit._moves_by_itself("heave", [axis(np.nan, answer=False, identifiable=False)])  # stands still
    assert residual_fit._moves_by_itself("heave", [axis(0.965, answer=True), axis(0.5, answer=False)])


def test_too_few_blocks_are_refused_before_anything_is_computed() -> None:
    coax = sp.vehicle("coax")
    pieces = records((ten_seconds().condition(rate=100.0, cutoff=0.0),), coax)
    with pytest.raises(IdentificationError, match="1 blocks of 6 s, a residual needs 4"):
        fit_residual(coax, pieces, [Nuisance()], Noise())


def test_blocks_cover_the_record_once() -> None:
    (piece,) = records((ten_seconds().condition(rate=100.0, cutoff=0.0),), sp.vehicle("coax"))
    long = replace(piece, **{name: np.concatenate([getattr(piece, name)] * 3) for name in ("inputs", "outputs")},
                   time=0.01 * np.arange(3 * piece.time.size), voltage=np.tile(piece.voltage, 3))  # fmt: skip
    cut = residual_fit._blocks(long)
    assert len(cut) == int(long.time[-1] // BLOCK)
    np.testing.assert_array_equal(np.concatenate([block.time for block in cut]), long.time)


def test_blocks_begin_with_their_flights_own_accelerations(monkeypatch: pytest.MonkeyPatch) -> None:
    """A block whose filter begins without them must find them with its drifts, in the 1.5 s that are not counted."""
    coax = sp.vehicle("coax")
    (piece,) = records((ten_seconds().condition(rate=100.0, cutoff=0.0),), coax)
    made: list[FilterError] = []

    def stop(likelihoods: list[FilterError]) -> None:
        made.extend(likelihoods)
        raise InterruptedError

    monkeypatch.setattr(residual_fit, "seen_along", stop)
    own = Nuisance(delay_servo=0.05, delay_motor=0.05, trim_motor_upper=0.01, push_p=2.0, push_w=-0.5)
    with pytest.raises(InterruptedError):
        fit_residual(coax, [piece] * 4, [own] * 4, Noise())
    assert len(made) == 4
    for each in made:
        kept = Nuisance(*each.numbers(each.row.starts())[0].nuisance)
        assert kept == own
