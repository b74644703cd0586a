"""Predicting a simulated flight: nothing after a start is seen, the truth predicts well, and rivals are fairly held."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import swashplate as sp
from simulated_flights import ten_seconds
from swashplate.errors import FlightError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import CALIBRATION, Record, records
from swashplate.identification.time.calibration import calibrate, first_part
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.validation.prediction import ObservedRecord, Predictions
from swashplate.validation.validate import observer_of, validate
from swashplate.validation.validation import PREDICTORS, Validation

HORIZONS, EVERY = (0.5, 1.0), 0.5  # as in the end-to-end test: the same compiled code


@lru_cache(maxsize=1)
def _validation() -> Validation:
    flight = ten_seconds().condition(rate=100.0, cutoff=0.0)
    told: list[tuple[int, float]] = []
    coax, tell = sp.vehicle("coax"), lambda i, n: told.append((i, n))
    found = validate(coax, flight, published=coax, horizons=HORIZONS, every=EVERY, progress=tell)
    assert told == [(1, 1.0)]
    return found


@lru_cache(maxsize=1)
def _record() -> Record:
    (record,) = records(ten_seconds().condition(rate=100.0, cutoff=0.0), sp.vehicle("coax"))
    return record


def _predicted(record: Record, *, nuisance: Nuisance | None = None, close_loop: tuple[str, ...] = ()) -> Predictions:
    told = Nuisance(*map(float, nuisance or Nuisance()))
    observed = ObservedRecord(sp.vehicle("coax"), record, noise=Noise(), nuisance=told)
    return observed.predict(horizon=max(HORIZONS), every=EVERY, settling=CALIBRATION, close_loop=close_loop)


def _changed_after(record: Record, sample: int) -> Record:
    """The same until `sample`; after it the measurements are another flight's."""
    outputs = record.outputs.copy()
    outputs[sample + 1 :] += np.linspace(0.0, 1.0, len(outputs) - sample - 1)[:, None] ** 2
    return replace(record, outputs=outputs)


def test_a_prediction_has_seen_nothing_after_its_start() -> None:
    record = _record()
    before = _predicted(record)
    place = 4
    start = int(before.starts[place])
    after = _predicted(_changed_after(record, start))
    np.testing.assert_array_equal(after.states[: place + 1], before.states[: place + 1])
    np.testing.assert_array_equal(after.filtered[: start + 1], before.filtered[: start + 1])
    assert np.abs(after.states[place + 1] - before.states[place + 1]).max() > 1e-6


def test_a_closed_loop_uses_nothing_that_was_recorded_of_its_axis_after_the_start() -> None:
    """Another yaw command after a start changes the prediction on recorded inputs, and not the one in closed loop."""
    record, place = _record(), 4
    late = Nuisance(delay_motor=0.045)
    before = _predicted(record, nuisance=late, close_loop=("yaw",))
    start = int(before.starts[place])
    inputs = record.inputs.copy()
    inputs[start + 1 :, :2] += np.array([-0.05, 0.05]) * np.linspace(0.5, 1.0, len(inputs) - start - 1)[:, None]
    after = _predicted(replace(record, inputs=inputs), nuisance=late, close_loop=("yaw",))
    assert before.closed is not None
    assert after.closed is not None
    assert [law.axis for law in before.laws] == ["yaw"]
    np.testing.assert_allclose(after.closed[: place + 1], before.closed[: place + 1], rtol=0.0, atol=1e-12)
    r = PREDICTED.index("r")
    assert np.abs(after.states[place, :, r] - before.states[place, :, r]).max() > 0.1
    assert np.abs(after.closed[place + 1, :, r] - before.closed[place + 1, :, r]).max() > 1e-6


def test_predictions_begin_one_sample_after_their_start() -> None:
    """The first predicted state is next to what the observer believed at the start, and the first start is late."""
    found = _predicted(_record())
    assert found.starts[0] == round(CALIBRATION * 100.0)
    assert found.states.shape == (found.starts.size, 100, 12)
    jump = found.states[:, 0] - found.filtered[found.starts]
    at = PREDICTED.index
    speed = found.filtered[found.starts]
    np.testing.assert_allclose(jump[:, at("phi")], 0.01 * speed[:, at("p")], atol=2e-3)
    np.testing.assert_allclose(jump[:, at("z")], 0.01 * speed[:, at("w")], atol=2e-3)


def test_the_calibration_has_seen_nothing_after_its_seconds() -> None:
    record = _record()
    noise, prior = observer_of(sp.vehicle("coax"))
    coax = sp.vehicle("coax")
    found = calibrate(coax, record, noise=noise, prior=prior)
    assert calibrate(coax, _changed_after(record, round(CALIBRATION * 100.0)), noise=noise, prior=prior) == found
    assert abs(found.lever_y) < 0.03  # the simulated cameras track the centre of gravity
    short = first_part(record, 2.0)
    assert (short.time.size, short.inputs.shape, short.voltage.size) == (201, (201, 4), 201)
    assert first_part(record, 1e3).time.size == record.time.size


