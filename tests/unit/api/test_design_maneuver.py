"""`design_maneuver`: a better flight than a sweep, within its limits, or a refusal that says why."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.api.designed_maneuver import DesignedManeuver
from swashplate.api.maneuver_script import maneuver_script
from swashplate.errors import IdentificationError, ManeuverError, SwashError
from swashplate.filtering.disturbances import Noise
from swashplate.flights.maneuvers.composed import ComposedMultisine, composed

UNKNOWN = ("tau_f_upper", "linkage_lower")
LIMITS = {"attitude": 15.0, "rate": 120.0, "place": 1.0, "seconds": 10.0}


@lru_cache(maxsize=1)
def designed() -> DesignedManeuver:
    return sp.design_maneuver(
        sp.vehicle("coax"), UNKNOWN, limits=LIMITS, axes=("roll", "pitch"), band=(0.5, 8.0), draws=1, spread=0.0
    )


def test_it_tells_more_than_a_sweep_of_the_same_length_and_keeps_the_limits() -> None:
    made = designed()
    offers = {offer.kind: offer for offer in made.offers}
    assert made.best is offers["multisine"]
    for name in UNKNOWN:
        assert made.best.bounds[name] < offers["sweep"].bounds[name]
    for offer in made.offers:
        assert offer.seconds <= LIMITS["seconds"] + 0.1
        for name in ("attitude", "rate", "place"):
            assert offer.peaks[name] <= LIMITS[name]
    (piece,) = made.best.pieces
    again = sp.simulate(made.vehicle, piece, controller=sp.hover_hold, rate=100.0)
    assert np.degrees(np.ptp(again.values("phi"))) <= 2.0 * LIMITS["attitude"]


def test_an_identified_model_is_designed_for_the_noise_of_its_own_flights() -> None:
    asked: dict[str, Any] = {"limits": LIMITS, "axes": ("roll", "pitch"), "band": (0.5, 8.0), "draws": 1, "spread": 0.0}
    quiet = {
        name: (0.1 if name.startswith(("white", "gust", "drift", "sensor")) else 1.0) * value
        for name, value in Noise()._asdict().items()
    }
    vehicle = sp.vehicle("coax")
    made = sp.design_maneuver(vehicle.with_card(replace(vehicle.card, observer={"noise": quiet})), UNKNOWN, **asked)
    for name in UNKNOWN:  # not quite a tenth: what is known of the delay beforehand does not shrink
        np.testing.assert_allclose(made.best.bounds[name] / designed().best.bounds[name], 0.1, rtol=0.1)
    assert "(noise of the model's flights)" in made.card()
    assert "(noise usual indoors)" in designed().card()
    windy = vehicle.with_card(replace(vehicle.card, observer={"noise": quiet | {"wind": 1.0}}))
    again = sp.design_maneuver(windy, UNKNOWN, **asked)  # the gusts beside a wind say too little
    assert again.noise == "usual indoors"
    assert again.best.bounds == designed().best.bounds


def test_the_script_for_an_autopilot_asks_for_the_designs_motion() -> None:
    made = designed()
    (piece,) = made.best.pieces
    assert isinstance(piece, ComposedMultisine)
    slow = {axis: tuple(line for line in own if line[0] <= 25) for axis, own in piece.lines.items()}
    pieces = (replace(piece, lines=slow),)
    text = maneuver_script(replace(made, offers=(replace(made.best, pieces=pieces),)))
    flight = sp.simulate(made.vehicle, pieces[0], controller=sp.hover_hold, tail=0.0)
    rolled = flight.values("phi")[-1001:-1]
    number, amplitude, phase = map(float, re.findall(r"roll = \{\{(\d+), (\S+), ([^}]+)\}", text)[0])
    time = np.arange(1000) / 100.0
    line = 2.0 * np.mean(np.degrees(rolled) * np.exp(-2j * np.pi * number * time / 10.0))
    np.testing.assert_allclose(amplitude * np.exp(1j * phase), line, rtol=1e-4)
    assert "local ATTITUDE, RATE, PLACE = 15.0, 120.0, 1.0" in text


def test_what_a_script_cannot_fly_is_refused() -> None:
    made = designed()
    (piece,) = made.best.pieces
    assert isinstance(piece, ComposedMultisine)
    fast = {axis: tuple((n + 30, a, phase) for n, a, phase in own) for axis, own in piece.lines.items()}
    above = replace(made, offers=(replace(made.best, pieces=(replace(piece, lines=fast),)),))
    with pytest.raises(ManeuverError, match=r"% of the design's power lies above 3 Hz"):
        maneuver_script(above)
    sweep = next(offer for offer in made.offers if offer.kind == "sweep")
    with pytest.raises(ManeuverError, match="the best offer is the sweep"):
        maneuver_script(replace(made, offers=(sweep,)))


def test_more_seconds_buy_less_each() -> None:
    times, bounds = zip(*((t, b["tau_f_upper"]) for t, b in designed().buys), strict=True)
    np.testing.assert_allclose(times, [2.5, 5.0, 10.0, 20.0])
    assert np.all(np.diff(bounds) < 0.0)
    np.testing.assert_allclose(bounds[0] / bounds[2], 2.0, rtol=0.2)  # the delay's prior helps the shorter one


def test_an_amplitude_and_a_battery_are_limits_and_no_wishes() -> None:
    """0.3 of the yaw axis would turn a CoaX at 17,000 deg/s; a battery holds the hovers about each sweep too."""
    asked: dict[str, Any] = {"axes": ("roll", "yaw"), "band": (0.5, 8.0), "draws": 1, "spread": 0.0}
    made = sp.design_maneuver(sp.vehicle("coax"), UNKNOWN, limits=LIMITS | {"amplitude": 0.3, "battery": 17.0}, **asked)
    assert [offer.kind for offer in made.offers] == ["multisine"]
    (piece,) = made.best.pieces
    tops = {axis: np.max(np.abs(one)) for axis, one in piece.signals(np.arange(1000) * 0.01).items()}
    assert 0.0 < tops["yaw"] < 0.01 < tops["roll"] <= 0.3
    assert made.best.peaks["rate"] > 20.0


def test_a_flight_card_names_the_aircraft_and_gives_bounds_in_percent() -> None:
    card = designed().card()
    assert card.startswith("FLIGHT CARD   Skybotix CoaX coaxial micro helicopter")
    assert re.search(r"should be tau_f_upper [\d.]+ %, linkage_lower [\d.]+ % \(", card)


def test_its_files_are_the_series_and_the_card(tmp_path: Path) -> None:
    written = designed().save(tmp_path / "design.csv")
    assert [path.name for path in written] == ["design.csv", "design.txt"]
    flight, (piece,) = sp.read(tmp_path / "design.csv"), designed().best.pieces
    np.testing.assert_allclose(flight.values("roll"), piece.signals(flight.time("roll"))["roll"], atol=1e-12)
    card = (tmp_path / "design.txt").read_text(encoding="utf-8")
    for words in ("FLIGHT CARD", "both rotor speeds", "multisine of roll+pitch", "Stop", "15 deg"):
        assert words in card
    json.dumps(designed().to_document(), default=str)
    with pytest.raises(ManeuverError, match=r"expected \.csv"):
        designed().save(tmp_path / "design.txt")


@pytest.mark.parametrize(
    ("unknown", "asked", "words"),
    [
        (UNKNOWN, {"limits": {"height": 3.0}}, "height: is no limit"),
        (UNKNOWN, {"limits": {"attitude": 0.0}}, "attitude: is 0, expected a number above zero"),
        (UNKNOWN, {"limits": {"seconds": 40.0, "battery": 30.0}}, "battery: 40 s and 6 s of hover are more"),
        (UNKNOWN, {"limits": {"seconds": 2.0}}, r"seconds: 2 s hold 0.6 periods .* Fly at least 6\.67 s"),
        (UNKNOWN, {"axes": ("roll", "loop")}, "loop: is no axis of 'coax'"),
        (UNKNOWN, {"criterion": "E"}, "'E' is unknown, expected one of D, A"),
        (UNKNOWN, {"band": (8.0, 0.5)}, "expected two rising numbers"),
        (UNKNOWN, {"band": (0.5, 45.0)}, "expected it to rise to at most 40 Hz"),
    ],
)
def test_what_makes_no_sense_is_refused(unknown: Any, asked: dict[str, Any], words: str) -> None:
    with pytest.raises(SwashError, match=words):
        sp.design_maneuver(sp.vehicle("coax"), unknown, **asked)


def test_what_no_maneuver_tells_is_refused() -> None:
    """In hover a body's drag has no slope: no signal however long tells it."""
    asked: dict[str, Any] = {"limits": LIMITS, "axes": ("roll", "pitch"), "band": (0.5, 8.0), "draws": 1}
    with pytest.raises(ManeuverError, match=r"no maneuver within the limits tells it: .* drag_x not at all"):
        sp.design_maneuver(sp.vehicle("coax"), ("tau_f_upper", "drag_x"), **asked)


