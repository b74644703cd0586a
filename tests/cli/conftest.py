"""Flights that the command line can read, made once a session."""

from __future__ import annotations

from pathlib import Path

import pytest

import swashplate as sp
from swashplate.simulation.sensors import QUIET


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated log of 10 s, as netCDF."""
    coax = sp.vehicle("coax")
    flight = sp.simulate_maneuver(coax, "multisine:roll+pitch,0.4-4Hz,8s,0.1", controller=sp.hover_hold, lead=1, tail=1)
    return sp.observe(flight, coax, sensors=QUIET, seed=3).save(tmp_path_factory.mktemp("flights") / "simulated.nc")
