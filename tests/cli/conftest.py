"""Flights that the command line can read, made once a session."""

from __future__ import annotations

from pathlib import Path

import pytest

from simulated_flights import ten_seconds
from swashplate.cli import console


@pytest.fixture(autouse=True)
def no_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages are compared whole: a slow machine must not tell its stages between them."""
    monkeypatch.setattr(console, "_STAGES_AFTER", 3600.0)


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated log of 10 s, as netCDF."""
    return ten_seconds().save(tmp_path_factory.mktemp("flights") / "simulated.nc")
