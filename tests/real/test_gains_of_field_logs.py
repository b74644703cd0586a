"""Gains from logs that people send: which may have some, which may not, and that the reason is said."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import ProcessingStep
from swashplate.identification.frequency.transfer_function_fit import fit_transfer_function
from swashplate.identification.responses.frequency_response import FrequencyResponse

SWEPT = {"kind": "sweep", "words": ""}


def measured(flight: Flight, input: str, output: str, *, rate: float = 100.0) -> FrequencyResponse:
    records = sp.uniform_records(flight, [input, output], rate=rate)
    return sp.respond(records, inputs=[input], outputs=[output])


def gains(responses: FrequencyResponse, form: str) -> Suggestion:
    (one,) = sp.suggest_gains(fit_transfer_function(responses, form, input=responses.inputs[0]), responses)
    return one


def called_swept(responses: FrequencyResponse) -> FrequencyResponse:
    """As if what moved the input were known to be a sweep: the other premises must hold by themselves."""
    return replace(responses, settings={**responses.settings, "excitation": {responses.inputs[0]: SWEPT}})


# ---- a hover in gusts, no sweep --------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def loiter(shared_data: Path) -> Iterator[ModuleType]:
    folder = shared_data / "field" / "01-no-sweep"
    if not folder.is_dir():
        pytest.skip("the field cases are not here")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        spec = util.spec_from_file_location("sim_loiter", folder / "sim_loiter.py")
        assert spec is not None
        assert spec.loader is not None
        module = util.module_from_spec(spec)
        spec.loader.exec_module(module)
        yield module
    sys.modules.pop("df", None)


@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # the case's own writer leaves a file open
@pytest.mark.parametrize("rate", [10, 25, 50, 100])
def test_a_hover_without_a_sweep_gives_no_gains_at_any_rate(loiter: ModuleType, rate: int, tmp_path: Path) -> None:
    """-0.311 was suggested where +0.135 flew."""
    loiter.log(tmp_path / "loiter.bin", loiter.fly(1, dec=400 // rate, T=120))
    responses = measured(sp.read(tmp_path / "loiter.bin"), "mixer_roll", "p", rate=float(rate))
    for asked in (responses, called_swept(responses)):
        for form in ("2/2", "0/1", "1/2"):
            roll = gains(asked, form)
            assert roll.parameters == {}, form
            assert roll.flown["ATC_RAT_RLL_P"] == pytest.approx(0.135)
    assert "mixer_roll" in gains(responses, "2/2").refused
    assert "Fly" in gains(responses, "2/2").refused


# ---- a person's own table, the stick positive to the left ------------------------------------------------------------
@pytest.fixture(scope="module")
def own_table(shared_data: Path) -> Flight:
    """Decimal commas, semicolons, German names and blanks, by hand: the reader is another test's business."""
    file = shared_data / "field" / "flug1_roll.csv"
    if not file.is_file():
        pytest.skip("the field cases are not here")
    lines = [line.replace(",", ".").split(";") for line in file.read_text(encoding="utf-8").splitlines()[1:]]
    table = np.array([[float(cell) for cell in row] for row in lines if all(cell.strip() for cell in row)])
    data = stream(table[:, 0] - table[0, 0], {"p": np.radians(table[:, 3]), "mixer_roll": table[:, 5] / 100.0})
    data["mixer_roll"].attrs["logged_unit"] = "%"
    return Flight({"log": data})


def test_a_stick_that_is_positive_to_the_left_is_told_with_its_remedy_and_gets_no_gains(own_table: Flight) -> None:
    responses = measured(own_table, "mixer_roll", "p")
    assert any("wrong sign" in text and "--unit mixer_roll=-%" in text for text in responses.problems)
    roll = gains(called_swept(responses), "0/1")
    assert roll.parameters == {}
    assert "turns p negative" in roll.refused


