"""What moved an input: each thing that a log may know, and that none of it is believed without need."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import chirp

from simulated_loops import Case, fly
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.excitation import Excitation, excitations, of_inputs
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Event, Provenance

HOVER = Case(11, gains=(0.15, 0.1, 0.0, 1.2, 0.0), log=50.0, autopilot=True, seconds=30.0)
RATE_STEPS = replace(HOVER, shape="steps", place="rate", size=1.0)
STICK = replace(HOVER, shape="by hand", place="attitude", size=0.6)
SPEED = replace(HOVER, gains=(0.15, 0.1, 0.0, 1.2, 0.03), gust=(0.5, 0.5, 1.0))
OPEN = replace(HOVER, gains=(0.0,) * 5, shape="doublets", size=0.05, autopilot=False)
SWEEP = {"start": 2.0, "stop": 28.0, "seen": 28.0, "start_hz": 0.2, "stop_hz": 8.0}


@pytest.fixture(scope="module")
def flown() -> dict[str, Flight]:
    cases = {"hover": HOVER, "steps": RATE_STEPS, "stick": STICK, "speed": SPEED, "open": OPEN}
    return {name: one.flight for name, one in zip(cases, fly(list(cases.values())), strict=True)}


def with_channels(flight: Flight, **channels: Any) -> Flight:
    """The flight with channels changed, or left out where they are None."""
    (name, data), *_ = flight.streams.items()
    table = {str(k): v.values for k, v in data.data_vars.items()} | channels
    units = dict.fromkeys(table, "1")
    kept = {k: v for k, v in table.items() if v is not None}
    known = {k: str(data[k].attrs["units"]) for k in data.data_vars if k in kept}
    return flight.with_streams({name: stream(data["time"].values, kept, units | known)})


def with_events(flight: Flight, *events: Event) -> Flight:
    return replace(flight, provenance=replace(flight.provenance, events=events))


def judged(flight: Flight, name: str = "mixer_roll", **asked: Any) -> Excitation:
    (found,) = excitations(flight, [name], outputs=["p"], **asked)
    return found


def test_an_autopilots_command_without_sweep_stick_or_set_point_is_its_answer(flown: dict[str, Flight]) -> None:
    found = judged(flown["hover"])
    assert found.kind == "controller"
    assert not found.outside
    assert "neither a sweep nor a stick nor a set-point" in found.why


@pytest.mark.parametrize("rate", [10, 50])
def test_it_is_so_at_any_rate_and_however_noisy(flown: dict[str, Flight], rate: int) -> None:
    """Knowledge counts where the motion tells nothing: the rate is drowned in noise."""
    thin = round(50 / rate)
    (name, data), *_ = flown["hover"].streams.items()
    slow = flown["hover"].with_streams({name: data.isel(time=slice(None, None, thin))})
    noise = np.random.default_rng(1).standard_normal(slow.values("p").size)
    deaf = with_channels(slow, p=noise, phi=None)
    assert judged(with_channels(deaf, p_demand=None, phi_demand=None)).kind == "maneuver", "nothing is known"
    still = with_channels(deaf, p_demand=0.0 * noise)
    assert judged(still).kind == "controller"


def test_a_sweep_on_the_inputs_axis_is_one_and_on_another_axis_is_none(flown: dict[str, Flight]) -> None:
    roll, pitch = (Event(2.0, "sweep", f"{axis} mixer, 0.2-8 Hz in 26 s", SWEEP) for axis in ("roll", "pitch"))
    found = judged(with_events(flown["hover"], roll))
    assert found.kind == "sweep"
    assert "roll mixer" in found.why
    assert judged(with_events(flown["hover"], pitch)).kind == "controller"
    late = Event(99.0, "sweep", "roll mixer", {**SWEEP, "start": 99.0, "stop": 120.0, "seen": 120.0})
    assert judged(with_events(flown["hover"], late)).kind == "controller", "it is not in this record"


def test_sticks_and_set_points_that_move_by_themselves_move_the_input(flown: dict[str, Flight]) -> None:
    stick = judged(flown["stick"])
    assert stick.kind == "sticks"
    assert "stick_roll" in stick.why
    steps = judged(with_channels(flown["steps"], stick_roll=None))
    assert steps.kind == "reference"
    assert "'p_demand' moved by itself" in steps.why


def test_another_axis_stick_is_none_of_this_axis(flown: dict[str, Flight]) -> None:
    moved = with_channels(flown["hover"], stick_pitch=flown["hover"].values("mixer_roll") * 5.0)
    assert judged(moved).kind == "controller"
    assert judged(with_channels(flown["hover"], stick_roll=flown["hover"].values("mixer_roll") * 5.0)).kind == "sticks"


def test_received_pulses_belong_to_the_axis_that_the_autopilot_says(flown: dict[str, Flight]) -> None:
    pulses = 1.5e-3 + 4e-4 * flown["stick"].values("stick_roll")
    received = with_channels(flown["stick"], stick_roll=None, p_demand=0.0 * pulses, rcin_2=None)
    (name, data), *_ = received.streams.items()
    received = received.with_streams({name: data.assign(rcin_2=("time", pulses, {"units": "s"}))})
    assert judged(received).kind == "controller", "channel 2 is pitch, where nothing else is said"
    said = replace(received, provenance=replace(received.provenance, parameters={"RCMAP_ROLL": 2.0}))
    assert judged(said).kind == "sticks"


def test_a_set_point_that_holds_a_speed_is_an_answer_too(flown: dict[str, Flight]) -> None:
    """The outer loop's set-point moves, and what it answers may not even be logged: resting sticks then decide."""
    assert judged(with_channels(flown["speed"], v=None)).kind == "controller"
    assert judged(with_channels(flown["speed"], v=None), references=["p_demand"]).kind == "controller"
    assert judged(flown["speed"]).kind == "controller"


