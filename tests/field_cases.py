"""Programs that lie beside the field cases and make logs."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


def loaded(folder: Path, name: str) -> ModuleType:
    """A module that lies beside the data, with those beside it; the test is skipped where it is missing."""
    if not (folder / f"{name}.py").is_file():
        pytest.skip(f"{folder.name}/{name}.py is not here")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.setattr(sys, "dont_write_bytecode", True)
        spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return module


def loiter_log(data: Path, path: Path, *, rate: int, seed: int = 7, seconds: int = 90) -> Path:
    """A copter held by its own loops in gusts, without any sweep, logged at a rate [Hz] that divides 100."""
    simulator = loaded(data / "field" / "01-no-sweep", "sim_loiter")
    # Its own way leaves the file to be closed by the garbage collector, which the tests count as a fault.
    simulator.DF.save = lambda log, name: Path(name).write_bytes(bytes(log.b))
    simulator.log(str(path), simulator.fly(seed, T=seconds, dec=400 // rate))
    return path
