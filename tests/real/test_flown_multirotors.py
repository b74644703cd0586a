"""Betaflight's own SITL, as its user built it, flies each packaged multirotor by `accept_autopilot`: every line passes.

SWASHPLATE_BETAFLIGHT names the binary (2025.12 or later). Nothing of the firmware is in this project; without it the
proof is skipped.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import proof_page
import swashplate as sp
from swashplate.links.betaflight.gains import AXES

BINARY = os.environ.get("SWASHPLATE_BETAFLIGHT", "")
pytestmark = [
    pytest.mark.proof,
    pytest.mark.skipif(not BINARY, reason="SWASHPLATE_BETAFLIGHT names no SITL of Betaflight"),
    pytest.mark.xdist_group("betaflight"),
]
"""Its ports cannot be moved."""


@pytest.mark.parametrize("name", ["x8", "crazyflie"])
def test_every_line_passes_under_the_real_betaflight(name: str, tmp_path: Path) -> None:
    place = Path(os.environ.get("SWASHPLATE_PROOF", str(tmp_path))) / "firmware" / name
    found = sp.accept_autopilot(name, Path(BINARY), folder=place, timeout=60.0)
    assert found.log is not None
    lines = {line.what: line.found for line in found.lines}
    inspected = sp.read(found.log).inspect()
    told = ["its clock", "armed", "hover in ANGLE", "exchanges, lockstep"]
    proof_page.leave(
        f"firmware-{name}",
        {
            "title": f"Unmodified Betaflight flies {name}",
            "text": f"{found.version}, by `swash link accept` from a cold start; "
            f"{sum(line.passed is True for line in found.lines)} lines pass, {len(found.problems)} fail. "
            "The firmware is built outside this project.",
            "columns": ["what", "found"],
            "rows": [
                *([what, lines[what]] for what in told),
                *([f"{axis}: {what}", lines[f"{axis}: {what}"]] for axis in AXES for what in
                  ("clock of the log", "coherent", "response beside truth")),
                ["simulated seconds a second, beside other work", round(found.real_time, 1)],
                ["problems and incidents that inspect finds in the log", len(inspected.problems)],
            ],
            "passed": found.passed,
        },
    )  # fmt: skip
    assert found.problems == ()
    assert inspected.problems == ()