def test_a_reference_that_is_named_moved_it_or_did_not(flown: dict[str, Flight]) -> None:
    assert judged(flown["steps"], references=["p_demand"]).kind == "reference"
    assert judged(flown["hover"], references=["p_demand"]).kind == "controller"
    injected = np.random.default_rng(2).standard_normal(flown["hover"].time("p").size)
    lone = with_channels(flown["hover"], sid_target=injected)
    assert judged(lone, references=["sid_target"]).kind == "controller", "the input does not follow it"


def test_an_injected_reference_was_on_the_axis_that_the_log_says(flown: dict[str, Flight]) -> None:
    copied = with_channels(flown["hover"], sid_target=flown["hover"].values("mixer_roll"))
    assert judged(copied, references=["sid_target"]).kind == "reference"
    pitch = Event(2.0, "sweep", "pitch mixer, 0.2-8 Hz in 26 s", SWEEP)
    assert judged(with_events(copied, pitch), references=["sid_target"]).kind == "controller"


def test_without_set_points_the_motion_decides(flown: dict[str, Flight]) -> None:
    plain = with_channels(flown["hover"], p_demand=None, phi_demand=None, stick_roll=None)
    found = judged(plain)
    assert found.kind == "controller"
    assert found.shares.answer
    assert "the motion that follows tells it no better" in found.why
    moved = judged(flown["open"], "command")
    assert moved.kind == "maneuver"
    assert judged(flown["open"], "command", swept=["command"]).kind == "sweep"
    assert judged(plain, swept=["mixer_roll"]).kind == "controller", "a sweep that is only seen does not outweigh that"


def test_a_stick_is_a_stick_unless_it_answers(flown: dict[str, Flight]) -> None:
    rename = {"command": None, "stick_roll": flown["open"].values("command")}
    assert judged(with_channels(flown["open"], **rename), "stick_roll").kind == "sticks"
    held = with_channels(flown["hover"], p_demand=None, phi_demand=None, stick_roll=flown["hover"].values("mixer_roll"))
    assert judged(held, "stick_roll").kind == "controller", "somebody else than a pilot moves it"


def test_what_never_moves_or_is_too_short_is_unknown(flown: dict[str, Flight]) -> None:
    still = with_channels(flown["open"], command=np.zeros(flown["open"].time("p").size))
    assert judged(still, "command").kind == "unknown"
    short = judged(flown["open"].between(0.0, 1.0), "command")
    assert (short.kind, short.outside) == ("unknown", False)


def test_one_record_of_several_is_enough(flown: dict[str, Flight]) -> None:
    plain = with_channels(flown["hover"], p_demand=None, phi_demand=None, stick_roll=None)
    other = with_channels(flown["open"], mixer_roll=flown["open"].values("command"), command=None)
    found = excitations([plain, other], ["mixer_roll"], outputs=["p"])
    assert [one.kind for one in found] == ["controller", "maneuver"]
    assert of_inputs(found)["mixer_roll"].kind == "maneuver"
    assert of_inputs(found[:1])["mixer_roll"].kind == "controller"


def test_what_moved_an_input_stays_beside_the_channels_that_are_asked_for(flown: dict[str, Flight]) -> None:
    """Sticks and speed lie in streams of their own, at 10 Hz; the record at one rate still tells of them."""
    flight = flown["stick"]
    (name, data), *_ = flight.streams.items()
    slow = {"received": data[["stick_roll"]].isel(time=slice(None, None, 5))}
    apart = flight.with_streams({name: data.drop_vars("stick_roll"), **slow})
    (record,) = uniform_records(apart, ["mixer_roll", "p"], rate=50.0)
    assert record.stream_of("stick_roll") != record.stream_of("p")
    assert judged(record).kind == "sticks"


@pytest.mark.parametrize(("high", "noise"), [(3.0, 0.0), (3.0, 0.3), (8.5, 0.0), (8.5, 0.3)])
def test_a_programs_sweep_in_calm_air_is_a_sweep(high: float, noise: float) -> None:
    """Past motion tells a smooth sweep through a lag of the first order; so it is asked whether it is one tone."""
    time, random = np.arange(0.0, 40.0, 0.02), np.random.default_rng(6)
    stick = chirp(time, 0.3, 40.0, high, phi=-90)
    rate = np.convolve(stick, np.exp(-5.0 * time[:100]) * 0.1, "full")[: time.size]
    seen = rate + noise * np.std(rate) * random.standard_normal(time.size)
    columns = {"command": stick, "p": seen, "phi": np.cumsum(rate) * 0.02}
    flight = Flight({"uniform": stream(time, columns, {"command": "1"})}, Provenance("chirp"))
    assert judged(flight, "command", swept=["command"]).kind == "sweep"


@pytest.mark.parametrize("pure", [True, False])
def test_a_sweep_in_the_command_counts_beside_set_points_that_rest_only_where_it_is_pure(
    flown: dict[str, Flight], pure: bool
) -> None:
    """An ArduPlane swept in MANUAL logs its rate demands, which never move."""
    time = flown["hover"].time("p")
    tone = 0.15 * chirp(time, 0.3, time[-1], 6.0)
    answered = flown["hover"].values("mixer_roll") / np.std(flown["hover"].values("mixer_roll"))
    log = with_channels(flown["hover"], mixer_roll=tone if pure else tone + 0.1 * answered, p_demand=0.0 * time)
    assert judged(log, swept=["mixer_roll"]).kind == ("sweep" if pure else "controller")
    assert judged(log).kind == "controller", "nothing was seen in it"
