"""The coaxial helicopter in flight: sticks of the live page, and an LQG design that holds its place in gusts."""

from __future__ import annotations

import re

import numpy as np
import pytest

import swashplate as sp
from flown_by_hand import fresh, holds_what_is_held, moves_its_way
from flown_here import World
from swashplate.links.live.axes import STICKS
from swashplate.simulation.standing import standing


@pytest.mark.proof
@pytest.mark.parametrize("name", ["coaxial15", "ingenuity"])
def test_the_live_page_flies_it(name: str) -> None:
    world = World(sp.vehicle(name))
    assert fresh(world, "attitude").pilot.modes == ("raw", "held", "attitude", "velocity", "position")
    for axis in STICKS:
        moves_its_way(world, "attitude", axis)
    holds_what_is_held(world, "position")


@pytest.mark.proof
def test_an_lqg_design_holds_its_place() -> None:
    vehicle = sp.vehicle("coaxial15", servos=True, delay=True)
    made = sp.design_controller(vehicle, sensors="imu@100,mocap@100+10ms")
    check = sp.check_controller(vehicle, made.controller, duration=10.0)
    told = re.search(r"all at once: .* delay ([\d.]+) ms", repr(check))
    place = re.search(r"RMS: place ([\d.]+) mm", repr(check))
    assert told is not None
    assert place is not None
    assert float(told[1]) > 60.0
    assert float(place[1]) < 100.0


@pytest.mark.proof
def test_an_open_loop_flight_conserves_what_its_trim_says() -> None:
    vehicle = sp.vehicle("coaxial15")
    trim = sp.trim(vehicle, speed=6.0)
    held = np.tile(trim.inputs, (101, 1))
    flight = sp.simulate(vehicle, held, start=trim, rate=100.0)
    assert np.ptp(flight.values("u")) < 1e-3
    assert standing(vehicle).input_names == ("theta0", "B1", "A1", "theta0d", "throttle")