def test_what_these_seconds_do_not_tell_is_refused_with_those_that_would() -> None:
    asked: dict[str, Any] = {"axes": ("roll", "pitch"), "band": (0.5, 8.0), "draws": 1}
    with pytest.raises(ManeuverError, match=r"tau_f_upper 6\d.*%, expected at most 50 %.* It would take 1\d.* s"):
        sp.design_maneuver(sp.vehicle("coax"), UNKNOWN, limits=LIMITS | {"attitude": 6.0, "rate": 60.0}, **asked)


def test_limits_that_nothing_keeps_are_refused() -> None:
    asked: dict[str, Any] = {"axes": ("roll", "pitch"), "band": (0.5, 8.0), "draws": 1}
    with pytest.raises(ManeuverError, match=r"feasible: multisine: not even .* \(its place is the first"):
        sp.design_maneuver(sp.vehicle("coax"), UNKNOWN, limits=LIMITS | {"place": 1e-9}, **asked)
    with pytest.raises(IdentificationError, match="is no parameter"):
        sp.design_maneuver(sp.vehicle("coax"), ("nothing",), limits=LIMITS)


def test_a_composed_multisine_has_its_lines_its_peak_and_no_jump() -> None:
    made = composed({"roll": {3: 1.0, 7: 4.0, 20: 1e-9}}, duration=5.0, peak={"roll": 0.2})
    assert isinstance(made, ComposedMultisine)
    assert made.band == (0.6, 1.4)  # the faint line is left out
    time = np.arange(5000) / 1000.0
    signal = made.signals(time)["roll"]
    assert np.abs(signal).max() == pytest.approx(0.2, rel=1e-3)
    assert abs(signal[0]) < 1e-9
    power = np.abs(np.fft.rfft(signal)) ** 2
    np.testing.assert_allclose(power[7] / power[3], 4.0, rtol=1e-6)
    assert power[[i for i in range(50) if i not in (3, 7)]].max() < 1e-12 * power[7]
    np.testing.assert_allclose(made.scaled(0.5).signals(time)["roll"], 0.5 * signal, atol=1e-15)
    one = composed({"yaw": {4: 1.0}}, duration=2.0, peak={"yaw": 0.1}).signals(time[:2000])["yaw"]
    assert np.abs(one).max() == pytest.approx(0.1, rel=1e-3)
