"""Bands: where the law holds, any rank among the paths is as likely as any other; the words say where it does not."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from simulated_flights import ten_seconds
from swashplate.errors import SwashError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import records
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation.bands import (
    ROWS,
    SURE,
    BandedRecord,
    bands,
    in_brief,
    pairs,
    widened_words,
    widening,
)
from swashplate.validation.prediction import ObservedRecord, paths
from swashplate.validation.validate import check_draws


def _record(
    width: float, *, seconds: float = 300.0, shift: float = 0.0, share: float = 0.25, wider: float = 1.0
) -> BandedRecord:
    """Truths by a standard normal law, a start every second, among 39 paths of another width."""
    random, starts = np.random.default_rng(3), round(seconds)
    ways = shift + width * random.standard_normal((39, starts, len(PREDICTED)))
    came = random.standard_normal((starts, len(PREDICTED)))
    below = np.sum(ways < came, axis=0)
    ones = np.full(below.shape, width**2)
    wider = np.where(np.arange(len(PREDICTED)) == PREDICTED.index("r"), wider, 1.0)
    return BandedRecord(np.arange(starts) * 1.0, below, 39, ones, share * ones, (came - shift) ** 2, wider)


def _levels(record: BandedRecord) -> dict[float, set[str]]:
    found = bands({0.5: [record]})
    return {share: {band.level for band in found if band.promised == share} for share in (50.0, 95.0)}


def test_bands_of_the_law_itself_hold_what_they_promise_however_few_the_paths() -> None:
    found = bands({0.5: [_record(1.0, seconds=3000.0)]})
    for share in (50.0, 95.0):
        held = np.mean([band.held for band in found if band.promised == share])
        assert held == pytest.approx(share, abs=0.8)
    assert {band.level for band in found} == {"holds"}
    assert {round(band.by_parameters) for band in found} == {25}


@pytest.mark.parametrize(
    ("record", "level"),
    [
        (_record(0.5), "too narrow"),
        (_record(2.0), "too wide"),
        (_record(1.0, shift=1.5), "too narrow"),
        (_record(1.0, seconds=5.0), "cannot be judged"),
    ],
)
def test_other_laws_and_flights_that_are_too_short_are_told(record: BandedRecord, level: str) -> None:
    assert _levels(record)[50.0] == {level}


def test_what_a_band_says() -> None:
    found = bands({0.5: [_record(0.5)]})
    band = next(one for one in found if (one.channel, one.promised) == ("p", 95.0))
    assert band.summary_text.startswith(f"p, 0.5 s ahead: the 95 % band holds {band.held:.0f} % ({band.low:.0f} to ")
    assert "this motion is larger than the model and the gusts of its fit explain" in band.summary_text
    assert in_brief(found, 0.5).startswith("Bands 0.5 s ahead. Too narrow: ")
    half, most = next(pair for pair in pairs(found) if pair[0].channel == "p")
    cells = [cell(half, most) for _, cell in ROWS]
    assert cells[1] == cells[3] == "too narrow"
    assert cells[4:6] == [f"{np.degrees(0.5):.3g}", "deg/s"]


@pytest.mark.parametrize(("width", "warned"), [(0.4, True), (1.0, False), (2.5, False)])
def test_a_band_that_is_too_narrow_says_by_how_much_and_no_other(width: float, warned: bool) -> None:
    found = [band for band in bands({0.5: [_record(width)]}) if band.promised == SURE]
    assert {bool(band.warning) for band in found} == {warned}
    p = next(band for band in found if band.channel == "p")
    assert p.off == pytest.approx(1.0 / width, rel=0.1)
    if warned:
        assert f"do not trust the 95 % band. It holds {p.held:.0f} % of the flight [" in p.warning
        assert f"errors are {p.off:.1f} times as large as it says." in p.warning
        alone = next(b for b in bands({0.5: [_record(width, share=0.0)]}) if (b.channel, b.promised) == ("p", SURE))
        assert "How sure the model's numbers are is not in it" in alone.warning
        assert in_brief([alone], 0.5, drawn=False).startswith("Bands 0.5 s ahead (how sure the model")
    else:
        assert in_brief(found, 0.5, drawn=False) == ""


def test_bands_are_widened_by_first_seconds_that_are_missed_and_only_by_chance_otherwise() -> None:
    """Five independent starts tell a spread to a third: errors within it change nothing, thrice as large ones do."""
    random, count = np.random.default_rng(5), len(PREDICTED)
    sigma = np.geomspace(1e-3, 10.0, count)

    def found(size: float) -> np.ndarray:
        errors = size * sigma * random.standard_normal((400, 5, count))
        return np.array([widening(each, sigma, seconds=2.5, horizon=0.5) for each in errors])

    assert np.mean(found(1.0) > 1.0) == pytest.approx(0.05, abs=0.015)
    missed = found(3.0)
    assert np.mean(missed > 1.0) > 0.9
    assert np.sqrt(np.mean(missed**2)) == pytest.approx(3.0, rel=0.05)
    # Starts closer together than the horizon tell no more.
    often = np.repeat(1.7 * sigma[None], 50, axis=0)
    assert np.all(widening(often, sigma, seconds=2.5, horizon=0.5) > 1.0)
    assert np.all(widening(often, sigma, seconds=2.5, horizon=2.0) == 1.0)
    assert np.all(widening(often[:0], sigma, seconds=0.0, horizon=0.5) == 1.0)


def test_what_was_widened_is_told() -> None:
    assert widened_words(bands({0.5: [_record(1.0)]})) == ""
    words = widened_words(bands({0.5: [_record(1.0), _record(1.0, wider=2.5)]}))
    assert "were larger: r 2.5 times" in words


def test_draws_that_leave_no_whole_number_of_paths_outside_are_refused() -> None:
    coax = sp.vehicle("coax")
    check_draws(coax, ())
    check_draws(coax, [coax] * 79)
    with pytest.raises(SwashError, match="draws: are 20, expected 39, 79, 119 and so on"):
        check_draws(coax, [coax] * 20)
    with pytest.raises(SwashError, match="of another model than the one that is validated"):
        check_draws(coax, [sp.vehicle("raptor50")] * 39)


def test_paths_are_the_models_predictions_with_gusts_and_noise_of_their_own() -> None:
    coax = sp.vehicle("coax")
    (record,) = records(ten_seconds().condition(rate=100.0, cutoff=0.0), coax)
    noise, nuisance = Noise(), Nuisance()
    made = ObservedRecord(coax, record, noise=noise, nuisance=nuisance).predict(horizon=1.0, every=0.1, settling=3.0)

    def fan(noise: Noise) -> tuple[np.ndarray, np.ndarray]:
        seen = ObservedRecord(coax, record, noise=noise, nuisance=nuisance)
        return next(paths([seen], starts=made.starts, ahead=100, seed=2))

    path, plain = fan(noise)
    np.testing.assert_allclose(plain, made.states, atol=1e-9)
    np.testing.assert_array_equal(fan(noise)[0], path)
    away = np.std((path - plain)[:-10], axis=0)
    at = PREDICTED.index
    assert np.all(away[99, [at("x"), at("phi"), at("r")]] > 2.0 * away[5, [at("x"), at("phi"), at("r")]])
    assert away[99, at("phi")] > 0.01
    still = scaled(noise, 0.1)
    calmer = fan(still)
    assert np.std(calmer[0] - calmer[1], axis=0)[99, at("r")] < 0.3 * away[99, at("r")]


def scaled(noise: Noise, share: float) -> Noise:
    """Gusts, white accelerations and drifts of another size."""
    sizes = {n: share * v for n, v in noise._asdict().items() if n.startswith(("gust", "white", "drift"))}
    return noise._replace(**sizes)
