"""ArduPilot's own SITL, as its user built it, flies each packaged vehicle by `accept_autopilot`: every line passes.

SWASHPLATE_ARDUPILOT names the folder that holds `arducopter-heli` and `arducopter` (4.5 or later). Nothing of the
firmware is in this project; without the folder the proof is skipped. SWASHPLATE_ARDUPILOT_BUILD says in a sentence what
of the sources was changed to build them, for the page.
"""

from __future__ import annotations

import os
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pymavlink")

import proof_page
import swashplate as sp
from swashplate.api import accept_autopilot as accepting
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES
from swashplate.links.ardupilot.runner import serve

FOLDER = os.environ.get("SWASHPLATE_ARDUPILOT", "")
BUILD = os.environ.get("SWASHPLATE_ARDUPILOT_BUILD", "")
FIRMWARE = {
    "raptor50": "arducopter-heli",
    "helion": "arducopter-heli",
    "xcell60": "arducopter-heli",
    "coax": "arducopter",
}
INSTANCE = {name: 60 + k for k, name in enumerate(FIRMWARE)}
"""Ports of their own, so that two may fly at once."""
LEAVES = 0.1
"""m: how far above where it stood a vehicle has left the ground."""

pytestmark = [
    pytest.mark.proof,
    pytest.mark.skipif(not FOLDER, reason="SWASHPLATE_ARDUPILOT names no folder with ArduPilot's SITL binaries"),
]


def turned_on_the_ground(flight: sp.Flight) -> float:
    """Degrees that the autopilot's yaw goes through between arming, where its log begins, and lift-off."""
    armed = flight.start
    down, at = flight.values("z"), flight.time("z")
    stood = float(np.median(down[(at > armed) & (at < armed + 4.0)]))
    left = float(at[(at > armed) & (down < stood - LEAVES)][0])
    stands = (flight.time("psi") >= armed) & (flight.time("psi") <= left)
    return float(np.degrees(np.ptp(np.unwrap(flight.values("psi")[stands]))))


@pytest.mark.parametrize("name", FIRMWARE)
def test_every_line_passes_under_the_real_firmware(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spent: list[float] = []

    def timed(*given: Any, **more: Any) -> None:
        begun = time.process_time()  # what reads MAVLink beside it counts too
        try:
            serve(*given, **more)
        finally:
            spent.append(time.process_time() - begun)

    monkeypatch.setattr(accepting, "serve", timed)
    place = Path(os.environ.get("SWASHPLATE_PROOF", str(tmp_path))) / "firmware" / name
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = sp.accept_autopilot(name, Path(FOLDER, FIRMWARE[name]), folder=place, instance=INSTANCE[name], timeout=60.0)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    firmware = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    assert found.log is not None
    flight = sp.read(found.log)
    inspected = flight.inspect()
    share, turned = 100.0 * spent[0] / (spent[0] + firmware), turned_on_the_ground(flight)
    lines = {line.what: line for line in found.lines}
    said = [
        [what, lines[what].found] for what in ("ready to be armed", *(w for w in lines if w.startswith("hover in ")))
    ]
    said += [
        [f"{axis}, {lines[f'sweep of {axis}'].found.split(', ')[-1]}: respond, fit-tf, fit-ss beside truth",
         "; ".join(lines[f"{axis}: {verb} beside truth"].found for verb in ("respond", "fit-tf", "fit-ss"))]
        for axis in MIXER_AXES
    ]  # fmt: skip
    proof_page.leave(
        f"firmware-{name}",
        {
            "title": f"Unmodified ArduPilot flies {name}",
            "text": f"{FIRMWARE[name]}, {found.version}, by `swash link accept` from a cold start; "
            f"{sum(line.passed is True for line in found.lines)} lines pass, {len(found.problems)} fail. "
            f"The firmware is built outside this project. {BUILD}".rstrip(),
            "columns": ["what", "found"],
            "rows": [
                *said,
                ["turn on the ground from arming to lift-off [deg]", round(turned, 1)],
                ["simulated seconds a second, beside other work", round(found.real_time, 1)],
                ["the link's share of the processor time [%]", round(share)],
                ["problems and incidents that inspect finds in the log", len(inspected.problems)],
            ],
            "passed": found.passed and not inspected.problems,
        },
    )
    assert found.problems == ()
    assert not any(line.passed is None and "beside truth" in line.what for line in found.lines), (
        "every estimate is judged"
    )
    assert inspected.problems == ()
