"""Logs of unmodified ArduPilot beside the truth of the vehicle that flew: late by what the table says, and no more.

Without the table's loop for a tail the phase of yaw fails; the margins of the loops as flown are those that are
predicted for STABILIZE.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.api.truth_beside import Truth, TruthBeside, beside_truth
from swashplate.arrays import Array
from swashplate.control.analysis.cascade_gains import judge_cascade
from swashplate.control.laws.ardupilot.law import RATE_OF_LOOPS, ArduPilotLaw
from swashplate.control.laws.ardupilot.outputs import HELD, LOGGED, density_gain, output_delays
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.sweeps import sweeps
from swashplate.links.ardupilot.gains import ardupilot_law, read_parameter_file
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES, mixed, mixer_response
from swashplate.links.servos import servo_mapping
from swashplate.simulation.standing import airborne

MEASURED = {"roll": (10.7, 78.3), "pitch": (8.4, 57.3), "yaw": (14.7, 69.0)}
"""Crossover [rad/s] and phase margin [deg] of the loops as flown, from the data set's notes."""
STOP = 8.0
"""Hz: how far of a sweep is judged, as `swash link accept` does."""
ANGLE = 2.7
"""Degrees at 6 Hz that 1.25 ms, half a loop, turn."""


class Flown:
    """A vehicle of the package, the law that it flew under, its log and the truth of its mixer's axes."""

    def __init__(self, folder: Path, name: str, log: str, parameters: str = "") -> None:
        self.vehicle = airborne(sp.vehicle(name))
        self.hover = sp.trim(self.vehicle)
        given = read_parameter_file(folder / parameters) if parameters else {}
        self.law: ArduPilotLaw = ardupilot_law(servo_mapping(name, self.vehicle), self.vehicle, self.hover, given=given)
        self.model = sp.linearize(self.vehicle, self.hover)
        gain = density_gain(self.law.frame, self.hover.environment.air_density)
        moves = mixed(self.law.mixer, self.hover, self.law.parameters, inputs=self.vehicle.input_names)
        self.moves = {axis: gain * moved for axis, moved in moves.items()}
        self.flight: Flight = sp.read(folder / log)
        told = {sweep.axis: sweep for sweep in sweeps(self.flight) if sweep.source == "log"}
        planned = {
            axis: Chirp.planned(a.number, 0.1, (0.5, 20.0), record=40.0, fade=1.0) for axis, a in MIXER_AXES.items()
        }
        self.chirps = {
            axis: replace(chirp, start_hz=told[chirp.axis_name].low, stop_hz=STOP)
            for axis, chirp in planned.items()
            if chirp.axis_name in told
        }

    def beside(self, later: Array, *axes: str) -> TruthBeside:
        late = (HELD + LOGGED) / RATE_OF_LOOPS + later

        def truth(axis: str, output: str, omega: Array) -> np.ndarray:
            return mixer_response(self.model, self.moves[axis], output, omega, delay=late, gravity=9.80665)

        told: Truth = truth
        chirps = {axis: self.chirps[axis] for axis in axes}
        return beside_truth(self.flight, chirps, told, told, rate=100.0, loop=RATE_OF_LOOPS)

    @property
    def later(self) -> Array:
        return output_delays("ardupilot", self.law.frame, len(self.vehicle.input_names), RATE_OF_LOOPS)


@pytest.fixture(scope="module")
def raptor(shared_data: Path) -> Flown:
    return Flown(shared_data / "ardupilot_firmware", "raptor50", "raptor50_three_sweeps.BIN", "raptor50.parm")


@pytest.fixture(scope="module")
def coax(shared_data: Path) -> Flown:
    return Flown(shared_data / "ardupilot_firmware", "coax", "coax_roll_yaw_sweeps.BIN")


def lateness(found: TruthBeside, axis: str) -> float:
    """ms by which the log is later than the truth."""
    (line,) = (line for line in found.lines if line.what == f"{axis}: log later than the truth")
    return float(line.found.split()[0])


def test_every_line_of_a_helicopter_passes_phase_included(raptor: Flown) -> None:
    found = raptor.beside(raptor.later, "roll", "pitch", "yaw")
    judged = [line for line in found.lines if line.passed is not None]
    assert [line for line in judged if not line.passed] == []
    for axis in ("roll", "pitch", "yaw"):
        assert abs(lateness(found, axis)) < 0.3, axis
        (line,) = (line for line in judged if line.what == f"{axis}: respond beside truth")
        assert float(line.found.split()[2]) < 3.0
        assert f"to {2.7 + ANGLE:.1f} deg" in line.expected, "rounded pulses and half a loop"


def test_a_tail_without_its_loop_fails(raptor: Flown) -> None:
    found = raptor.beside(0.0 * raptor.later, "yaw")
    verdicts = {line.what: line.passed for line in found.lines}
    assert verdicts["yaw: respond beside truth"] is False
    assert lateness(found, "yaw") == pytest.approx(1e3 / RATE_OF_LOOPS, abs=0.3)


def test_a_swashplate_with_a_loop_fails(raptor: Flown) -> None:
    """The mutation the other way: the table must not make everything later."""
    found = raptor.beside(np.full(len(raptor.later), 1.0 / RATE_OF_LOOPS), "roll", "pitch")
    for axis in ("roll", "pitch"):
        assert lateness(found, axis) == pytest.approx(-1e3 / RATE_OF_LOOPS, abs=0.3)


def test_motors_of_a_coaxial_leave_at_once_and_its_flaps_later(coax: Flown) -> None:
    found = coax.beside(coax.later, "yaw")
    assert abs(lateness(found, "yaw")) < 0.4
    assert all(line.passed is not False for line in found.lines)
    assert lateness(coax.beside(coax.later, "roll"), "roll") < 1.2
    assert lateness(coax.beside(0.0 * coax.later, "roll"), "roll") > 3.0


@pytest.fixture(scope="module")
def judged(raptor: Flown) -> Callable[[float], dict[str, tuple[float, float]]]:
    def predicted(late: float) -> dict[str, tuple[float, float]]:
        delays = dict.fromkeys(raptor.vehicle.input_names, late)
        found = judge_cascade(raptor.vehicle, raptor.hover, raptor.law, delays=delays)
        return {loop.name: (loop.crossover, loop.phase) for loop in found.stabilize}

    return predicted


def test_margins_are_predicted_for_the_mode_that_was_flown(
    judged: Callable[[float], dict[str, tuple[float, float]]],
) -> None:
    """A SITL has no delay beyond its loops: 4 % of the crossover, 1.5 degrees of the margin."""
    for axis, (crossover, phase) in judged(0.0).items():
        assert crossover == pytest.approx(MEASURED[axis][0], rel=0.04), axis
        assert phase == pytest.approx(MEASURED[axis][1], abs=1.5), axis


def test_what_made_them_too_low(raptor: Flown, judged: Callable[[float], dict[str, tuple[float, float]]]) -> None:
    """5 ms that a SITL has not cost 2 to 4 degrees; the place loop around roll and pitch 10."""
    none, assumed = judged(0.0), judged(0.005)
    whole = judge_cascade(
        raptor.vehicle, raptor.hover, raptor.law, delays=dict.fromkeys(raptor.vehicle.input_names, 0.0)
    )
    around = {loop.name: loop.phase for loop in whole.loops}
    for axis in ("roll", "pitch"):
        assert 2.0 < none[axis][1] - assumed[axis][1] < 4.5, axis
        assert 9.0 < none[axis][1] - around[axis] < 11.0, axis
    assert none["yaw"][1] == pytest.approx(around["yaw"], abs=0.5), "no loop of a place is around it"