def test_the_truth_predicts_well_and_every_rival_is_scored() -> None:
    found = _validation()
    assert {score.predictor for score in found.scores} == set(PREDICTORS)
    for horizon in HORIZONS:
        for channel in ("phi", "theta", "p", "q"):
            assert found.score(channel, horizon).fit > 50.0, (channel, horizon)
        for channel in PREDICTED:
            assert found.score(channel, horizon, "hold").fit == pytest.approx(0.0, abs=1e-9)
            assert found.score(channel, horizon, "hold").theil == pytest.approx(1.0)
            assert found.score(channel, horizon).starts > 5
    with pytest.raises(StopIteration):
        found.score("phi", 5.0)


def test_the_card_beside_itself_is_itself() -> None:
    """Model and published card are the same here: every figure of theirs must be the same."""
    found = _validation()
    for horizon in HORIZONS:
        for channel in PREDICTED:
            model, card = (found.score(channel, horizon, name) for name in ("model", "published card"))
            assert (model.fit, model.rms, model.theil) == (card.fit, card.rms, card.theil)
    assert found.log_likelihood["model"] == found.log_likelihood["published card"]
    by_axis = {item.axis: item for item in found.verdict}
    assert by_axis["yaw"].level == "cannot be judged"  # nothing moved it
    assert by_axis["roll"].level in ("good", "usable")  # a card is no rival of itself
    assert "Beaten" not in by_axis["roll"].words


def test_what_is_measured_and_the_examples_fit_the_record() -> None:
    found = _validation()
    (record,), (measured,) = found.records, found.measured
    assert measured.shape == (record.time.size, 12)
    np.testing.assert_allclose(measured, measured_states(record, Nuisance()), atol=0.2)
    for example in found.examples:
        assert example.states.shape == example.sigma.shape == (example.time.size, 12)
        assert example.time[0] - example.start == pytest.approx(0.01)
        growing = example.sigma[:, PREDICTED.index("x")]
        assert np.all(np.diff(growing) > 0.0)
    assert found.settings["records"] == [record.name]


def test_the_result_is_plain_json_and_prints() -> None:
    import json

    found = _validation()
    document = json.loads(json.dumps(found.to_document()))
    assert document["kind"] == "validation"
    assert [set(told) >= {"record", "delay_servo", "level_psi"} for told in document["calibrated"]] == [True]
    assert len(document["scores"]) == len(PREDICTED) * len(HORIZONS) * len(PREDICTORS)
    for part in ("constant rates", "0.5 s", "roll: good"):
        assert part in repr(found)


def test_every_score_of_the_model_stands_beside_its_floor() -> None:
    found = _validation()
    assert {(f.channel, f.horizon) for f in found.floors} == {(c, h) for c in PREDICTED for h in HORIZONS}
    for floor in found.floors:
        score = found.score(floor.channel, floor.horizon)
        assert (floor.fit, floor.rms) == (pytest.approx(score.fit), pytest.approx(score.rms))
        assert floor.moved == pytest.approx(found.score(floor.channel, floor.horizon, "hold").rms)
        assert floor.rival != "published card"  # a card is no rival of itself
    phi = found.floor("phi", 0.5)
    assert 0.0 < phi.expected < phi.fit  # the usual gusts are promised, and this flight had none
    assert np.isnan(phi.low)  # five seconds of starts are too few blocks
    assert "filter expects" in repr(found)
    assert found.to_document()["floors"][0]["words"] == found.floors[0].summary_text


def test_a_flight_that_is_over_before_it_is_calibrated_is_refused() -> None:
    flight = ten_seconds().condition(rate=100.0, cutoff=0.0).between(0.0, 6.0)
    with pytest.raises(FlightError, match=r"longest unbroken piece has 6\.0 s, expected more than 6\.5 s"):
        validate(sp.vehicle("coax"), flight, published=sp.vehicle("coax"))


def test_an_observer_section_is_used_and_a_card_without_one_has_the_usual() -> None:
    coax = sp.vehicle("coax")
    assert observer_of(coax) == (Noise(), Nuisance(delay_servo=0.05, delay_motor=0.05))
    observer = {"noise": {"gust_tilt": 1.5, "of_old": 3.0}, "nuisance": {"delay_servo": 0.02}}
    noise, nuisance = observer_of(replace(coax, card=replace(coax.card, observer=observer)))
    assert noise == Noise(gust_tilt=1.5)
    assert nuisance == Nuisance(delay_servo=0.02)
