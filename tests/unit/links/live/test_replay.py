"""Replay: the log as it is, a prediction that starts anew, films and pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, SwashError
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight
from swashplate.links.live.replay import Replay, as_json, floor, replay
from swashplate.simulation.sensors import QUIET


@pytest.fixture(scope="module")
def flight() -> Flight:
    raptor = sp.vehicle("raptor50")
    flown = sp.simulate(raptor, "doublet:roll,0.5s,0.02", controller=sp.state_hold, lead=2, tail=3)
    return flown.condition(rate=100, cutoff=0, outliers=False, trim_ground=False)


@pytest.fixture(scope="module")
def shown(flight: Flight) -> Replay:
    return replay(flight, model=sp.vehicle("raptor50"), ahead=1.0)


def test_shows_the_log_as_it_is(flight: Flight, shown: Replay) -> None:
    raptor = sp.vehicle("raptor50")
    times = flight.time("phi")
    for i, name in enumerate(raptor.state_names):
        assert np.allclose(shown.states[:, i], np.interp(shown.time, times, flight.values(name)), atol=1e-12)
    assert shown.simulated
    assert np.median(np.diff(shown.time)) == pytest.approx(0.02)


def test_the_right_model_predicts_and_a_wrong_one_does_not(flight: Flight, shown: Replay) -> None:
    raptor = sp.vehicle("raptor50")
    assert shown.predicted is not None
    there = np.isfinite(shown.predicted[:, 0])
    assert np.mean(there) > 0.8
    right = np.abs(shown.predicted - shown.states[:, :12])[there]
    # The shown moments are half as many as the inputs that flew it, held: not exact at the doublet's edges.
    assert np.max(right[:, 9]) < 0.05
    heavy = raptor.with_values({"inertia_xx": 3.0 * raptor.card.values()["inertia_xx"]})
    wrong = replay(flight, model=heavy, ahead=1.0)
    assert wrong.predicted is not None
    assert np.nanmax(np.abs(wrong.predicted[:, 9] - shown.states[:, 9])) > 0.1


def test_a_prediction_starts_anew(shown: Replay) -> None:
    assert shown.predicted is not None
    first = 51  # one moment after the second start
    assert np.allclose(shown.predicted[first], shown.states[first, :12], atol=1e-2)
    with pytest.raises(SwashError, match="--ahead"):
        replay(Flight({}), ahead=0.0)


def test_drawn_models_fan_out_from_where_the_prediction_begins(flight: Flight, shown: Replay) -> None:
    raptor = sp.vehicle("raptor50")
    inertia = raptor.card.values()["inertia_xx"]
    draws = [raptor.with_values({"inertia_xx": share * inertia}) for share in (0.8, 1.0, 1.2)]
    found = replay(flight, model=raptor, draws=draws, ahead=1.0)
    assert found.drawn is not None
    assert found.begun is not None
    np.testing.assert_array_equal(found.predicted, shown.predicted)
    np.testing.assert_array_equal(found.drawn[1], shown.predicted)
    k = np.flatnonzero(np.isfinite(found.begun))
    ahead = (found.time - found.begun)[k]
    assert (ahead.min(), ahead.max()) == (pytest.approx(0.02), pytest.approx(1.0))
    apart = np.abs(found.drawn[2] - found.drawn[0])[k, 9]
    assert apart[np.isclose(ahead, 0.02)].max() < 0.25 * apart.max()
    told = as_json(found)
    assert told["drawn"] == 3
    assert [len(row) for row in told["moments"][60][6]] == [12, 12, 12]
    assert told["begun"][60] == pytest.approx(found.begun[60])
    with pytest.raises(SwashError, match="draws: are of no model"):
        replay(flight, draws=draws)


def without(flight: Flight, *names: str) -> Flight:
    return flight.with_streams({key: data.drop_vars(names) for key, data in flight.streams.items()})


def test_an_input_that_was_not_logged_is_never_made_up(flight: Flight, shown: Replay) -> None:
    raptor = sp.vehicle("raptor50")
    assert shown.notes == (), "everything was logged"
    with pytest.raises(FlightError, match=r"lacks B1, A1: .* without them there is no prediction") as told:
        replay(without(flight, "A1", "B1"), model=raptor, ahead=1.0)
    assert "--hold-missing" in str(told.value)
    held = replay(without(flight, "A1", "B1"), model=raptor, ahead=1.0, hold_missing=True)
    (note,) = held.notes
    assert note.startswith("The log has no B1, A1. They are held (B1 at ")
    assert as_json(held)["notes"] == [note]
    column = held.inputs[:, raptor.input_names.index("A1")]
    assert np.ptp(column) == 0.0
    assert float(note.split("A1 at ")[1].split(",")[0]) == pytest.approx(column[0], rel=1e-3)
    assert held.predicted is not None
    assert np.nanmax(np.abs(held.predicted - shown.predicted)) > 0.05, "the doublet was on it"


def test_states_that_were_not_logged_are_told(flight: Flight) -> None:
    bare = without(flight, "b1")
    assert replay(bare, model=sp.vehicle("raptor50"), ahead=1.0).notes == (
        "The log has no b1: every prediction starts with them as at hover.",
    )
    assert replay(bare).notes == ("The log has no b1: they are drawn as at hover.",)


def test_a_logged_wind_blows_in_the_prediction(flight: Flight, shown: Replay) -> None:
    windy = flight.with_channel("wind_north", np.full(flight.time("phi").size, 5.0), like="phi")
    found = replay(windy, model=sp.vehicle("raptor50"), ahead=1.0)
    assert found.predicted is not None
    assert shown.predicted is not None
    assert np.nanmax(np.abs(found.predicted[:, 3] - shown.predicted[:, 3])) > 0.1


def test_without_a_model_it_is_drawn_as_the_vehicle_of_its_inputs(flight: Flight) -> None:
    assert replay(flight).vehicle.card.title == sp.vehicle("raptor50").card.title
    bare = flight.with_streams({name: data.drop_vars("B1") for name, data in flight.streams.items()})
    with pytest.raises(FlightError, match=r"Say what flies: swash live MODEL --replay LOG\."):
        replay(bare)


def test_a_coax_is_predicted_by_its_observer(monkeypatch: pytest.MonkeyPatch) -> None:
    # The calibration itself is the validation's, and minutes of compiling; this log has no delays to find.
    monkeypatch.setattr("swashplate.links.live.replay.calibrate", lambda *_, **__: Nuisance())
    coax = sp.vehicle("coax")
    flown = sp.simulate(coax, "doublet:pitch,0.5s,0.1", controller=sp.hover_hold, lead=3, tail=3)
    log = sp.observe(flown, coax, sensors=QUIET, seed=1).condition(rate=100, cutoff=0)
    found = replay(log, model=coax, draws=[coax], ahead=1.0)
    assert found.predicted is not None
    np.testing.assert_array_equal(found.drawn, found.predicted[None])
    assert any("drawn as at hover" in note for note in found.notes)
    assert any("no battery voltage" in note for note in found.notes) == ("voltage" not in log)
    there = np.isfinite(found.predicted[:, 0])
    assert found.time[there][0] == pytest.approx(log.start + 1.75, abs=0.05), "a quarter of a short log settles"
    assert np.all(there[np.argmax(there) :])
    error = (found.predicted - found.states[:, :12])[there]
    assert np.sqrt(np.mean(error[:, 6:8] ** 2)) < np.radians(1.5)
    assert np.sqrt(np.mean(error[:, :2] ** 2)) < 0.05


@pytest.mark.proof
def test_real_flights_have_the_observers_prediction(flight_july: Path) -> None:
    log = sp.read(flight_july).condition(rate=100, cutoff=0).between(0.0, 8.0)
    found = replay(log, model=sp.vehicle("coax"), ahead=0.5)
    assert found.predicted is not None
    there = np.isfinite(found.predicted[:, 0])
    assert found.time[there][0] == pytest.approx(log.start + 2.0, abs=0.1), "a quarter of a short log calibrates"
    assert np.sqrt(np.mean((found.predicted - found.states[:, :12])[there][:, 6:8] ** 2)) < np.radians(3.0)


def test_the_page_gets_everything_it_draws(shown: Replay) -> None:
    told = as_json(shown)
    assert len(told["moments"]) == len(told["time"]) == shown.time.size
    assert told["time"][0] == 0.0
    low, high = shown.vehicle.input_limits[0]
    assert told["inputs"][0] == {"name": "theta0", "unit": "rad", "low": low, "high": high}
    body, inputs, rotors, bar, tail, ghost, fan = told["moments"][60]
    assert (fan, told["drawn"]) == (None, 0)
    assert body == pytest.approx(shown.states[60, :12].tolist(), rel=1e-4, abs=1e-6)
    assert (len(inputs), len(rotors), bar, len(tail), len(ghost)) == (4, 1, None, 2, 12)
    assert floor(shown) > np.max(shown.states[:, 2])
