"""Genuine ArduPilot and PX4 logs: what was flown is found, and every number is the one that the log holds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import START_DELAY, Chirp
from swashplate.flights.maneuvers.sweeps import sweeps
from swashplate.flights.readers.dataflash import messages
from swashplate.flights.readers.read import read
from swashplate.identification.responses.respond import respond

# NOTES.md beside the logs: file, axis, magnitude, band, fades and record as flown, rate of the fast messages.
FLOWN = [
    ("heli_sid_roll_mix.BIN", 10, 0.15, (0.15, 18.0), (4.0, 1.0), 55.0, 200.0),
    ("heli_sid_pitch_mix.BIN", 11, 0.15, (0.15, 15.0), (4.0, 1.0), 56.0, 100.0),
    ("heli_sid_coll_mix.BIN", 13, 0.08, (0.15, 12.0), (4.0, 1.0), 56.0, 100.0),
    ("heli_sid_allbits_roll_rate.BIN", 7, 15.0, (1.5, 10.0), (0.5, 0.5), 3.0, 400.0),
]


@pytest.fixture(scope="module")
def logs(shared_data: Path) -> dict[str, Flight]:
    return {name: read(shared_data / "ardupilot_sitl" / name) for name, *_ in FLOWN}


@pytest.mark.parametrize(("name", "axis", "magnitude", "band", "fades", "record", "rate"), FLOWN)
def test_a_sitl_log_says_what_was_flown(
    logs: dict[str, Flight],
    name: str,
    axis: int,
    magnitude: float,
    band: tuple[float, float],
    fades: tuple[float, float],
    record: float,
    rate: float,
) -> None:
    flight = logs[name]
    assert flight.provenance.damage == ()
    assert flight.rate("p") == pytest.approx(rate, rel=1e-3)
    assert flight.rate("phi") == flight.rate("mixer_roll")
    (sweep,) = (event for event in flight.provenance.events if event.kind == "sweep")
    flown = sweep.details
    assert (flown["axis"], flown["record"]) == (axis, record)
    assert (flown["fade_in"], flown["fade_out"]) == fades
    assert_allclose([flown["start_hz"], flown["stop_hz"], flown["magnitude"]], [*band, magnitude], rtol=1e-6)
    assert flown["stop"] - flown["start"] == pytest.approx(record, abs=0.02)  # its clock counts loops
    assert "SYSTEMID" in [event.text for event in flight.provenance.events if event.kind == "mode"]
    assert flight.provenance.parameter("FRAME_CLASS") == 6.0
    assert flight.provenance.parameter("SID_AXIS", at=flown["start"]) == axis


@pytest.mark.parametrize("name", [row[0] for row in FLOWN])
def test_the_chirp_is_the_one_that_arducopter_computed(logs: dict[str, Flight], shared_data: Path, name: str) -> None:
    (sweep,) = (event for event in logs[name].provenance.events if event.kind == "sweep")
    chirp = Chirp(**{key: value for key, value in sweep.details.items() if key in Chirp.__dataclass_fields__})
    # By the mode's own clock, which counts loops and is not the stamps'.
    logged = messages((shared_data / "ardupilot_sitl" / name).read_bytes()).tables["SIDD"]
    own = logged.number("Time") - START_DELAY
    # Single precision: 330 periods make 2,000 rad, which are rounded to 1.2e-4 rad at each step.
    assert np.abs(logged.number("Targ") - chirp.signal(own)).max() < 1e-3 * chirp.magnitude
    assert_allclose(logged.number("F"), chirp.frequency(own), rtol=1e-6)
    assert logs[name].values("sid_target").size == len(logged)


def test_hover_has_the_right_signs(logs: dict[str, Flight]) -> None:
    flight = logs["heli_sid_coll_mix.BIN"]
    assert np.median(flight.values("az")) == pytest.approx(-9.81, abs=0.05)
    assert np.median(flight.values("z")) < -20.0  # flown at 40 m
    assert np.median(flight.values("omega_rotor")) == pytest.approx(1500.0 * 2 * np.pi / 60, rel=1e-3)
    roll = logs["heli_sid_roll_mix.BIN"]
    # Positive mixer command rolls right (NOTES): at low frequency the rate follows it.
    t = np.arange(110.0, 125.0, 0.02)
    command, rate = (np.interp(t, roll.time(n), roll.values(n)) for n in ("mixer_roll", "p"))
    assert np.corrcoef(command, rate)[0, 1] > 0.9
    assert np.polyfit(command, rate, 1)[0] == pytest.approx(3.6, rel=0.2)


def test_an_early_px4_log(shared_data: Path) -> None:
    flight = read(shared_data / "logs" / "2016-07-14_06_53_11.px4log")
    assert flight.provenance.reader == "px4log"
    assert flight.provenance.damage == ()
    assert len(flight.provenance.parameters) > 600
    assert flight.duration == pytest.approx(42.2, abs=0.1)
    assert np.median(flight.values("az")) == pytest.approx(-9.7, abs=0.2)  # on the ground, forward-right-down
    assert set(flight.channels) >= {"phi", "p", "mixer_roll", "x", "vx", "rcout_1", "voltage"}


def test_a_dataflash_log_of_four_messages_with_a_sensor_on_its_back(shared_data: Path) -> None:
    flight = read(shared_data / "logs" / "dataflash_reference.bin")
    assert flight.rate("az") == pytest.approx(181.0, rel=0.01)
    assert flight.rate("phi") == pytest.approx(49.8, rel=0.01)
    assert any("forward-right-down" in note for note in flight.provenance.notes)


@pytest.mark.parametrize("name", ["heli_sid_roll_mix.BIN", "heli_sid_pitch_mix.BIN", "heli_sid_coll_mix.BIN"])
def test_the_sweep_is_also_seen_in_the_commands_alone(logs: dict[str, Flight], name: str) -> None:
    flight = logs[name]
    (told,) = sweeps(flight)
    streams = {key: data for key, data in flight.streams.items() if key != "system_identification"}
    blind = replace(flight, provenance=replace(flight.provenance, events=()), streams=streams)
    (seen,) = sweeps(blind)
    assert (
        seen.channel
        == {10: "mixer_roll", 11: "mixer_pitch", 13: "mixer_collective"}[
            next(e.details["axis"] for e in flight.provenance.events if e.kind == "sweep")
        ]
    )
    # The loop takes most of the slow end out of the command: it is seen some seconds late.
    assert seen.start == pytest.approx(told.start, abs=9.0)
    assert seen.stop == pytest.approx(told.stop, abs=1.0)
    assert seen.low == pytest.approx(told.low, rel=0.2)
    assert seen.high == pytest.approx(told.high, rel=0.1)


def test_a_betaflight_chirp_is_told_by_its_own_fields(shared_data: Path) -> None:
    flight = read(shared_data / "field" / "10-bf-chirp" / "chirp_small.bbl")
    (told,) = sweeps(flight)
    assert (told.axis, told.source, told.channel, told.complete) == ("roll rate", "log", "mixer_roll", True)
    assert (told.start, told.stop) == pytest.approx((8.0, 28.0), abs=0.01)
    assert (told.low, told.high) == (0.2, 600.0)
    found = respond(uniform_records([flight], ("mixer_roll", "p"), rate=250.0), inputs=["mixer_roll"], outputs=["p"])
    # Beyond half the rate the chirp is folded: there it is nobody's reference.
    assert found.settings["sweeps"] == ["mixer_roll: 8.0 to 23.8 s, 0.2 to 112 Hz, by the log's law"]
    inside = (found.omega > 2.0 * np.pi * 0.5) & (found.omega < 2.0 * np.pi * 10.0)
    plant = 2793.0 / ((1j * found.omega + 5.0) * (1j * found.omega + 40.0))
    ratio = np.abs(found.response[:, 0, 0] / plant)[inside]
    assert np.ptp(20.0 * np.log10(ratio)) < 1.0


def test_a_real_multirotor_sweep_is_seen_in_a_bare_table(shared_data: Path) -> None:
    columns = {"time": {"column": 1, "unit": "s"}, "controller": {"column": 2, "unit": "1"}}
    flight = read(shared_data / "x8" / "x8roll.csv", mapping={"header": False, "channels": columns})
    (seen,) = sweeps(flight)
    assert seen.channel == "controller"
    assert seen.low < 0.2
    assert seen.high == pytest.approx(14.0, rel=0.2)
    assert seen.stop == pytest.approx(70.0, abs=1.0)


def test_nothing_is_seen_where_nothing_was_swept(shared_data: Path, flight_august: Path) -> None:
    names = ("time", "stick_lateral", "stick_longitudinal", "stick_pedal", "stick_collective")
    columns = {name: {"column": name, "unit": "s" if name == "time" else "1"} for name in names}
    for flight in (
        read(shared_data / "trex550" / "trex550_flight.csv", mapping={"channels": columns}),
        read(flight_august),
    ):
        assert sweeps(flight) == ()
