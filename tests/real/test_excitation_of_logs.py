"""What moved the inputs of real logs, and of a copter that only its loops hold (made from a public report)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import io

import swashplate as sp
from field_cases import loiter_log
from swashplate.flights.excitation import CONTROLLER, Excitation, excitations
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance

MIXER = ("mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective")


@pytest.mark.parametrize("rate", [10, 25, 50, 100])
def test_a_log_without_a_sweep_is_a_controllers_answer_at_any_rate(
    shared_data: Path, tmp_path: Path, rate: int
) -> None:
    log = sp.read(loiter_log(shared_data, tmp_path / "loiter.bin", rate=rate, seconds=60))
    records = sp.uniform_records(log, ["mixer_roll", "p", "p_demand"])
    for more in ({}, {"references": ["p_demand"]}, {"direct": True}):
        found = sp.respond(records, inputs=["mixer_roll"], outputs=["p"], band=(0.5, min(8.0, 0.3 * rate)), **more)
        assert found.settings["excitation"]["mixer_roll"]["kind"] == CONTROLLER
        assert any("'mixer_roll' is a controller's answer" in text for text in found.problems)
    # Not only because the log holds set-points: the motion alone tells it.
    bare = log.with_streams({"rates": log.streams["rates"][["p", "mixer_roll"]]})
    told = of(bare, "mixer_roll")["mixer_roll"]
    assert told.kind == CONTROLLER
    assert told.shares.answer


def of(flight: Flight, *inputs: str, start: float = 0.0, stop: float = np.inf) -> dict[str, Excitation]:
    """What moved the inputs of a part of a log."""
    part = flight.between(max(start, flight.start), min(stop, flight.stop))
    part = part.with_streams({name: data for name, data in part.streams.items() if data.sizes["time"] > 1})
    return {one.input: one for one in excitations(part, inputs, outputs=[n for n in ("p", "q", "r") if n in part])}


@pytest.mark.parametrize(
    ("name", "swept"),
    [
        ("heli_sid_roll_mix.BIN", "mixer_roll"),
        ("heli_sid_pitch_mix.BIN", "mixer_pitch"),
        ("heli_sid_coll_mix.BIN", "mixer_collective"),
        ("heli_sid_allbits_roll_rate.BIN", "mixer_roll"),
    ],
)
def test_firmware_sweeps_one_input_and_its_loops_answer_with_the_others(
    shared_data: Path, name: str, swept: str
) -> None:
    found = of(sp.read(shared_data / "ardupilot_sitl" / name), *MIXER)
    assert {n: one.kind for n, one in found.items()} == dict.fromkeys(MIXER, CONTROLLER) | {swept: "sweep"}


PARTS = {"loiter": (112, 134), "steps": (137, 172), "roll": (178.4, 221), "pitch": (228, 270), "yaw": (277.5, 320)}
"""Seconds of the log of three sweeps, as its notes have them."""


def test_each_part_of_a_flight_of_firmware_is_what_was_flown(shared_data: Path) -> None:
    log = sp.read(shared_data / "ardupilot_firmware" / "raptor50_three_sweeps.BIN")
    parts = {part: of(log, *MIXER[:3], start=start, stop=stop) for part, (start, stop) in PARTS.items()}
    kinds = {part: {n.removeprefix("mixer_"): one.kind for n, one in found.items()} for part, found in parts.items()}
    assert set(kinds["loiter"].values()) == {CONTROLLER}
    assert set(kinds["steps"].values()) == {"sticks"}
    for axis in ("roll", "pitch", "yaw"):
        assert kinds[axis].pop(axis) == "sweep"
        # The pilot of this log, a program too, holds the other axes with sticks as far as the loops let it.
        assert set(kinds[axis].values()) <= {CONTROLLER, "sticks"}


def test_tables_without_set_points(shared_data: Path) -> None:
    """A sweep of an X8, its parts too; a textbook record of an HFB-320 at 10 Hz; an own table in German."""
    rows = np.loadtxt(shared_data / "x8" / "x8roll.csv", delimiter=",")
    x8 = _table(np.arange(len(rows)) / 100.0, {"command": rows[:, 1], "p": np.radians(rows[:, 2])}, "command")
    assert of(x8, "command")["command"].outside
    for k in range(4):
        assert of(x8, "command", start=25.0 * k, stop=25.0 * (k + 1))["command"].kind != CONTROLLER, k
    numbers = np.array((shared_data / "fvsysid" / "hfb320_1_10.asc").read_text().split(), dtype=float).reshape(601, -1)
    columns = {"elevator": numbers[:, 1], "theta": numbers[:, 6], "q": numbers[:, 7]}
    assert of(_table(numbers[:, 0], columns, "elevator"), "elevator")["elevator"].kind == "maneuver"


def test_textbook_maneuvers_of_others(shared_data: Path) -> None:
    """Elevators of a Twin Otter and of SIDPAC's example, nearly without noise: past motion tells them to 98 %."""
    otter = io.loadmat(shared_data / "sidpac" / "totter_lon_data.mat")
    columns = {name: otter[name].ravel().astype(float) for name in ("de", "q", "alpha", "theta")}
    assert of(_table(otter["t"].ravel(), columns, "de"), "de")["de"].kind == "maneuver"
    example = io.loadmat(shared_data / "sidpac" / "oe_lon_example.mat")
    columns = {"de": example["fdata"][:, 13], "alpha": example["fdata"][:, 3], "q": example["fdata"][:, 5]}
    assert of(_table(example["t"].ravel(), columns, "de"), "de")["de"].kind == "maneuver"


def test_a_pilots_smooth_stick_is_not_taken_for_a_controller(shared_data: Path) -> None:
    """A T-Rex 550's rates follow slow sticks so closely that its past tells them to 97 %."""
    rows = np.genfromtxt(shared_data / "trex550" / "trex550_flight.csv", delimiter=",", names=True)
    sticks = [name for name in rows.dtype.names if name.startswith("stick")]
    flight = _table(rows["time"], {name: rows[name] for name in (*sticks, "phi", "theta", "p", "q", "r")}, *sticks)
    assert {one.kind for one in of(flight, *sticks).values()} == {"sticks"}
    called = {f"delta_{k}": rows[name] for k, name in enumerate(sticks)}
    plain = _table(rows["time"], called | {name: rows[name] for name in ("p", "q", "r")}, *called)
    assert CONTROLLER not in {one.kind for one in of(plain, *called).values()}


def test_the_hover_of_july_is_its_controllers(flight_july: Path) -> None:
    found = of(sp.read(flight_july).condition(rate=100.0, cutoff=0.0), "motor_upper", "motor_lower", "servo_pitch")
    assert {one.kind for one in found.values()} == {CONTROLLER}


def _table(time: np.ndarray, columns: dict[str, np.ndarray], *commands: str) -> Flight:
    return Flight({"log": stream(time, columns, dict.fromkeys(commands, "1"))}, Provenance("table"))