def test_with_its_sign_turned_it_gives_the_truth_and_gains(own_table: Flight) -> None:
    """p' = -8 p + 60 u, 40 ms."""
    log = own_table.streams["log"]
    turned = own_table.with_streams({"log": log.assign(mixer_roll=-log["mixer_roll"])})
    responses = measured(turned, "mixer_roll", "p")
    assert not any("sign" in text for text in responses.problems)
    fit = fit_transfer_function(responses, "0/1", input="mixer_roll")
    assert fit["K"].value == pytest.approx(60.0, rel=0.05)
    (roll,) = sp.suggest_gains(fit, called_swept(responses))
    assert roll.parameters["ATC_RAT_RLL_FF"] == pytest.approx(8.0 / 60.0, rel=0.05)
    assert roll.parameters["ATC_RAT_RLL_P"] > 0.0


# ---- autopilots that this program does not tune ----------------------------------------------------------------------
@pytest.mark.parametrize(
    ("file", "told"), [("10-bf-chirp/chirp_small.bbl", "Betaflight"), ("03-plane-modes/plane_sweep.bin", "ArduPlane")]
)
def test_no_gains_in_the_names_of_another_autopilot(shared_data: Path, file: str, told: str) -> None:
    place = shared_data / "field" / file
    if not place.is_file():
        pytest.skip("the field cases are not here")
    roll = gains(called_swept(measured(sp.read(place), "mixer_roll", "p")), "0/2")
    assert roll.parameters == {}
    assert told in roll.refused
    assert "none that this program tunes" in roll.refused
    assert "ATC_RAT" not in repr(roll)


@pytest.mark.parametrize(("name", "told"), [("plane", "ArduPlane"), ("rover", "Rover"), ("sub", "Sub")])
def test_the_firmware_of_every_ardupilot_vehicle_is_known(shared_data: Path, name: str, told: str) -> None:
    place = shared_data / "field" / "03-plane-modes" / f"{name}.bin"
    if not place.is_file():
        pytest.skip("the field cases are not here")
    assert told in sp.read(place).provenance.autopilot


# ---- logs that must have gains ---------------------------------------------------------------------------------------
def test_every_swept_axis_of_real_firmware_has_gains(shared_data: Path) -> None:
    """Seven swept axes of genuine ArduPilot and Copter logs: every one passes every premise."""
    sitl, firmware = shared_data / "ardupilot_sitl", shared_data / "ardupilot_firmware"
    if not firmware.is_dir():
        pytest.skip("the firmware's logs are not here")
    logs = {name: sp.read(firmware / f"{name}.BIN") for name in ("raptor50_three_sweeps", "coax_roll_yaw_sweeps")}
    unchecked = ProcessingStep("consistency_not_checked")
    logs = {name: replace(log, history=(*log.history, unchecked)) for name, log in logs.items()}
    logs |= {axis: sp.read(sitl / f"heli_sid_{axis}_mix.BIN") for axis in ("roll", "pitch")}
    asked = {
        ("raptor50_three_sweeps", "roll"): "0/2", ("raptor50_three_sweeps", "pitch"): "0/2",
        ("raptor50_three_sweeps", "yaw"): "0/1", ("coax_roll_yaw_sweeps", "yaw"): "0/1",
        ("roll", "roll"): "0/2", ("pitch", "pitch"): "0/2",
    }  # fmt: skip
    sweeps = {name: sp.inspect(log).sweeps for name, log in logs.items()}
    for (name, axis), form in asked.items():
        log, moved, turned = logs[name], f"mixer_{axis}", {"roll": "p", "pitch": "q", "yaw": "r"}[axis]
        (sweep,) = (one for one in sweeps[name] if axis in one.axis)
        responses = measured(log.between(sweep.start - 1.0, sweep.stop + 1.0), moved, turned)
        assert not any("sign" in text for text in responses.problems), (name, axis)
        one = gains(called_swept(responses), form)
        assert one.refused == "", (name, axis, one.refused)
        assert all(value >= 0.0 for value in one.parameters.values())
