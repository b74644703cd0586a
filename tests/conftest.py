"""What every test may ask for: the real data, where it is found, and double precision."""

from __future__ import annotations

import gc
import os
from functools import lru_cache
from pathlib import Path

import pytest
import typer.main
import typer.testing

# Tracing makes millions of small objects and no garbage: looking for some took a sixth of its time.
gc.set_threshold(200_000, 50, 1000)

# The runner builds the whole command line anew at every call, a quarter of a second each; it does not change.
typer.testing._get_command = lru_cache(typer.main.get_command)  # type: ignore[attr-defined]


@pytest.fixture(autouse=True, scope="module")
def _garbage_left_alone() -> None:
    gc.freeze()  # clocks and Hypothesis collect for themselves, which would look through all modules and programs


@pytest.fixture(autouse=True, scope="session")
def _nobodys_settings(tmp_path_factory: pytest.TempPathFactory) -> None:
    os.environ["XDG_CONFIG_HOME"] = str(tmp_path_factory.mktemp("settings"))  # mappings that a person has kept


ROOT = Path(__file__).resolve().parent.parent


def _shared_data() -> Path | None:
    places = [os.environ.get("SWASHPLATE_DATA"), ROOT.parent / "shared" / "data"]
    return next((Path(place) for place in places if place and Path(place).is_dir()), None)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real flights and bench records; the test is skipped where it is missing."""
    found = _shared_data()
    if found is None:
        pytest.skip("the real data is not here: set SWASHPLATE_DATA or put shared/data beside the checkout")
    return found


@pytest.fixture(scope="session")
def flight_july(shared_data: Path) -> Path:
    """The July hover flight (closed loop, crash at its end)."""
    return shared_data / "coax56" / "flight_2011-07-25_hover_crash.mat"


@pytest.fixture(scope="session")
def flight_august(shared_data: Path) -> Path:
    """The August vertical flight."""
    return shared_data / "coax56" / "flight_2011-08-01_vertical.mat"
