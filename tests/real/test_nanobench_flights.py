"""The real Crazyflie flights: hashes, frames checked against physics, motors against motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import swashplate as sp
from swashplate.arrays import Array
from swashplate.flights import datasets
from swashplate.flights.flight import Flight
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import records
from swashplate.identification.time.filter_error import FilterError, unrelated

NAME = "nanobench/B2_circle_fast_rep2"


@pytest.fixture(scope="module")
def flight(shared_data: Path) -> Flight:
    if not (shared_data / "nanobench").is_dir():
        pytest.skip("the NanoBench flights are not here")
    return sp.read(NAME)


def test_every_registered_flight_is_found_by_its_hash(flight: Flight) -> None:
    rows = [row for row in datasets.listing() if row.name == "nanobench"]
    assert len(rows) == 11
    assert all(row.found is not None for row in rows)


def test_the_gyroscope_turns_as_the_attitude_does(flight: Flight) -> None:
    """Independent sensors: a wrong sign or axis makes the correlation negative or nothing."""
    cut = flight.condition(rate=100, cutoff=8.0)
    seen = Flight(
        {name: data[["qw", "qx", "qy", "qz"]] for name, data in cut.streams.items() if "qw" in data},
        cut.provenance, cut.history,
    ).condition(rate=100, cutoff=0, outliers=False, trim_ground=False)  # fmt: skip
    for name in ("p", "q", "r"):
        both = np.corrcoef(cut.values(name)[50:-50], seen.values(name)[50:-50])
        assert both[0, 1] > 0.5, name  # 0.72 in r, which hardly moves: an axis or sign amiss would give nothing or less


def test_motors_and_voltage_explain_the_accelerations(flight: Flight) -> None:
    """Which motor is where and how each turns, from the flight alone: signs of d(p, q, r)/dt by (motor x voltage)^2."""
    cut = flight.condition(rate=100, cutoff=0)
    sos = butter(2, (0.5, 8.0), "bandpass", fs=100, output="sos")
    drive = np.stack([cut.values(f"motor_{i}") * cut.values("voltage") for i in (1, 2, 3, 4)], axis=1)
    turning = np.gradient(np.stack([cut.values(name) for name in ("p", "q", "r")], axis=1), 0.01, axis=0)
    late = 5  # samples: of this flight, rotor lag and clocks together
    drive, turning = sosfiltfilt(sos, drive**2, axis=0)[:-late], sosfiltfilt(sos, turning, axis=0)[late:]
    found = np.linalg.lstsq(drive[200:-200], turning[200:-200], rcond=None)[0]
    assert np.array_equal(np.sign(found[:, 0]), (-1, -1, 1, 1))  # 1 and 2 are on the right
    assert np.array_equal(np.sign(found[:, 1]), (1, -1, -1, 1))  # 1 and 4 are ahead
    assert np.array_equal(np.sign(found[:, 2]), (1, -1, 1, -1))  # 1 and 3 turn counter-clockwise from above


@pytest.mark.proof
def test_commands_of_another_time_are_told_from_those_of_the_flight(shared_data: Path) -> None:
    """Of a quadrotor too, before anything is fitted."""
    vehicle = sp.vehicle("crazyflie")
    read = sp.read(f"{NAME}@8-20").condition(rate=100.0, cutoff=0.0)
    pieces = [piece for piece in records(read, vehicle) if piece.time[-1] - piece.time[0] > 6.0]
    assert pieces[0].output_names[-3:] == ("p", "q", "r")  # its gyroscope is read

    def cost(commands: Sequence[Array]) -> float:
        likelihood = FilterError(Parameterization(vehicle, ()), pieces)
        return likelihood.cost_under(commands, likelihood.row.starts())

    assert unrelated(cost, pieces) == ""
    late = [replace(piece, inputs=np.roll(piece.inputs, 437, axis=0)) for piece in pieces]
    assert "does not follow the commands" in unrelated(cost, late)
