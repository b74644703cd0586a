"""Memory that is done with goes back to the system, also where something newer lies behind it."""

from __future__ import annotations

import platform
from pathlib import Path

import pytest

from swashplate import systems


def resident() -> float:
    """MB of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library keeps memory in its own way")
def test_what_lies_before_something_newer_goes_back() -> None:
    many = [bytes(1000) for _ in range(100_000)]
    newer = many.pop()
    full = resident()
    many.clear()
    kept = full - resident()
    systems.free_memory()
    assert full - resident() > 50.0 > kept
    assert len(newer) == 1000
