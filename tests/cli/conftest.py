"""Flights that the command line can read, made once a session."""

from __future__ import annotations

from pathlib import Path

import pytest

from simulated_flights import ten_seconds


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated log of 10 s, as netCDF."""
    return ten_seconds().save(tmp_path_factory.mktemp("flights") / "simulated.nc")
